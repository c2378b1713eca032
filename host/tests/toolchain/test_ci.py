"""`.ci/run` runs lint, the portability tests and the tests regardless of earlier failures; each can fail it."""

import shutil
import subprocess

import portability
import pytest


@pytest.mark.parametrize("failing", [(), ("lint",), ("portability",), ("test",), ("lint", "test")])
def test_each_is_run_and_each_can_fail_it(project, program, tmp_path, failing):
    program(tmp_path / "make", f'echo "ran $*"\ncase " {" ".join(failing)} " in *" $1 "*) exit 2;; esac')
    done = subprocess.run(
        [project / ".ci" / "run"],
        env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode == 0) == (not failing)
    assert done.stdout == "ran lint\nran portability ARGS=--another-blas\nran test ARGS=\n"


@pytest.mark.parametrize("ran", [True, False])
def test_the_estimation_is_tested_once(project, program, tmp_path, ran):
    """The estimation tests are left out if the portability run has covered them, and run otherwise."""
    shutil.copytree(project / ".ci", tmp_path / ".ci")
    touch = "mkdir -p build/portability; touch build/portability/ran" if ran else "true"
    program(tmp_path / "make", f'case $1 in portability) {touch};; test) echo "$2";; esac')
    (tmp_path / "build" / "portability").mkdir(parents=True)
    (tmp_path / "build" / "portability" / "ran").touch()  # left by an earlier run, so it does not count
    environment = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    done = subprocess.run([tmp_path / ".ci" / "run"], env=environment, capture_output=True, text=True, check=True)
    left_out = [f"--ignore=tests/{folder}" for folder in portability.ESTIMATION] if ran else []
    assert done.stdout == f"ARGS={' '.join(left_out)}\n"
