"""What can go wrong between host, PlatformIO and board; each says what to do."""

from bifa.errors import BifaError


class ToolchainError(BifaError):
    """A tool is missing, a build failed, or the board could not be written."""
