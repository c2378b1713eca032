"""The package is this folder itself, and so are its subpackages: found, not listed."""

from setuptools import find_packages, setup

setup(
    script_name="setup.py",  # which is no module of the package
    package_dir={"lacuna": "."},
    packages=["lacuna", *(f"lacuna.{name}" for name in find_packages("."))],
)
