"""`.ci/run`: checks, tests as elsewhere and tests are all run, whatever the first says; each can fail it."""

import subprocess

import pytest


@pytest.mark.parametrize("failing", [(), ("lint",), ("portability",), ("test",), ("lint", "test")])
def test_each_is_run_and_each_can_fail_it(project, tmp_path, failing):
    fake = tmp_path / "make"
    fake.write_text(f'#!/bin/sh\necho "ran $1"\ncase " {" ".join(failing)} " in *" $1 "*) exit 2;; esac\n')
    fake.chmod(0o755)
    done = subprocess.run(
        [project / ".ci" / "run"],
        env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode == 0) == (not failing)
    assert done.stdout == "ran lint\nran portability\nran test\n"
