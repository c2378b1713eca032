"""Live views of a running Uno: the interactive console, the monitor, the live page; and recording."""
