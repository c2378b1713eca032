"""What people see of a running Uno: the interactive console and the live monitor."""
