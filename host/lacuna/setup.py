"""Packaging: this folder itself is the package `lacuna`; subpackages are found automatically."""

from setuptools import find_packages, setup

setup(
    script_name="setup.py",  # not a module of the package
    package_dir={"lacuna": "."},
    packages=["lacuna", *(f"lacuna.{name}" for name in find_packages("."))],
)
