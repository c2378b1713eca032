"""A host that walks the robot at the given port, prints its process id, and communicates until it is killed."""

import os
import sys

from bifa.link import Uno
from bifa.rig import SerialRig

with SerialRig(sys.argv[1]) as rig, Uno(rig.transport, rig.clock) as uno:
    uno.connect()
    uno.upload({"host_timeout_s": float(sys.argv[2])})
    uno.run()
    uno.stream(True)
    print(os.getpid(), flush=True)
    while True:
        uno.samples(0.02)
        uno.status()
