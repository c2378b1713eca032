"""Identification from start to end, on data whose curve, integrator and noise are not the model's."""

import re
from dataclasses import replace
from io import StringIO

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from scipy.stats import binom

from bifa.identify.identification import Identification, identify
from bifa.problem.unmeasured import PRIOR_SD
from bifa.report.fit import draw_curves, errors_table, fit_page, parameters_and_remarks, remarks
from bifa.report.page import render
from bifa.report.terminal import print_sections, print_table
from bifa.robot import load_model, save_model
from harness.independent_lab import IndependentLab, session, small_session
from tests.report.sample import text_of

pytestmark = pytest.mark.slow


def covered(found: Identification, lab: IndependentLab) -> dict[str, bool]:
    """Whether each parameter's interval contains the truth."""
    return {name: found.intervals[name].lower <= at <= found.intervals[name].upper for name, at in lab.truth.items()}


@pytest.fixture(scope="module")
def lab():
    return IndependentLab().with_seed(11)


@pytest.fixture(scope="module")
def found(lab):
    return identify(small_session(lab))


def test_the_parameters_of_an_independent_robot_come_back(found, lab):
    # The peak of a pull is known to a sample: 2 N of 34 N at 20 mm/s through a load cell of 5 kN/m.
    tolerance = {"mu_s": 0.06}
    for name, truth in lab.truth.items():
        assert found.model[name] == pytest.approx(truth, rel=tolerance.get(name, 0.02)), name


@pytest.mark.soak
def test_intervals_of_the_independent_robot_contain_the_truth():
    """Nine in ten do, allowing for chance, with a curve that the model can only approximate and coloured noise."""
    labs = [IndependentLab().with_seed(seed) for seed in range(11, 19)]
    hits = pd.DataFrame([covered(identify(small_session(lab)), lab) for lab in labs])
    share = hits.to_numpy().mean()
    print(f"{hits.mean().round(2)}\nall: {share:.3f} of 90 % intervals, {len(labs)} data sets")
    assert share >= binom.ppf(1e-3, hits.size, 0.9) / hits.size


def test_the_error_is_within_a_tenth_of_the_noise_floor(found):
    for (experiment, channel), error in found.error.items():
        print(f"{experiment:15s} {channel:21s} {error:.2f}")
        assert error < 1.1, (experiment, channel)


def test_what_no_experiment_tells_is_said_with_what_would(found):
    named = {missing.name for missing in found.open}
    for name in ("small_mass_kg", "wall_stiffness_N_m", "wall_damping_Ns_m"):
        assert name in named or found.intervals[name].sd < 0.7 * PRIOR_SD[name], "determined, or reported as open"
    assert "head_mass_kg" not in named  # the lab knows it
    assert all(missing.value == found.model[missing.name] for missing in found.open)  # the curves are determined
    assert all(missing.needs for missing in found.open)
    assert all(any(missing.needs in line for line in remarks(found)) for missing in found.open)


def test_the_model_file_carries_the_uncertainty(found, tmp_path):
    save_model(tmp_path / "model.toml", found.model)
    read = load_model(tmp_path / "model.toml")
    assert read.values == found.model.values
    curves = {f"{spring}_stiffness.{power}" for spring in ("body", "small") for power in range(16)}
    assert set(read.covariance.names) == {*found.intervals, *curves}
    eigenvalues = np.linalg.eigvalsh(read.covariance.matrix)
    assert (eigenvalues >= -1e-12 * eigenvalues.max()).all()
    for name, interval in found.intervals.items():
        assert read.parameters[name].sd == pytest.approx(interval.sd)
        i = read.covariance.names.index(name)
        assert np.sqrt(read.covariance.matrix[i, i]) == pytest.approx(interval.sd)


def test_every_experiment_has_a_figure(found, tmp_path):
    paths = draw_curves(found, tmp_path)
    assert [p.stem for p in paths] == ["static_loading", "step_responses", "anchor_pulls", "walks"]
    assert all(p.stat().st_size > 10_000 for p in paths)


def test_the_terminal_names_everything_in_words_within_80_columns(found):
    text = StringIO()
    console = Console(file=text, width=80)
    print_sections(console, parameters_and_remarks(found))
    print_table(console, errors_table(found))
    lines = text.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    assert not re.findall(r"\b[a-z]+_[a-z]+\b", text.getvalue())
    said = " ".join(text.getvalue().split())
    for word in ("mass of the head", "area of the body", "force, static loading", "displacement of the head, walk"):
        assert word in said, word


def test_the_page_has_every_parameter_and_condition_in_words(found):
    page = fit_page(found)
    (table,) = page.sections[0].tables
    assert len(table.rows) == len(found.model.parameters)
    drawn = [column.title for section in page.sections for chart in section.charts for column in chart.columns]
    assert len(drawn) == len(list(found.system.dataset.repeats()))
    assert "static loading, large, 0 psi, 4 mm/s" in drawn
    assert not re.findall(r"\b[a-z]+_[a-z]+\b", text_of(render(page)))


def test_a_model_that_does_not_fit_says_so(found):
    assert not any("does not describe" in line for line in remarks(found))
    poor = replace(found, error=found.error | {("step_response", "pressure_psi"): 4.2})
    assert any("4.2 times the noise in pressure_psi of step_response" in line for line in remarks(poor))


@pytest.fixture(scope="module")
def static_only(lab):
    trials = [lab.static("large", p, rate_mm_s=4.0, repeat=r) for p in (0.0, 8.0) for r in (1, 2)]
    return replace(lab.day("static only", trials), known={})


def test_repeats_that_differ_and_a_doubtful_known_value_do_not_pass_in_silence(found, static_only):
    assert not any("Repeats of" in line for line in remarks(found))
    *others, last = static_only.trials
    turned_up = replace(last, columns=last.columns | {"pressure_psi": 1.06 * last.columns["pressure_psi"]})
    odd = identify(replace(static_only, trials=(*others, turned_up), known={"head_mass_kg": 0.35}))
    (line,) = (line for line in remarks(odd) if "Repeats of" in line)
    assert re.search(r"Repeats of static_loading differ by 0\.\d+\s?psi in pressure_psi, \d+ times", line)
    (line,) = (line for line in parameters_and_remarks(odd)[1].paragraphs if line.startswith("Trials"))
    assert (
        "(run 1) and static loading, large, 8 psi, 4 mm/s (run 2), repeats of one condition, differ in pressure" in line
    )
    (remark,) = (row[-1] for row in fit_page(odd).sections[0].tables[0].rows if row[0] == "mass of the head")
    assert re.fullmatch(r"known, expected 0\.10\skg to 0\.30\skg", remark)


def test_too_little_data_says_what_cannot_be_had(static_only):
    """Static loading of the large actuator alone determines its curve and its area, and nothing else."""
    found = identify(static_only)
    assert set(found.intervals) == {"body_area_N_psi"}
    needs = {missing.name: missing.needs for missing in found.open}
    assert "step_response of the large" in needs["body_alpha_n_per_s"]
    assert "anchor_pull" in needs["mu_s"]
    assert "balance" in needs["head_mass_kg"]
    assert "static_loading of the small" in needs["small stiffness curve"]
    assert any("mu_s, mu_k. What would determine it: anchor_pull" in line for line in remarks(found))
    again = identify(static_only)
    assert again.model.values == found.model.values


def test_a_stable_state_that_no_record_reaches_is_said_to_be_a_guess(lab, static_only):
    def said(*trials):
        return [line for line in remarks(identify(replace(static_only, trials=trials))) if "is a guess" in line]

    assert not said(*static_only.trials)
    whole = static_only.trials[0]
    short = whole.columns["displacement_mm"] < 0.62 * whole.columns["displacement_mm"].max()
    cut = replace(whole, columns={name: column[short] for name, column in whole.columns.items()})
    (line,) = said(cut, *(lab.static("small", p) for p in (0.0, 8.0)))
    assert line.startswith("The static loadings of the large actuator cover ")
    assert "so that its extended state is a guess" in line


@pytest.mark.soak
def test_a_whole_session_comes_back_for_several_robots():
    hits = []
    for seed in range(1000, 1005):
        lab = IndependentLab().with_seed(seed)
        found = identify(session(lab, None))
        assert max(found.error.values()) < 1.1, (seed, found.error)
        hits += covered(found, lab).values()
    assert sum(hits) >= binom.ppf(1e-3, len(hits), 0.9)
