"""`.ci/run`: both the checks and the tests are run, whatever the first says, and either can fail it."""

import subprocess

import pytest


@pytest.mark.parametrize(("lint", "tests", "passes"), [(0, 0, True), (2, 0, False), (0, 2, False), (2, 2, False)])
def test_either_can_fail_it(project, tmp_path, lint, tests, passes):
    fake = tmp_path / "make"
    fake.write_text(f'#!/bin/sh\necho "ran $1"\ncase $1 in lint) exit {lint};; test) exit {tests};; esac\n')
    fake.chmod(0o755)
    done = subprocess.run(
        [project / ".ci" / "run"],
        env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode == 0) == passes
    assert done.stdout == "ran lint\nran test\n"
