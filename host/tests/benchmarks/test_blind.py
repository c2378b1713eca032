"""The report of a blind trial and the records it is printed from."""

import json
from unittest.mock import Mock

import pytest

from benchmarks import blind, blind_figures, records


def record(seed: int, *named: str, kind: str = "single", truth: str = "leak", matters: bool = False) -> dict:
    """A record as `diagnose_sealed` writes it, for a data set with a leak of 0.05 /s."""
    effect = {"interval_90": {"rate_per_s": [0.0412345678, 0.06]}, "confusable_with": [], "probability": 0.99}
    error = {"fitted": 1.0, "held_out": 1.0, "held_out_conditions": 1.0, "by_experiment": {"step_response": 1.0}}
    return {
        "kind": kind,
        "seed": seed,
        "truth": [truth] if kind != "none" else [],
        "sizes": {truth: 0.8},
        "values": {truth: {"rate_per_s": 0.05}},
        "base_values": {"mu_s": 0.45, "mu_k": 0.35},
        "base_parameters": {
            "mu_s": {"value": 0.46, "interval_90": [0.44, 0.48]},
            "mu_k": {"value": 0.34, "interval_90": [0.33, 0.349]},
            "body_shape_01": {"value": 0.1, "interval_90": [-1.0, 1.2]},
        },
        "verdict": "identified" if named else "none",
        "effects": [{"name": name} | effect for name in named],
        "error": {"before": error | {"held_out": 3.0}, "after": error | {"held_out": 1.1}, "noise_floor": error},
        "remainder": {"matters": matters, "text": "a sentence"},
        "processor_seconds": 50.123456,
        "baselines": {name: list(named) for name in blind_figures.BASELINES},
    }


RECORDS = [record(1, "leak"), record(2, "backlash", "leak"), record(3), record(4, kind="none"), record(5, kind="none")]


def test_rates_count_what_was_named_and_what_was_not(capsys):
    blind_figures.report(RECORDS, "own")
    said = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert said[:4] == [
        "one effect: named first 1/3 = 0.33 [0.06, 0.79]",
        "one effect: in the reported set 2/3 = 0.67 [0.21, 0.94]",
        "mean size of the reported set 1.50",
        "no effect: verdict none 2/2 = 1.00 [0.34, 1.00]",
    ]
    assert "90 % intervals of sizes hold the truth 2/2 = 1.00 [0.34, 1.00]" in said
    assert "90 % intervals of base parameters hold the truth 3/6 = 0.50 [0.19, 0.81]" in said
    assert "1 leak backlash + leak" in said


def test_what_the_base_model_hardly_misses_is_told_apart():
    small = {"held_out": 1.09, "held_out_conditions": 0.99}
    outside = [record(k, kind="outside", truth="pipe_joint") for k in range(3)]
    outside[1]["error"]["before"] |= small
    outside[2]["error"]["before"] |= small | {"held_out_conditions": 1.11}
    rates = {name.split(":")[1].strip(): hits for name, hits in blind_figures.rates(outside, "foreign").items() if hits}
    assert rates["never plainly explained"] == [False] * 3
    assert rates["never plainly explained, where there is a gap"] == [False] * 2


def test_where_there_is_no_gap_nothing_is_closed():
    outside = record(1, kind="outside", truth="pipe_joint")
    outside["error"]["before"]["held_out"] = 0.99 * outside["error"]["noise_floor"]["held_out"]
    outside["error"]["after"]["held_out"] = 0.98 * outside["error"]["noise_floor"]["held_out"]
    assert blind_figures.rates([outside], "foreign")["outside: half the gap closed by what is learnt"] == [False]


def test_a_table_has_the_rates_of_all_truths_beside_what_is_required():
    found = blind_figures.table({"own": RECORDS, "realistic": RECORDS[:1], "foreign": []})
    rows = {cells[1]: cells[2:-1] for cells in ([c.strip() for c in row.split("|")] for row in found.splitlines())}
    assert rows[""][:2] == ["own, 5 data sets", "required"]
    assert rows["one effect: named first"] == [
        *("1/3 = 0.33 [0.06, 0.79]", "0.97"),
        *("1/1 = 1.00 [0.21, 1.00]", "0.95"),
        *("", "0.90"),
    ]
    assert rows["mean size of the reported set"] == ["1.50", "1.1", "1.00", "1.2", "0.00", "1.4"]
    assert rows["90 % intervals of sizes hold the truth"][4:] == ["", "-"]
    assert len({len(cells) for cells in rows.values()}) == 1


def test_records_print_the_report_that_they_were_kept_from_and_written_again_are_the_same(tmp_path, capsys):
    blind_figures.report(RECORDS, "own")
    whole = capsys.readouterr().out
    first, second = tmp_path / "first.jsonl", tmp_path / "second.jsonl"
    records.write(first, map(blind_figures.brief, RECORDS))
    assert len(first.read_text().splitlines()) == len(RECORDS)
    kept = records.read(first, "kind", "seed")
    assert [seed for _, seed in kept] == [1, 2, 3, 4, 5]
    blind_figures.report(list(kept.values()), "own")
    assert capsys.readouterr().out == whole
    records.write(second, map(blind_figures.brief, kept.values()))
    assert first.read_bytes() == second.read_bytes()


def test_a_trial_goes_on_from_its_records(tmp_path, monkeypatch, capsys):
    kept = tmp_path / "own.jsonl"
    records.write(kept, [blind_figures.brief(record(10, "leak"))])
    diagnosed = Mock(side_effect=lambda job, out, threads: record(job.seed, job.effect, truth=job.effect))
    monkeypatch.setattr(blind, "diagnose_sealed", diagnosed)
    wanted = ["--singles", "3", "--none", "0", "--outside", "0", "--pairs", "0", "--first-seed", "10", "--jobs", "1"]
    monkeypatch.setattr("sys.argv", ["blind", *wanted, "--records", str(kept), "--out", str(tmp_path)])
    blind.main()
    assert [call.args[0].seed for call in diagnosed.call_args_list] == [11, 12]
    assert [json.loads(line)["seed"] for line in kept.read_text().splitlines()] == [10, 11, 12]
    assert "3/3" in capsys.readouterr().out
    monkeypatch.setattr("sys.argv", ["blind", "--records", str(kept), "--print"])
    monkeypatch.setattr(blind, "diagnose_sealed", pytest.fail)
    blind.main()
    assert "3/3" in capsys.readouterr().out
