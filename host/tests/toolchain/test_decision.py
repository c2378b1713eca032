"""The choice between registry and stand-ins is made once, kept while it is valid, and reported in one line."""

import sys

import pytest
from provision import __main__ as provisioning
from provision import decision, registry, stand_ins
from provision.decision import Decision


@pytest.fixture
def world(core_dir, monkeypatch):
    """A project in a temporary folder; installations are only noted."""
    done = []
    monkeypatch.delenv("PLATFORMIO_CORE_DIR", raising=False)
    monkeypatch.setattr(sys, "argv", ["provision"])
    monkeypatch.setattr(provisioning, "CORE_DIR", core_dir)
    monkeypatch.setattr(provisioning, "install_from_registry", lambda: done.append("registry"))
    monkeypatch.setattr(provisioning, "install_avr_tools", lambda: done.append("avr"))
    monkeypatch.setattr(stand_ins, "lay_out", lambda folder: done.append("stand-ins"))
    return done


@pytest.mark.parametrize(
    ("answers", "installed", "line"),
    [
        (True, ["registry"], "PlatformIO packages: from PlatformIO's registry\n"),
        (False, ["avr", "stand-ins"], "PlatformIO packages: stand-ins in .platformio"),
    ],
)
def test_the_registry_decides_and_one_line_says_so(world, monkeypatch, capsys, answers, installed, line):
    monkeypatch.setattr(registry, "answers", lambda urls: answers)
    assert provisioning.main() == 0
    assert world == installed
    out = capsys.readouterr().out
    assert out.startswith(line)
    assert out.count("\n") == 1


def test_the_second_time_nothing_is_asked_or_installed(world, monkeypatch, core_dir):
    monkeypatch.setattr(registry, "answers", lambda urls: False)
    provisioning.main()
    world.clear()
    monkeypatch.setattr(registry, "answers", lambda urls: pytest.fail("asked again"))
    assert provisioning.main() == 0
    assert world == []


def test_going_back_to_the_registry_removes_the_stand_ins_settings(world, monkeypatch, core_dir):
    (core_dir / stand_ins.SETTINGS_FILE).write_text(stand_ins.SETTINGS)
    monkeypatch.setattr(registry, "answers", lambda urls: True)
    provisioning.main()
    assert not (core_dir / stand_ins.SETTINGS_FILE).exists()


def test_a_foreign_core_directory_is_refused_not_hidden_behind(world, monkeypatch, capsys):
    monkeypatch.setattr(registry, "answers", lambda urls: False)
    monkeypatch.setenv("PLATFORMIO_CORE_DIR", "/somewhere/else")
    assert provisioning.main() == 1
    assert "PLATFORMIO_CORE_DIR is set" in capsys.readouterr().err
    assert world == []


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"source": "stand-ins"}', '{"source": "x", "fingerprint": "old"}'])
def test_a_decision_that_does_not_fit_is_forgotten(core_dir, text):
    (core_dir / decision.FILE).write_text(text)
    assert decision.remembered(core_dir) is None


def test_a_moved_project_is_provisioned_anew(core_dir, tmp_path):
    Decision("stand-ins", decision.fingerprint(core_dir)).save(core_dir)
    assert decision.remembered(core_dir) is not None
    moved = core_dir.rename(tmp_path / "moved")
    assert decision.remembered(moved) is None
