"""`bifa monitor --web` in a process of its own."""

import os
import re
import signal
import subprocess
import sys
from contextlib import closing

from harness.pty_uno import PtyUno
from harness.waiting import until
from harness.web_socket import WebSocket


class WebMonitor:
    """The command, the Uno that it is connected to, and its page's address."""

    def __init__(self, *options, port=None, uno=None):
        self.uno = uno or (PtyUno() if port is None else None)
        command = [sys.executable, "-m", "bifa", "monitor", "--web", "--port", port or self.uno.device]
        command += [] if "--web-port" in options else ["--web-port", "0"]
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(
            [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
        )
        self.said = self.process.stdout.readline()
        self.url = re.search(r"http://\S+", self.said)[0]
        self.origin, self.token = self.url.split("/#")
        self.port = int(self.origin.rpartition(":")[2])

    def gait(self):
        """The parameters that the Uno has."""
        with closing(WebSocket(self.port)) as watcher:
            return watcher.until(lambda state: "parameters" in state)["parameters"]

    def until(self, state, timeout_s=10.0):
        """Whether the board reaches this state in time."""
        return until(lambda: self.uno.board.state == state, timeout_s)

    def interrupt(self):
        """Press Ctrl-C; return the exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(15)

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        if self.uno:
            self.uno.unplug()
