"""`make bench` runs every benchmark, merges the figures into bench.json, and reports failures."""

import json
import sys

import pytest

from benchmarks import __main__ as runner


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


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["bench", *arguments])
    return runner.main()


def test_a_broken_benchmark_fails_the_run_but_not_the_others(bench_json, monkeypatch, capsys):
    assert run(monkeypatch) == 1
    assert json.loads(bench_json.read_text()) == {"first": 1.0, "second": 2.0}
    assert "failed: broken" in capsys.readouterr().err


def test_one_topic_keeps_the_figures_of_the_others(bench_json, monkeypatch):
    bench_json.write_text('{"first": 0.5, "other": 7}')
    assert run(monkeypatch, "--only", "first") == 0
    assert json.loads(bench_json.read_text()) == {"first": 1.0, "other": 7}


def test_an_unknown_topic_is_refused(bench_json, monkeypatch):
    with pytest.raises(SystemExit):
        run(monkeypatch, "--only", "nothing")
