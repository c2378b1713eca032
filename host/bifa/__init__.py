"""bifa: drive a soft in-pipe robot and learn from data how it really behaves."""

__version__ = "0.1.0"
