"""The host's use of the firmware tools: PlatformIO, the built image, the board's port."""

from bifa.toolchain.flash import build_image, choose_port, upload_image, write_with_avrdude
from bifa.toolchain.project import ToolchainError, find_project, project_folder

__all__ = [
    "ToolchainError",
    "build_image",
    "choose_port",
    "find_project",
    "project_folder",
    "upload_image",
    "write_with_avrdude",
]
