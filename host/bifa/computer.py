"""Messages that differ between Linux, macOS and Windows."""

import sys

PORT_BUSY = "{port} is in use: close the serial monitor or the other program"

EXAMPLE_PORT = {"win32": "COM3", "darwin": "/dev/cu.usbmodem1101"}.get(sys.platform, "/dev/ttyACM0")
PORT_REFUSED = (
    "no permission to open {port}: sudo usermod -aG dialout $USER, then log in again"
    if sys.platform == "linux"
    else PORT_BUSY  # macOS and Windows let every user open a port that is not in use
)
PORT_QUESTIONS = (
    "is it plugged in, is another program using it, and may you use serial ports (group dialout)?"
    if sys.platform == "linux"
    else "is it plugged in, and is another program using it?"
)
