"""tools/portability.py: an environment has the properties it claims, or the run reports why not."""

import subprocess
import sys
from dataclasses import replace

import portability
import pytest
from portability import ENVIRONMENTS, Environment, IgnoredError, RefusedError, settings

TESTS = """
import os, pytest
@pytest.mark.parametrize("n", range(20))
def test_order(n):
    print(f"<{n}>")
"""


@pytest.fixture(autouse=True)
def out_of_the_tree(tmp_path, monkeypatch):
    monkeypatch.setattr(portability, "BUILD", tmp_path / "build")


@pytest.mark.parametrize("environment", ENVIRONMENTS, ids=lambda e: e.name)
def test_every_environment_is_what_it_says_or_this_machine_cannot_be_it(environment):
    try:
        variables, cores = settings(environment)
    except RefusedError as refusal:
        pytest.skip(str(refusal))
    assert variables["OPENBLAS_CORETYPE"] == environment.kernel
    assert cores


def test_a_variable_without_effect_does_not_pass_for_a_machine():
    with pytest.raises(IgnoredError, match="Atlantis"):
        settings(Environment("sunk", "", expected={"blas": ["Atlantis"]}))


def test_instructions_that_are_not_there_are_not_asked_for(monkeypatch):
    monkeypatch.setitem(portability.KERNELS, "Haswell", "AVX9000")
    with pytest.raises(RefusedError, match="no AVX9000"):
        settings(replace(ENVIRONMENTS[0], kernel="Haswell"))


@pytest.mark.parametrize("own", ["Haswell", "Zen", "SkylakeX", "Nehalem", "Prescott"])
def test_another_blas_is_not_this_machines_own_nor_its_twin(own, monkeypatch):
    monkeypatch.setattr(portability, "features", lambda: {"features": ["SSE42", "AVX2", "AVX512_SKX"]})
    kernel = portability.another_blas({"blas": [own]}).kernel
    assert kernel in portability.KERNELS
    assert kernel != portability.ALIKE.get(own, own)


@pytest.mark.parametrize(("status", "said"), [(0, "passed"), (1, "FAILED")])
def test_the_last_line_says_what_came_of_it(monkeypatch, capfd, status, said):
    commands = []

    def run(command, **_):
        commands.append([str(word) for word in command])
        return subprocess.CompletedProcess(command, status)

    monkeypatch.setattr(portability, "settings", lambda environment: ({}, {0}))
    monkeypatch.setattr(portability.subprocess, "run", run)
    assert portability.main(["--only", "server", "--", "-k", "settle"]) == status
    assert said in "".join(capfd.readouterr()).splitlines()[-1]
    assert "tests/lacuna" in commands[0]
    assert commands[0][-2:] == ["-k", "settle"]


def test_the_numerical_folders_exist(project):
    assert all(
        (project / "host" / "tests" / folder).is_dir() for folder in (*portability.NUMERICAL, *portability.ESTIMATION)
    )


def test_another_order_is_the_same_for_the_same_seed(project, tmp_path):
    (tmp_path / "test_some.py").write_text(TESTS)
    (tmp_path / "conftest.py").symlink_to(project / "host" / "tests" / "conftest.py")

    def order(seed: str) -> list[str]:
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--collect-only", "--rootdir=."]
        environment = {"BIFA_TEST_ORDER": seed, "PATH": "", "PYTHONPATH": str(project / "host")}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return [line for line in done.stdout.splitlines() if "test_order" in line]

    assert order("") != order("1") == order("1") != order("2")
    assert sorted(order("1")) == sorted(order(""))
