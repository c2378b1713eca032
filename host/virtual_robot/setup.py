# SPDX-License-Identifier: GPL-3.0-or-later
"""Packaging: this folder itself is the package `virtual_robot`, with its subpackages and the C parts that compile."""

import sys
from pathlib import Path

from setuptools import Distribution, find_packages, setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from build import PARTS, compile_part  # noqa: E402  (the module beside this file)


class BuildWithParts(build_py):
    """Compile the C parts, except in an editable installation: there `python -m virtual_robot.build` does it."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            for part in PARTS:
                try:
                    compile_part(part, Path(self.build_lib) / "virtual_robot" / part.built.relative_to(HERE))
                except Exception as error:  # any compiler error, wrapped by cffi; the rest works without it
                    self.warn(f"left out {part.name}, which did not compile: {error}")


class WithParts(Distribution):
    """Mark the wheel as specific to the platform that compiled it."""

    def has_ext_modules(self) -> bool:
        return True


setup(
    script_name="setup.py",  # not a module of the package
    package_dir={"virtual_robot": "."},
    packages=["virtual_robot", *(f"virtual_robot.{name}" for name in find_packages("."))],
    cmdclass={"build_py": BuildWithParts},
    distclass=WithParts,
)
