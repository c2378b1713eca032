"""Both stand-in platforms, which put their libraries back when these are missing.

PlatformIO calls `configure_project_packages` before it looks for a project's libraries, so the stand-in
libraries survive `pio run -t fullclean` and a removed `.pio` folder.
"""

import filecmp
import shutil
from pathlib import Path

from platformio import __version__
from platformio.exception import UserSideException
from platformio.package.manager.core import get_core_package_dir
from platformio.platform.base import PlatformBase


class OtherPlatformIO(UserSideException):
    """Raised at once; PlatformIO itself would try for a minute to download its own version's SCons."""

    MESSAGE = "the stand-ins were laid out for another PlatformIO than {0}; use .venv/bin/pio (or run `make setup`)"


class StandInPlatform(PlatformBase):
    """A platform whose packages were laid out by tools/provision instead of being downloaded."""

    def configure_project_packages(self, env, targets=None):
        """Copy the libraries kept beside the platforms into the environment's library folder."""
        super().configure_project_packages(env, targets)
        if get_core_package_dir("tool-scons", auto_install=False) is None:
            raise OtherPlatformIO(__version__)
        core_dir = Path(self.config.get("platformio", "core_dir"))
        destination = Path(self.config.get("platformio", "libdeps_dir")) / env
        # With this file, PlatformIO would uninstall libraries that platformio.ini used to name differently.
        (destination / "integrity.dat").unlink(missing_ok=True)
        for kept in sorted((core_dir / "stand_in_libraries" / self.name).iterdir()):
            installed = destination / kept.name
            if _same_package(kept, installed):
                continue
            shutil.rmtree(installed, ignore_errors=True)
            shutil.copytree(kept, installed)


def _same_package(kept: Path, installed: Path) -> bool:
    digest = installed / ".contents"
    return digest.is_file() and filecmp.cmp(kept / ".contents", digest, shallow=False)


AtmelavrPlatform = NativePlatform = StandInPlatform
