"""`.ci/run` runs lint, the portability tests and the tests regardless of earlier failures; each can fail it. `make test
ARGS=--quick` leaves out only slow and real-time tests; a full run starts with the slow tests. `make bench` runs every
benchmark, merges the figures into bench.json, and reports failures."""

import json
import shutil
import subprocess
import sys

import portability
import pytest

from benchmarks import __main__ as runner

FILES = ("tests/toolchain/test_flash.py", "tests/toolchain/test_platformio_offline.py")


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


def collected(project, *options: str) -> list[str]:
    """Files of the tests that would run, in order."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-p", "no:cacheprovider", *options, *FILES]
    done = subprocess.run(command, cwd=project / "host", capture_output=True, text=True, check=True)
    return [line.split("::")[0] for line in done.stdout.splitlines() if "::" in line]


def test_the_quick_loop_leaves_out_what_is_slow_and_nothing_else_and_a_full_run_begins_with_it(project):
    assert FILES[0] in (quick := collected(project, "--quick"))
    assert FILES[1] not in quick
    every = collected(project)
    assert every.count(FILES[0]) == quick.count(FILES[0])
    assert set(every[:2]) == {FILES[1]}


@pytest.fixture
def bench_json(tmp_path, monkeypatch):
    """Three benchmarks that replace the project's, one of them broken, with their own bench.json."""
    folder = tmp_path / "benchmarks"
    folder.mkdir()
    (folder / "bench_first.py").write_text('def run():\n    print("first: 1")\n    return {"first": 1.0}\n')
    (folder / "bench_broken.py").write_text("def run():\n    raise RuntimeError\n")
    (folder / "bench_second.py").write_text('def run():\n    return {"second": 2.0}\n')
    monkeypatch.setattr(runner.benchmarks, "__path__", [str(folder)])
    monkeypatch.setattr(runner, "BENCH_JSON", tmp_path / "bench.json")
    yield tmp_path / "bench.json"
    for name in ("first", "broken", "second"):
        sys.modules.pop(f"benchmarks.bench_{name}", None)


def bench(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["bench", *arguments])
    return runner.main()


def test_a_broken_benchmark_fails_the_run_but_not_the_others(bench_json, monkeypatch, capsys):
    assert bench(monkeypatch) == 1
    assert json.loads(bench_json.read_text()) == {"first": 1.0, "second": 2.0}
    assert "failed: broken" in capsys.readouterr().err


def test_one_topic_keeps_the_figures_of_the_others(bench_json, monkeypatch):
    bench_json.write_text('{"first": 0.5, "other": 7}')
    assert bench(monkeypatch, "--only", "first") == 0
    assert json.loads(bench_json.read_text()) == {"first": 1.0, "other": 7}


def test_an_unknown_topic_is_refused(bench_json, monkeypatch):
    with pytest.raises(SystemExit):
        bench(monkeypatch, "--only", "nothing")
