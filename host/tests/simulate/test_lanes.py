"""The kernel in lanes, compared with numba, which runs the functions one robot at a time, and with tight tolerances."""

import ctypes
import math
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from bifa import effects, robot, simulate
from bifa.robot.gait import gait_rows
from bifa.robot.learnt import LearntCurve
from bifa.simulate import lanes, layout, rigs
from bifa.simulate.lanes import build, kernel
from bifa.simulate.lanes.translate import Intrinsic, Shapes, Translator, UntranslatableError
from bifa.simulate.paper import FAST
from bifa.simulate.timeline import NO_COMMANDS

ROBOTS = 11  # more than there are lanes, so that some lanes take up a second robot
TIME_S = np.arange(0.0, 6.0, 0.02)
TOLERANCE_M = 1e-6
ROUNDED = ("backlash", "hysteresis")


@pytest.fixture(scope="module")
def found():
    both = kernel.kernels()
    assert both is not None, "the tests need a C compiler"
    return both


def _robots(effect, count=ROBOTS):
    rng = np.random.default_rng(len(effect or ""))

    def drawn(parameter, value):
        return float(np.clip(value, parameter.lower, parameter.upper))

    plants = []
    for _ in range(count):
        model = robot.nominal()
        model = model.with_values({n: drawn(p, p.value * rng.normal(1.0, 0.05)) for n, p in model.parameters.items()})
        if effect:
            parameters = effects.library()[effect].parameters
            sizes = {p.name: drawn(p, p.typical * rng.uniform(0.3, 1.5)) for p in parameters}
            model = model.with_effects({effect: sizes})
        plants.append(simulate.plant(model))
    return plants


def _experiments(plants):
    walk = simulate.vented_between(simulate.of_gait(FAST, 10.0), 0.004)
    step = simulate.timeline([(0.5, 0, 1), (3.5, 0, 0)])
    n = len(plants)

    def one(kind, mounted, switches, **pull):
        return lanes.Experiment(kind, mounted, [switches] * n, [TIME_S] * n, TOLERANCE_M, **pull)

    return {
        "walk": one(lanes.WALK, [rigs.pipe(p, 5.0) for p in plants], walk),
        "large step": one(lanes.STEP, [rigs.stand(p, "large", 8.5) for p in plants], step),
        "small step": one(lanes.STEP, [rigs.stand(p, "small", 8.5) for p in plants], step),
        "pull": one(
            lanes.ANCHOR,
            [rigs.anchor(p, 8.5 - 0.5 * k) for k, p in enumerate(plants)],
            NO_COMMANDS,
            extended_psi=8.0,
            rate_m_s=0.02,
            load_cell_N_m=5000.0,
        ),
    }


def _size(rows):
    return np.abs(rows).max(axis=-1, keepdims=True) + 1e-9


@pytest.mark.parametrize("effect", [None, *effects.library()])
def test_lanes_and_numba_tell_the_same(effect, found):
    plants = _robots(effect)
    for name, what in _experiments(plants).items():
        expected = [lanes.in_numba(what, k, plant) for k, plant in enumerate(plants)]
        for one in found:
            got = one.march(plants, what, False)
            errors = [np.abs((a - b) / _size(b)).max() for a, b in zip(got, expected, strict=True)]
            # Both take the same steps unless rounding decides whether a step is accepted: at rest, both springs of
            # ROUNDED divide one small difference by another.
            assert effect in ROUNDED or np.median(errors) < 1e-9, (name, errors)
            assert max(errors) < 5e-3, (name, errors)


@pytest.mark.parametrize("effect", [None, *effects.library()])
@pytest.mark.parametrize("actuator", ["large", "small"])
def test_static_loadings_are_those_of_numba(effect, actuator, found):
    plants = _robots(effect)
    paths = [np.interp(TIME_S, [0.0, 3.0, 6.0], [0.0, 0.02 + 0.001 * k, 0.0]) for k in range(len(plants))]
    mounted = [rigs.stand(p, actuator, 4.0) for p in plants]
    got = found[0].load(plants, mounted, paths, TIME_S)
    for rows, expected in zip(got, lanes.load_in_numba(plants, mounted, paths, TIME_S), strict=True):
        np.testing.assert_allclose(rows, expected, atol=1e-9)


def test_every_effect_and_every_learnt_curve_at_once(found):
    model = robot.nominal().with_effects({name: {} for name in effects.library()})
    at = np.linspace(0.0, 1.0, 9)
    learnt = {
        "filling": LearntCurve(-13.0, 9.0, 0.3 * np.array([np.sin(3 * at), np.cos(3 * at)])),
        "friction_speed": LearntCurve(0.0, 0.1, np.array([at, 1.0 - at])),
        "friction_place": LearntCurve(0.0, 0.3, np.array([0.5 * at])),
        "body_damper": LearntCurve(-0.1, 0.1, np.array([2.0 * at - 1.0])),
        "grip_speed": LearntCurve(0.0, 0.1, 0.1 * np.array([at, -at])),
        "grip_place": LearntCurve(0.0, 0.3, 0.1 * np.array([np.sin(9 * at)])),
        "area_stroke": LearntCurve(0.0, 1.0, 0.05 * np.array([np.sin(5 * at)])),
        "body_spring": LearntCurve(-0.01, 0.06, np.array([np.sin(5 * at)])),
    }
    both = [simulate.plant(model), simulate.plant(replace(model, learnt=learnt))]
    what = _experiments(both)["walk"]
    ground = simulate.terrain(simulate.tunnel(0.02))
    what = replace(what, rigs=[rig._replace(terrain=ground) for rig in what.rigs])
    expected = [lanes.in_numba(what, k, plant) for k, plant in enumerate(both)]
    assert np.abs(expected[0] - expected[1]).max() > 1e-3
    for one in found:
        for a, b in zip(one.march(both, what, False), expected, strict=True):
            assert np.abs((a - b) / _size(b)).max() < 5e-3
            assert np.abs(a[0] - b[0]).max() < 1e-7


def test_a_robot_that_has_no_solution_leaves_the_others_alone(found):
    plants = _robots(None, 3)
    broken = plants[1].q.copy()
    broken[layout.HEAD_MASS] = np.nan
    what = _experiments(plants)["walk"]
    for together in (False, True):
        first, other, last = found[0].march([plants[0], plants[1]._replace(q=broken), plants[2]], what, together)
        assert np.isnan(other[:, 1:]).any()
        assert np.all(np.isfinite([first, last]))
        if not together:
            whole = found[0].march(plants, what, together)
            np.testing.assert_array_equal([first, last], [whole[0], whole[2]])


def test_lanes_with_switches_and_samples_of_their_own(found):
    plants = _robots(None)
    gaits = [replace(FAST, period_s=FAST.period_s + 0.1 * k) for k in range(ROBOTS)]
    what = lanes.Experiment(
        lanes.PROGRESS,
        [rigs.pipe(p) for p in plants],
        [simulate.of_gait(gait, 12.0) for gait in gaits],
        [gait.period_s * np.arange(1, 3 + k % 2) for k, gait in enumerate(gaits)],
        TOLERANCE_M,
    )
    got = found[0].march(plants, what, False)
    loosely = replace(what, rigs=[rigs.pipe(p, looser=10.0) for p in plants])
    for k, (rows, rough) in enumerate(zip(got, found[0].march(plants, loosely, False), strict=True)):
        np.testing.assert_allclose(rows, lanes.in_numba(what, k, plants[k]), atol=1e-7)
        np.testing.assert_allclose(rough, lanes.in_numba(loosely, k, plants[k]), atol=1e-7)
        assert 0.0 < np.abs(rough - rows).max() < 1e-4


def test_a_walk_that_has_settled_is_extrapolated_and_one_that_has_not_is_simulated(found):
    plants = _robots(None)
    gaits = [replace(FAST, period_s=FAST.period_s * (1.0 - 0.02 * k)) for k in range(ROBOTS)]
    times = [gait.period_s * np.arange(1, 13) for gait in gaits]
    switches = [simulate.of_gait(gait, 13.0 * gait.period_s) for gait in gaits]
    whole = lanes.Experiment(lanes.PROGRESS, [rigs.pipe(p) for p in plants], switches, times, TOLERANCE_M)
    ended = []
    for settled in (2e-3, 1e-12):
        what = replace(whole, settled=settled)
        got = found[0].march(plants, what, False)
        for k, (rows, full) in enumerate(zip(got, found[0].march(plants, whole, False), strict=True)):
            np.testing.assert_allclose(rows, lanes.in_numba(what, k, plants[k]), atol=1e-6)
            same = int((rows == full).all(axis=0).sum())
            ended.append(same)
            cycles, expected = np.diff(rows[0]), np.diff(full[0])
            if same < len(times[k]):
                assert np.abs(cycles[same - 4 : same - 2] - cycles[same - 2]).max() <= settled * abs(cycles[same - 2])
                assert np.ptp(cycles[same - 2 :]) < 1e-12
            np.testing.assert_allclose(cycles, expected, atol=3.0 * settled * expected.max() + 1e-12)
    assert min(ended) >= 4
    assert np.mean(ended[:ROBOTS]) < 9.0
    assert np.mean(ended[ROBOTS:]) > 10.0


def _progress(plants, gaits, tolerance_m, single):
    which, rows = np.repeat(np.arange(len(plants)), len(gaits)), np.tile(gait_rows(gaits), (len(plants), 1))
    return simulate.speeds([plants[k] for k in which], rows, 12, tolerance_m, single=single).advance_m


@pytest.mark.parametrize("effect", [None, *effects.library()])
def test_single_precision_rounds_less_than_the_integrator_errs(effect):
    if lanes.width(single=True) == lanes.width():
        pytest.skip("searches run in double precision on this processor")
    plants = _robots(effect)
    gaits = [replace(FAST, period_s=FAST.period_s * slower) for slower in (1.0, 1.1, 1.3)]
    single, double = (_progress(plants, gaits, 1e-5, one) for one in (True, False))
    errors, rounded = np.abs(double - _progress(plants, gaits, 1e-8, False)), np.abs(single - double)
    assert 0.0 < np.median(rounded) < np.median(errors)
    stand = [np.abs(advance[:, -3:]).mean(axis=1) < 2e-3 for advance in (single, double)]
    np.testing.assert_array_equal(*stand)


@pytest.mark.parametrize("lanes_of", [4, 8, 16])
def test_single_precision_in_every_width_that_this_processor_has(lanes_of):
    if lanes_of > 2 * build.target().lanes:
        pytest.skip("not on this processor")
    double = next(t for t in build.TARGETS if 2 * t.lanes == lanes_of)
    one = kernel.Kernel(build.library(replace(double, lanes=lanes_of, flags=(*double.flags, build.SINGLE))))
    assert one.lanes == lanes_of
    plants = _robots("hysteresis")
    what = _experiments(plants)["walk"]
    for k, rows in enumerate(one.march(plants, what, False)):
        expected = lanes.in_numba(what, k, plants[k])
        assert np.abs(rows[0] - expected[0]).max() < 1e-4


@pytest.mark.parametrize("lanes_of", [1, 2, 4, 8])
def test_every_width_that_this_processor_has(lanes_of, found):
    if lanes_of > build.target().lanes:
        pytest.skip("not on this processor")
    chosen = next(t for t in (*build.TARGETS, build.one_lane()) if t.lanes == lanes_of)
    one = kernel.Kernel(build.library(chosen))
    plants = _robots("hysteresis")
    what = _experiments(plants)["walk"]
    for a, b in zip(one.march(plants, what, False), found[1].march(plants, what, False), strict=True):
        assert np.abs(a[0] - b[0]).max() < 1e-7


# -- marching together ---------------------------------------------------------------------------------------------

STEPS = {
    "body_damping_Ns_m": 0.4, "body_area_N_psi": 0.01, "body_alpha_n_per_s": 0.01, "small_area_N_psi": 0.003,
    "wall_offset_m": 2e-5, "mu_s": 2e-3, "mu_k": 1e-3, "hysteresis.force_N": 0.02, "valve_latency.delay_s": 2e-4,
    "supply_positive_psi": 0.01,
}  # fmt: skip


def _columns(tolerance_m, together, gait):
    model = robot.nominal().with_effects({"hysteresis": {}, "valve_latency": {}})
    moved = [model.with_values({name: model[name] + step}) for name, step in STEPS.items()]
    robots = [model, *moved]
    commands = [simulate.of_gait(gait, 3.0 * gait.period_s)] * len(robots)
    time_s = np.arange(0.0, 2.5 * gait.period_s, 0.01)
    level = {"times_s": [time_s] * len(robots), "inclinations_deg": [0.0] * len(robots)}
    how = {"tolerance_m": tolerance_m, "together": together, "states": False}
    first, *others = (r["displacement_head_mm"] for r in simulate.walks(robots, commands, **level, **how))
    return np.array([other - first for other in others])


@pytest.mark.parametrize("gait", [robot.BASELINE, FAST], ids=["baseline", "fastest"])
def test_derivatives_together_are_those_of_a_tight_tolerance(gait):
    exact = _columns(1e-10, False, gait)
    np.testing.assert_allclose(_columns(1e-10, True, gait), exact, atol=2e-4)
    sizes = np.sqrt(np.mean(exact**2, axis=1))
    errors = {
        together: np.sqrt(np.mean((_columns(1e-6, together, gait) - exact) ** 2, axis=1)) for together in (True, False)
    }
    assert np.median(errors[True] / sizes) < 0.1
    assert np.all(errors[True] < 0.3 * sizes + 2e-3), dict(zip(STEPS, errors[True] / sizes, strict=True))
    assert np.median(errors[True] / errors[False]) < 1.0


def test_the_first_robot_leads_every_pack():
    """Equal robots in different packs give exactly the result of the first."""
    plants = _robots(None, 1) * 20
    commands = [simulate.of_gait(FAST, 5.0)] * 20
    level = {"times_s": [np.arange(0.0, 4.0, 0.01)] * 20, "inclinations_deg": [0.0] * 20}
    records = simulate.walks(plants, commands, **level, together=True)
    for record in records[1:]:
        np.testing.assert_array_equal(record["displacement_head_mm"], records[0]["displacement_head_mm"])


# -- without a compiler ----------------------------------------------------------------------------------------------

_WITHOUT = """
from bifa import robot, simulate
print(simulate.speed(robot.nominal(), robot.BASELINE, 3).advance_m[-1], simulate.lanes.width())
"""


def test_without_a_compiler_numba_does_it_and_one_line_says_so(tmp_path):
    cache = tmp_path / "cache"
    cache.mkdir()
    for old in build.generated.folder().glob("*.py"):  # numba's compiled code is reused, the kernels are not
        (cache / old.name).symlink_to(old)
    (cache / "__pycache__").symlink_to(build.generated.folder() / "__pycache__")
    nowhere = {"PATH": str(tmp_path), "BIFA_CACHE_DIR": str(cache)}
    kept = {k: v for k, v in os.environ.items() if k not in ("CC", "PATH")}
    ended = subprocess.run([sys.executable, "-c", _WITHOUT], env=kept | nowhere, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    advance, width = ended.stdout.split()
    assert float(advance) == pytest.approx(simulate.speed(robot.nominal(), robot.BASELINE, 3).advance_m[-1], abs=1e-8)
    assert width == "1"
    assert ended.stderr.count("\n") == 1
    assert "no C compiler" in ended.stderr


def test_a_kernel_that_cannot_be_loaded_is_reported_and_numba_does_it(tmp_path, monkeypatch, capsys):
    """As in a folder mounted `noexec`, or after a power cut."""
    (tmp_path / "kernel.so").write_text("no library")
    monkeypatch.setattr(build, "library", lambda chosen: tmp_path / "kernel.so")
    assert kernel.kernels.__wrapped__() is None
    assert "kernel.so: " in (said := capsys.readouterr().err)
    assert "set BIFA_CACHE_DIR" in said


def test_without_a_kernel_in_single_precision_searches_run_in_double(found, tmp_path, monkeypatch, capsys):
    (tmp_path / "kernel.so").write_text("no library")
    monkeypatch.setattr(build, "library", lambda chosen: tmp_path / "kernel.so")
    assert kernel.single_precision.__wrapped__(found[0]) is found[0]
    assert "searches run in double precision: " in capsys.readouterr().err


def test_the_variable_of_the_compiler_may_hold_arguments(tmp_path, monkeypatch):
    (tmp_path / "ccache").write_text('#!/bin/sh\nexec "$@"\n')
    (tmp_path / "ccache").chmod(0o755)
    monkeypatch.setenv("CC", f"{tmp_path}/ccache {shutil.which('gcc') or 'clang'}")
    build.compile_to(tmp_path / "kernel.so", build.one_lane())
    assert kernel.Kernel(tmp_path / "kernel.so").lanes == 1


# -- the translator --------------------------------------------------------------------------------------------------


def returns_early(x, y):
    if x > 1.0:
        if y > 0.0:
            return x * y
        x = 1.0
    elif y > 0.5:
        return -y
    return x + y


def leaves_loops(x, y):
    total = 0.0
    for i in range(7):
        if i > 2 and x < 0.0:
            break
        if y < 0.0:
            y += 0.3
            continue
        total += x + i
        if total > 4.0:
            return total
    return total - y


def chooses(x, y):
    a, b = (x, y) if x > y else (y, x)
    low = y > 0.0 and not x > 0.5
    kind = 2 if low else 0
    for side in (-1.0, 1.0):
        if side * x > 0.2:
            kind += 1
    return a - b + kind + (min(x, y, 0.1) if 0.0 < x < 1.0 else max(x, -0.5))


def calculates(x, y):
    return math.exp(20.0 * x) * math.sin(3.0 * y) + abs(x) ** 1.7 + math.sqrt(abs(y)) + int(10.0 * x) + math.tanh(y)


def _swap(x, y):
    return y, x


def calls(x, y):
    if x > 0.0:
        x, y = _swap(x, y)
        return leaves_loops(x, y)
    return _swap(x, returns_early(y, x))[0]


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("width", [1, 2, 4, 8])
@pytest.mark.parametrize("function", [returns_early, leaves_loops, chooses, calculates, calls])
def test_a_translated_function_does_in_each_lane_what_python_does(function, width, single, tmp_path):
    target = build.target()
    flags = next((t.flags for t in build.TARGETS if t.lanes == width), ())
    if single:
        width, flags = 2 * width, (*flags, build.SINGLE)
    number = np.float32 if single else np.float64
    if width > (1 + single) * max(4, target.lanes):
        pytest.skip("not on this processor")
    translator = Translator(Shapes({}, {}, {}), {})
    name = translator.function(function, ("F", "F")).name
    source = (
        f"{(build.HERE / 'vectors.h').read_text()}\n" + "\n".join(translator.texts) + "\nvoid run(const double *x, "
        "const double *y, double *out) { V a = splat(0.0), b = a; for (int i = 0; i < LANES; i++) { "
        f"set_lane(&a, i, x[i]); set_lane(&b, i, y[i]); }} const V c = {name}(a, b); "
        "for (int i = 0; i < LANES; i++) out[i] = at_lane(c, i); }"
    )
    (tmp_path / "f.c").write_text("typedef struct { const double *at; long size; } Series;\n" + source)
    command = [*build.compiler(), *build.FLAGS, *flags, f"-DLANES={width}", tmp_path / "f.c", "-o", tmp_path / "f.so"]
    subprocess.run([*map(str, command), "-lm"], check=True)
    run = ctypes.CDLL(str(tmp_path / "f.so")).run
    run.argtypes = [np.ctypeslib.ndpointer(float)] * 3
    rng = np.random.default_rng(1)
    for x, y in rng.normal(0.0, 1.0, (200, 2, width)):
        x, y = (np.ascontiguousarray(values.astype(number), dtype=float) for values in (x, y))
        out = np.zeros(width)
        run(x, y, out)
        expected = np.array([function(a, b) for a, b in zip(x, y, strict=True)])
        if not single:
            np.testing.assert_allclose(out, expected, rtol=3e-14, atol=1e-14)
            continue
        eps = np.finfo(np.float32).eps
        rounded = [[function(a + eps * a, b), function(a, b + eps * b)] for a, b in zip(x, y, strict=True)]
        nearby = np.abs(np.array(rounded) - expected[:, None]).max(axis=1)  # what rounding an input may change
        assert np.all(np.abs(out - expected) <= 30.0 * eps * (1.0 + np.abs(expected)) + 4.0 * nearby)


def _asks_for_the_moon(x):
    return math.gamma(x)


def _uses_it(x):
    return 1.0 + _asks_for_the_moon(x)


def _pair(x):
    return x, 1.0


def _one_pair_or_another(x):
    return _pair(x) if x > 0.0 else _pair(-x)


def test_what_has_no_form_in_lanes_is_refused_by_name_or_replaced():
    line = _asks_for_the_moon.__code__.co_firstlineno + 1
    with pytest.raises(UntranslatableError, match=rf"test_lanes.py:{line}: _asks_for_the_moon calls math.gamma"):
        Translator(Shapes({}, {}, {}), {}).function(_uses_it, ("F",))
    with pytest.raises(UntranslatableError, match=r"one_pair_or_another.*: a conditional of several values"):
        Translator(Shapes({}, {}, {}), {}).function(_one_pair_or_another, ("F",))
    told = []

    def without(function, refusal):
        told.append(str(refusal))
        return Intrinsic("splat(NAN)", "F") if function is _asks_for_the_moon else None

    replaced = Translator(Shapes({}, {}, {}), {}, instead=without).function(_uses_it, ("F",))
    assert "splat(NAN)" in replaced.text
    assert "math.gamma" in told[0]
