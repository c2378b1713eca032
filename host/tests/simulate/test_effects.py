"""The library: every effect acts where it declares and only there, and vanishes with its size."""

import inspect
import re
import subprocess
import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import optimize

from bifa import effects, robot, simulate
from bifa.data import layout as data_layout
from bifa.effects import EffectError, EffectParameter, PhysicalEffect, choked_flow
from bifa.effects.effect import EXPERIMENTS
from bifa.simulate import hooks, layout
from bifa.simulate.paper import FAST
from bifa.simulate.records import as_stamped

NAMED = {
    "hysteresis", "viscoelasticity", "backlash", "area_variation", "valve_latency", "valve_asymmetry", "line_lag",
    "choked_flow", "leak", "supply_sag", "regulator_ripple", "sensor_lag", "sensor_position", "sensor_calibration",
    "stribeck", "friction_direction", "inclination", "tether_drag",
}  # fmt: skip
LEAST_VISIBLE = {"force_N": 0.02, "displacement_mm": 0.02, "displacement_head_mm": 0.02}  # pressures: 0.005 psi
# A pull at one speed shows little of how friction falls with speed; all other effects show clearly.
FAINT = {("stribeck", "anchor_pull")}


def _channels(model):
    time = np.arange(0.0, 12.0, 0.02)
    path = np.interp(time, [0.0, 6.0, 12.0], [0.0, 50.0, 0.0])
    records = {
        "static_loading": [
            simulate.static_loading(model, "large", time, path, 4.0),
            simulate.static_loading(model, "small", time, 0.5 * path, 4.0),
        ],
        "step_response": [simulate.step_response(model, a) for a in ("large", "small")],
        "anchor_pull": [simulate.anchor_pull(model, np.arange(0.0, 2.0, 0.02), 20.0, 8.5)],
        "locomotion": [simulate.walk(model, robot.BASELINE, 2), simulate.walk(model, FAST, 3)],
    }  # fmt: skip
    return {
        experiment: {
            f"{k}:{name}": values
            for k, record in enumerate(found)
            for name, values in record.columns.items()
            if name.startswith(("displacement", "force", "pressure"))
        }
        for experiment, found in records.items()
    }


@pytest.fixture(scope="module")
def base():
    return _channels(robot.nominal())


@pytest.mark.parametrize("name", sorted(effects.library()))
def test_an_effect_shows_where_it_says_and_only_there(name, base):
    changed = _channels(robot.nominal().with_effects({name: {}}))
    for experiment, channels in base.items():
        off = {key: np.abs(changed[experiment][key] - values).max() for key, values in channels.items()}
        visible = any(most > LEAST_VISIBLE.get(key.partition(":")[2], 0.005) for key, most in off.items())
        shows = experiment in effects.library()[name].experiments
        assert visible == shows or (name, experiment) in FAINT, experiment
        assert shows or max(off.values()) <= 5e-3, experiment


def test_effects_in_older_files_have_the_form_that_they_had():
    older = {"saturation_s_per_psi": 0.05, "sharpness": 2.0}
    form = {"upstream": 0.0, "by_volume": 0.0, "throat": 0.0, "critical_ratio": 0.3}
    assert effects.complete("choked_flow", older) == older | form
    assert effects.complete("line_lag", {"time_s": 0.05}) == {"time_s": 0.05, "delay_share": 0.0}


def test_a_line_with_a_delay_is_one_whose_valves_are_late():
    delayed = robot.nominal().with_effects({"line_lag": {"time_s": 0.05, "delay_share": 0.4}})
    late = robot.nominal().with_effects(
        {"line_lag": {"time_s": 0.05, "delay_share": 0.0}, "valve_latency": {"delay_s": 0.02}}
    )
    one, other = (simulate.step_response(model, "large").columns for model in (delayed, late))
    for channel, values in one.items():
        np.testing.assert_allclose(values, other[channel], rtol=1e-12, err_msg=channel)


@given(
    sonic_psi_s=st.floats(1.0, 1000.0),
    critical=st.floats(0.05, 0.6),
    rate_per_s=st.floats(0.5, 50.0),
    inside=st.floats(0.1, 3.0),
    outside=st.floats(0.1, 3.0),
)
def test_the_throat_and_the_resistance_after_it_pass_the_same_flow(sonic_psi_s, critical, rate_per_s, inside, outside):
    """ISO 6358-1's flow through a throat, in atmospheres, without the closed form: the pressure between throat and
    resistance at which the flows agree is found by root finding."""
    assume(abs(inside - outside) > 1e-3)

    def sonic(between: float) -> float:
        up, down = max(outside, between), min(outside, between)
        over = max((down / up - critical) / (1.0 - critical), 0.0)
        return np.sign(outside - between) * sonic_psi_s * up * np.sqrt(max(1.0 - over * over, 0.0))

    atmosphere_psi = 14.696
    between = optimize.brentq(lambda p: sonic(p) - rate_per_s * atmosphere_psi * (p - inside), inside, outside)
    factor = choked_flow.filling(
        1.0 / sonic_psi_s, 2.0, 0.5, 0.5, 1.0, critical, rate_per_s,
        (inside - 1.0) * atmosphere_psi, (outside - 1.0) * atmosphere_psi, 1.0,
    )  # fmt: skip
    assert factor * (outside - inside) == pytest.approx(rate_per_s * (between - inside), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("name", sorted(effects.library()))
def test_size_zero_is_exactly_the_base_model(name, base):
    sizes = {parameter.name: 0.0 for parameter in effects.library()[name].sizes}
    changed = _channels(robot.nominal().with_effects({name: sizes}))
    for experiment, channels in base.items():
        for key, values in channels.items():
            np.testing.assert_array_equal(changed[experiment][key], values, err_msg=f"{experiment} {key}")


@pytest.mark.parametrize("name", sorted(effects.library()))
def test_a_small_effect_is_a_small_change(name, base):
    """No effect sets in with a jump, so that a fit can start at size 0."""
    tiny = {size.name: 1e-4 * size.typical for size in effects.library()[name].sizes}
    changed = simulate.step_response(robot.nominal().with_effects({name: tiny}), "large")
    for channel in ("displacement_mm", "pressure_psi"):
        assert np.abs(changed[channel] - base["step_response"][f"0:{channel}"]).max() < 0.1, channel


def test_every_effect_of_the_contract_is_there_and_declared_with_the_experiments_of_data_sets():
    assert set(effects.library()) >= NAMED
    assert set(EXPERIMENTS) == set(data_layout.EXPERIMENTS)
    for name, effect in effects.library().items():
        assert effect.name == name
        assert effect.equation
        assert effect.source
        assert effect.sizes
        assert set(effect.experiments) <= set(EXPERIMENTS)
        for parameter in effect.parameters:
            assert parameter.lower <= parameter.typical <= parameter.upper
            assert not parameter.size or parameter.lower <= 0.0 <= parameter.upper


def test_effects_add_up_in_one_compilation():
    every = {name: {} for name in effects.library()}
    record = simulate.walk(robot.nominal().with_effects(every), robot.BASELINE, 3)
    assert all(np.all(np.isfinite(values)) for values in record.columns.values())
    assert record["displacement_head_mm"][-1] > 20.0


@pytest.mark.parametrize(
    ("chosen", "told"),
    [
        ({"magic": {}}, "'magic' is not an effect of the library"),
        ({"hysteresis": {"force": 1.0}}, "no parameter force"),
        ({"hysteresis": {"force_N": -1.0}}, r"force_N = -1.0 is outside its range 0 to 20 N"),
        ({"leak": {"rate_per_s": float("nan")}}, "rate_per_s"),
    ],
)
def test_a_wrong_effect_is_refused_by_name_and_range(chosen, told):
    with pytest.raises(EffectError, match=told):
        robot.nominal().with_effects(chosen)


_SIZE = EffectParameter("share", "", 0.0, 1.0, 0.1, "size", size=True)


def swelling(name="swelling", experiments=(), parameters=(_SIZE,), **told):
    return PhysicalEffect(name, "", "F (1 + share)", "a test", "eq. (2)", experiments, parameters, **told)


@pytest.fixture
def with_new_effect(monkeypatch):
    """The library with one more file in it; the flat layout follows."""

    module = types.ModuleType("bifa.effects.swelling")
    module.EFFECT = swelling()

    def add(**functions):
        vars(module).update(functions)
        found = dict(effects.modules()) | {"swelling": module}
        monkeypatch.setattr(effects, "modules", lambda: found)
        monkeypatch.setattr(effects, "library", lambda: {name: module.EFFECT for name, module in found.items()})
        for cached in (layout.parameter_indices, layout.effect_slots, layout.effect_bit):
            monkeypatch.setattr(layout, cached.__name__, inspect.unwrap(cached))
        return hooks.chain_source()

    return add


def test_adding_an_effect_is_adding_a_file(with_new_effect):
    def area(share, stroke_share):
        return 1.0 + share * stroke_share

    source = with_new_effect(area=area)
    assert f"area_of_swelling(q[{layout.index('swelling.share')}], stroke_share)" in source
    assert source != hooks.chains.__loader__.get_source(hooks.chains.__name__)  # so the compiled code differs too


def test_an_effect_that_asks_for_what_there_is_not_is_refused(with_new_effect):
    with pytest.raises(EffectError, match=r"swelling\.area has an unknown argument 'moon_phase'"):
        with_new_effect(area=lambda share, moon_phase: share)


@pytest.mark.parametrize("hook", ["initial", "spring_state", "play_state", "sensor", "line"])
def test_an_effect_that_remembers_without_a_state_is_refused(with_new_effect, hook):
    with pytest.raises(EffectError, match=rf"swelling\.{hook} returns a state: swelling must declare states=1"):
        with_new_effect(**{hook: lambda share: share})


def test_a_state_that_nothing_changes_is_refused(with_new_effect, monkeypatch):
    with_new_effect(area=lambda share: share)
    library = effects.library()
    library["swelling"] = replace(library["swelling"], states=1)
    monkeypatch.setattr(effects, "library", lambda: library)
    with pytest.raises(EffectError, match="swelling declares states=1, but its state never changes: define line or"):
        hooks.chain_source()


def test_an_effect_without_a_hook_is_refused(with_new_effect):
    with pytest.raises(EffectError, match="swelling does not act"):
        with_new_effect()


def test_a_parameter_that_would_hide_what_the_hook_offers_is_refused(with_new_effect, monkeypatch):
    monkeypatch.setitem(hooks.HOOKS, "reading", (("pressure_psi", "share"), "replace"))
    with pytest.raises(EffectError, match=r"swelling\.reading: the hook offers 'share'"):
        with_new_effect(reading=lambda share, pressure_psi: pressure_psi * share)


@pytest.mark.parametrize(
    ("file", "declared", "told"),
    [
        ("swelling", {}, r"swelling\.py must define EFFECT"),
        (
            "swelling",
            {"EFFECT": swelling("leak")},
            r"swelling\.py must define EFFECT = PhysicalEffect\(name='swelling'",
        ),
        ("swelling-2", {"EFFECT": swelling("swelling-2")}, "a name without hyphens"),
        (
            "swelling",
            {"EFFECT": swelling(parameters=(replace(_SIZE, size=False),))},
            "swelling does not act: no parameter is marked size=True",
        ),
    ],
)
def test_a_file_that_is_no_effect_of_its_name_is_refused(file, declared, told, monkeypatch):
    module = types.ModuleType(file)
    vars(module).update(declared)
    monkeypatch.setattr(effects, "modules", lambda: {file: module})
    with pytest.raises(EffectError, match=told):
        effects.library.__wrapped__()


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"experiments": ("walk",)}, r"swelling: no experiment is walk; there are .*locomotion"),
        ({"states": 2}, r"swelling: states = 2, but an effect has 1 state"),
        ({"parameters": (replace(_SIZE, lower=0.1),)}, r"swelling\.share is a size, 0 .* 0\.1 to 1"),
    ],
)
def test_a_declaration_that_would_keep_an_effect_from_being_tried_is_refused(wrong, told):
    with pytest.raises(EffectError, match=told):
        swelling(**{"experiments": EXPERIMENTS} | wrong)


def test_a_tuple_of_one_needs_no_comma():
    effect = swelling(experiments="locomotion", parameters=_SIZE)
    assert effect.experiments == ("locomotion",)
    assert effect.sizes == (_SIZE,)


PAGE = Path(__file__).parents[3] / "docs" / "adding-an-effect.md"


def test_the_page_lists_every_hook_with_what_it_offers():
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    listed = {hook: re.findall(r"`(\w+)`", offered) for hook, offered in rows}
    offers = {hook: [name for name in names if name not in hooks.HIDDEN] for hook, (names, _) in hooks.HOOKS.items()}
    assert listed == offers


@pytest.mark.soak
def test_the_pages_example_works_as_it_stands(tmp_path):
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL).group(1)
    (tmp_path / "swelling.py").write_text(code, encoding="utf-8")
    check = f"""
import numpy as np
import bifa.effects
bifa.effects.__path__.append({str(tmp_path)!r})
from bifa import robot, simulate
model = robot.nominal()
swollen = model.with_effects({{"swelling": {{"growth": 0.2}}}})
time = np.array([0.0, 10.0])
path = np.array([0.0, 1e3 * model.body_stiffness.stroke_m])
plain, more = (simulate.static_loading(m, "large", time, path, 5.0)["force_N"] for m in (model, swollen))
np.testing.assert_allclose(more - plain, [0.0, -0.2 * 9.0 * 5.0], atol=1e-6)
"""
    subprocess.run([sys.executable, "-c", check], check=True)


def shifted(late_s, share=1.0):
    return robot.nominal().with_effects({"instrument_shift": {"late_s": late_s, "share": share}})


@settings(max_examples=10)
@given(late_s=st.floats(-0.04, 0.04), share=st.floats(0.0, 1.0))
def test_of_shifted_instruments_displacements_are_those_of_other_times_and_nothing_else_is(late_s, share):
    time_s = np.arange(0.0, 5.0, 0.01)
    then_s = time_s - share * late_s
    at_s, when = np.unique(np.clip(then_s, 0.0, None), return_inverse=True)
    record = simulate.walk(shifted(late_s, share), FAST, time_s=time_s)
    base, truth = (simulate.walk(robot.nominal(), FAST, time_s=t) for t in (time_s, at_s))
    for name in ("displacement_head_mm", "displacement_tail_mm"):
        # Where a wall is met or a foot slips, the speed jumps within a sample, which a cubic smooths.
        off = np.abs(record[name] - truth[name][when])[then_s < time_s[-1]]
        assert off.max() < 0.5
        assert np.sqrt(np.mean(off**2)) < 0.05
    for name in ("pressure_body_psi", "pressure_head_psi", "pressure_tail_psi", "command_body"):
        np.testing.assert_array_equal(record[name], base[name])


@pytest.mark.parametrize("late_s", [-0.01, 0.01])
def test_a_step_response_is_shifted_by_a_sample(late_s):
    models = (shifted(late_s), robot.nominal())
    moved, still = (simulate.step_response(model, "large")["displacement_mm"] for model in models)
    if late_s < 0.0:
        moved, still = still, moved
    np.testing.assert_allclose(moved[1:], still[:-1], atol=1e-6)


def test_a_run_that_was_given_up_is_nan_under_another_clock_too():
    time_s = np.arange(50) * 0.01
    given_up = np.where(time_s < 0.2, time_s, np.nan)
    stamped = as_stamped(simulate.plant(shifted(0.01)), time_s, given_up, given_up)
    np.testing.assert_array_equal(stamped, given_up)
