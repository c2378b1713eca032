"""`bifa monitor --web` as a program of its own."""

import os
import re
import subprocess
import sys
import time

from harness.pty_uno import PtyUno
from harness.web_socket import WebSocket


class WebMonitor:
    """The command, the Uno that it talks to, and its page's address."""

    def __init__(self, *options, port=None, uno=None):
        self.uno = uno or (PtyUno() if port is None else None)
        command = [sys.executable, "-m", "bifa", "monitor", "--web"]
        command += ["--port", port or self.uno.device]
        command += [] if "--web-port" in options else ["--web-port", "0"]
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(
            [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
        )
        self.said = self.process.stdout.readline()
        self.url = re.search(r"http://\S+", self.said)[0]
        self.origin, self.token = self.url.split("/#")

    def gait(self):
        """What the Uno has."""
        watcher = WebSocket(int(self.origin.rpartition(":")[2]))
        try:
            return watcher.until(lambda state: "parameters" in state)["parameters"]
        finally:
            watcher.close()

    def until(self, state, timeout_s=10.0):
        """Wait for the board's state."""
        end_s = time.monotonic() + timeout_s
        while self.uno.board.state != state and time.monotonic() < end_s:
            time.sleep(0.02)
        return self.uno.board.state

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        if self.uno:
            self.uno.unplug()
