# SPDX-License-Identifier: GPL-3.0-or-later
"""The package is this folder itself, with its subpackages and with the C parts that this machine can compile."""

import sys
from pathlib import Path

from setuptools import Distribution, find_packages, setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from build import PARTS, compile_part  # noqa: E402  (the module beside this file)


class BuildWithParts(build_py):
    """An editable installation compiles nothing: `python -m virtual_robot.build` does, beside the sources."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            for part in PARTS:
                try:
                    compile_part(part, Path(self.build_lib) / "virtual_robot" / part.built.relative_to(HERE))
                except Exception as error:  # whatever the compiler raised, wrapped by cffi; the rest works without
                    self.warn(f"left out, because it did not compile: {part.name} ({error})")


class WithParts(Distribution):
    """The wheel belongs to the machine that compiled it."""

    def has_ext_modules(self) -> bool:
        return True


setup(
    script_name="setup.py",  # which is no module of the package
    package_dir={"virtual_robot": "."},
    packages=["virtual_robot", *(f"virtual_robot.{name}" for name in find_packages("."))],
    cmdclass={"build_py": BuildWithParts},
    distclass=WithParts,
)
