"""PlatformIO accepts the stand-in packages as installed, at the versions it requires."""

import configparser
import json

import pytest
from platformio.dependencies import get_core_dependencies
from platformio.package.manager.library import LibraryPackageManager
from platformio.package.manager.tool import ToolPackageManager
from platformio.package.meta import PackageItem, PackageSpec
from platformio.test.runners.unity import UnityTestRunner
from provision import stand_ins
from provision.errors import ProvisionError
from provision.package import Package, build_suffix


@pytest.fixture
def laid_out(core_dir, programs, arduino_core):
    stand_ins.lay_out(core_dir)
    return core_dir


@pytest.mark.parametrize(
    "asked",
    [
        f"platformio/tool-scons@{get_core_dependencies()['tool-scons']}",
        "platformio/toolchain-atmelavr@~1.70300.0",
        "platformio/framework-arduino-avr@~5.3.0",
        "platformio/tool-avrdude",
        "platformio/tool-simavr",
    ],
)
def test_platformio_finds_each_tool(laid_out, asked):
    found = ToolPackageManager(str(laid_out / "packages")).get_package(PackageSpec(asked))
    assert found is not None


@pytest.mark.parametrize("platform", ["native", "atmelavr"])
def test_platformio_finds_its_test_framework_in_every_environment(laid_out, platform):
    [asked] = UnityTestRunner.EXTRA_LIB_DEPS
    libraries = LibraryPackageManager(str(laid_out / "stand_in_libraries" / platform))
    assert libraries.get_package(PackageSpec(asked)) is not None


def test_platformio_finds_the_dac_library_that_the_project_names(laid_out, project):
    settings = configparser.ConfigParser()
    settings.read(project / "platformio.ini")
    libraries = LibraryPackageManager(str(laid_out / "stand_in_libraries" / "atmelavr"))
    [asked] = settings["env:uno"]["lib_deps"].split("\n")[1:]
    assert libraries.get_package(PackageSpec(asked)) is not None


def test_the_true_origin_stays_visible(laid_out):
    for label in laid_out.rglob(".piopm"):
        version = json.loads(label.read_text())["version"]
        assert "+" in version, f"{label.parent} does not say that it is a stand-in"


def test_each_stand_in_platform_matches_its_manifest(laid_out):
    for name in ("native", "atmelavr"):
        folder = laid_out / "platforms" / name
        manifest = json.loads((folder / "platform.json").read_text())
        assert PackageItem(str(folder)).metadata.name == manifest["name"] == name
        assert (folder / "platform.py").is_file()


def test_the_settings_point_into_the_project_and_name_no_absolute_path(laid_out):
    text = (laid_out / stand_ins.SETTINGS_FILE).read_text()
    assert "core_dir = .platformio\n" in text
    assert "/" not in text.split("[platformio]")[1]


def test_laying_out_twice_gives_the_same_files(laid_out):
    before = sorted(path.relative_to(laid_out) for path in laid_out.rglob("*"))
    stand_ins.lay_out(laid_out)
    assert sorted(path.relative_to(laid_out) for path in laid_out.rglob("*")) == before


@pytest.mark.parametrize("missing", ["avr-gcc", "avr-objcopy", "avrdude", "simavr"])
def test_a_missing_program_is_named_with_its_package(core_dir, programs, arduino_core, missing):
    (programs / missing).unlink()
    with pytest.raises(ProvisionError, match=rf"^{missing} is not on PATH; install it: sudo apt-get install \w"):
        stand_ins.lay_out(core_dir)


def test_a_missing_arduino_core_is_named_with_its_package(core_dir, programs, arduino_core):
    (arduino_core / "variants").rmdir()
    with pytest.raises(ProvisionError, match="variants is missing; install it: sudo apt-get install arduino-core-avr"):
        stand_ins.lay_out(core_dir)


def test_an_interrupted_installation_leaves_the_old_package(tmp_path):
    def good(folder):
        (folder / "file").write_text("old")

    def broken(folder):
        (folder / "file").write_text("new")
        raise KeyboardInterrupt

    folder = tmp_path / "package"
    Package("tool", "owner", "name", "1.0.0", good).install(folder)
    with pytest.raises(KeyboardInterrupt):
        Package("tool", "owner", "name", "1.0.1", broken).install(folder)
    assert (folder / "file").read_text() == "old"
    assert json.loads((folder / ".piopm").read_text())["version"] == "1.0.0"


def test_debian_versions_become_valid_build_suffixes():
    assert build_suffix("debian", "arduino-core-avr", "1.8.7+dfsg-1~deb12u1") == (
        "debian.arduino-core-avr.1.8.7.dfsg-1.deb12u1"
    )
