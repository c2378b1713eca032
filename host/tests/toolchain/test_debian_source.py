"""Source packages are fetched with our own apt configuration, derived from the machine's archives."""

import io
import tarfile

import pytest
from provision import unity
from provision.debian_source import fetch_source, source_entries
from provision.errors import ProvisionError

DEB822 = """\
# the archive
Types: deb
URIs: http://archive.example/debian
Suites: stable stable-updates
Components: main
Signed-By: /usr/share/keyrings/archive.gpg

Types: deb-src
URIs: http://sources.example/debian
Suites: stable
Components: main

Enabled: no
Types: deb
URIs: http://disabled.example/debian
Suites: stable
Components: main
"""


@pytest.fixture
def apt(tmp_path):
    folder = tmp_path / "apt"
    (folder / "sources.list.d").mkdir(parents=True)
    return folder


SIGNED = "[signed-by=/usr/share/keyrings/archive.gpg]"
ONE_LINE = """\
# deb http://comment.example/ stable main
deb [arch=amd64] http://archive.example/debian stable main contrib
deb-src http://sources.example/debian stable main
"""


@pytest.mark.parametrize(
    ("file", "text", "entries"),
    [
        (
            "sources.list.d/debian.sources",
            DEB822,
            [
                f"deb-src {SIGNED} http://archive.example/debian stable main",
                f"deb-src {SIGNED} http://archive.example/debian stable-updates main",
            ],
        ),
        ("sources.list", ONE_LINE, ["deb-src [arch=amd64] http://archive.example/debian stable main contrib"]),
        ("sources.list.d/other.list.disabled", "deb http://other.example/ stable main\n", []),
    ],
    ids=["deb822", "one line each", "disabled"],
)
def test_entries_become_source_entries_and_a_disabled_file_is_left_alone(apt, file, text, entries):
    (apt / file).write_text(text)
    assert source_entries(apt).splitlines() == entries


@pytest.mark.parametrize(("text", "told"), [("", "names no Debian archive"), (ONE_LINE, "apt-get is not on PATH")])
def test_a_machine_without_an_archive_or_without_apt_is_told_so(apt, only_path, tmp_path, text, told):
    (apt / "sources.list").write_text(text)
    with pytest.raises(ProvisionError, match=told):
        fetch_source("cjson", tmp_path / "scratch", apt)


def test_apt_gets_only_private_folders_and_its_complaint_is_passed_on(apt, program, only_path, tmp_path):
    (apt / "sources.list").write_text(ONE_LINE)
    program(only_path / "apt-get", f'echo "$@" >> {tmp_path}/calls\necho "E: no such archive" >&2\nexit 100')
    scratch = tmp_path / "scratch"
    with pytest.raises(ProvisionError, match="could not fetch the source package cjson: E: no such archive"):
        fetch_source("cjson", scratch, apt)
    call = (tmp_path / "calls").read_text()
    for option in ("Dir::Etc::SourceList", "Dir::State::Lists", "Dir::Cache"):
        assert f"{option}={scratch}" in call
    assert "Dir::Etc::SourceParts=-" in call


def archive(path, names, text="x"):
    with tarfile.open(path, "w:gz") as tar:
        for name in names:
            member = tarfile.TarInfo(name)
            member.size = len(text)
            tar.addfile(member, io.BytesIO(text.encode()))
    return path


def test_unity_is_taken_out_of_its_carrier_and_reads_platformios_configuration(tmp_path):
    names = [f"cJSON-1.7.15/tests/unity/src/{name}" for name in unity.FILES]
    carrier = archive(tmp_path / "cjson.orig.tar.gz", [*names, "cJSON-1.7.15/cJSON.c"], unity.CARRIERS_CONFIGURATION)
    unity.extract([carrier], tmp_path / "src")
    assert sorted(path.name for path in (tmp_path / "src").iterdir()) == sorted(unity.FILES)
    assert "UNITY_INCLUDE_CONFIG_H" in (tmp_path / "src" / "unity_internals.h").read_text()


def test_a_carrier_without_unity_is_named(tmp_path):
    carrier = archive(tmp_path / "cjson.orig.tar.gz", ["cJSON-2/cJSON.c"])
    with pytest.raises(ProvisionError, match=r"cjson no longer carries Unity \(unity.c, unity.h, unity_internals.h\)"):
        unity.extract([carrier], tmp_path / "src")
