"""What the loop buys, from the summaries of campaigns."""

import pytest

from bench import loop


def summary(speeds, off=0.0, named=("leak",), base_walking=1.0):
    gaits = [
        {"gait": name, "base_model": speed + off, "completed_model": speed - off, "measured": speed}
        for name, speed in zip(("baseline", "base", "completed"), speeds, strict=True)
    ]
    slow = [0.0] * round(10 * (1 - base_walking)) + [20.0] * round(10 * base_walking)
    return {
        "gaits": gaits,
        "effects": [{"name": name} for name in named],
        "robustness": {"base": slow, "completed": [20.0] * 10},
    }


def test_a_gain_compares_each_gait_with_the_model_that_it_was_found_with():
    one = loop.gain("leak", 3, summary((10.0, 15.0, 20.0), off=2.0, base_walking=0.7))
    assert one.predicted_mm_s == (17.0, 18.0)
    assert one.measured_mm_s == (15.0, 20.0)
    assert one.off_mm_s == pytest.approx((2.0, 2.0))
    assert one.walking == pytest.approx((0.7, 1.0))


@pytest.mark.parametrize(
    ("named", "said"), [(("leak",), "yes"), (("leak", "stribeck"), "and others"), (("stribeck",), "no"), ((), "no")]
)
def test_a_row_says_whether_the_effect_was_named(named, said):
    text = loop.row(loop.gain("leak", 3, summary((10.0, 15.0, 20.0), named=named)))
    assert text.split("  ")[0] == "leak, 3"
    assert text[23:36].strip() == said
    assert len(text) == len(loop.HEADING.splitlines()[1])


def test_means_over_robots(capsys):
    gains = [
        loop.gain("leak", 1, summary((10.0, 15.0, 20.0), off=1.0, base_walking=0.5)),
        loop.gain("leak", 2, summary((10.0, 19.0, 18.0), off=3.0)),
    ]
    figures = loop.summed_up(gains)
    assert figures["loop_base_mm_s"] == 17.0
    assert figures["loop_completed_mm_s"] == 19.0
    assert figures["loop_base_prediction_off_mm_s"] == pytest.approx(2.0)
    assert figures["loop_base_walking"] == pytest.approx(0.75)
    assert figures["loop_completed_is_faster"] == 0.5
    assert "means, robots: 2" in capsys.readouterr().out


def test_an_interrupted_run_sums_up_what_there_is(monkeypatch, capsys, tmp_path):
    done = iter([loop.gain("leak", 1, summary((10.0, 15.0, 20.0)))])

    def measured(effect, seed, out):
        try:
            return next(done)
        except StopIteration:
            raise KeyboardInterrupt from None

    monkeypatch.setattr(loop, "measured", measured)
    figures = loop.run(("leak", "stribeck"), range(2), tmp_path)
    assert figures["loop_completed_mm_s"] == 20.0
    assert "interrupted after 1 of 4 robots" in capsys.readouterr().out


def test_a_run_goes_on_from_its_records(monkeypatch, tmp_path):
    asked, kept = [], tmp_path / "loop.jsonl"

    def measured(effect, seed, out):
        asked.append((effect, seed))
        return loop.gain(effect, seed, summary((10.0, 15.0, 20.0)))

    monkeypatch.setattr(loop, "measured", measured)
    first = loop.run(("leak",), range(2), tmp_path, kept)
    assert loop.run(("leak",), range(2), tmp_path, kept) == first
    loop.run(("leak", "stribeck"), range(1), tmp_path, kept)
    assert asked == [("leak", 0), ("leak", 1), ("stribeck", 0)]
    assert len(kept.read_text().splitlines()) == 3
