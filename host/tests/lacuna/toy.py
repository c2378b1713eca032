"""A mass on a spring with hidden effects: a small system for trying and testing the engine.

    m x'' = u(t - delay) - k x - k3 x^3 - (1 + wobble) b x' - c |x'| x' - f sign(x') - r sin(2 pi x / pitch)

The base model knows m, k and b only; every other term is an effect, and `hide` puts some of them into the
measurements. The ripple `r` is in no library: it stands for a mechanism that nobody thought of. Damping varies
from run to run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy.signal import lfilter

from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.split import split_trials
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import Fit, fit
from lacuna.estimation.solve import cost_of
from lacuna.estimation.structure import Structure
from lacuna.system import (
    CandidateExperiment,
    Channels,
    Correction,
    CorrectionSite,
    Effect,
    Parameter,
    Record,
    System,
    Theta,
)

NOBODY = Workers(lambda _: None)  # reports no progress and forks no process
SAMPLE_S = 0.01
STEPS_PER_SAMPLE = 8
RIPPLE_PITCH_M = 0.06
WOBBLE_SD = 0.02
SENSOR_SD_MM = 0.2
DRIFTING = {"seed": 16, "repeats": 6, "drift": 0.02}  # arguments of `hide` for a drift that is not noise

_BASE = (
    Parameter("mass_kg", "kg", 1.0, 0.2, 5.0, plausible=(0.8, 1.25), scale=0.1),
    Parameter("stiffness_N_m", "N/m", 40.0, 5.0, 200.0, plausible=(30.0, 52.0), scale=4.0),
    Parameter("damping_Ns_m", "N s/m", 2.0, 0.05, 20.0, plausible=(1.0, 4.0), scale=0.3),
)


_EFFECTS = {
    name: Effect(name, Parameter(*parameter, scale=scale), enters, equation=equation, source="textbook")
    for name, parameter, scale, enters, equation in (
        ("coulomb", ("force_N", "N", 0.3, 0.0, 3.0), 0.1, "friction", "F = f sign(x')"),
        ("cubic_spring", ("stiffness_N_m3", "N/m^3", 4000.0, -2e4, 4e4), 1000.0, "spring", "F = k3 x^3"),
        ("quadratic_drag", ("drag_Ns2_m2", "N s^2/m^2", 4.0, 0.0, 40.0), 1.0, "friction", "F = c |x'| x'"),
        ("delay", ("delay_s", "s", 0.03, 0.0, 0.2), 0.01, "input", "u(t - delay)"),
        ("sensor_gain", ("gain", "1", 0.05, -0.3, 0.3), 0.02, "sensor", "y = (1 + gain) x"),
        ("asymmetric_friction", ("difference_N", "N", 0.3, -2.0, 2.0), 0.1, "friction", "F = d if x' > 0"),
    )
}
_IN_ITS_MOTION = [  # in the order of `_simulate`
    *(e.full_name(p) for e in _EFFECTS.values() for p in e.parameters if e.enters != "sensor"),
    "ripple.force_N",
]


@numba.njit(nogil=True, cache=True)
def _acceleration(x, v, u, p, table, lower, upper):
    spring = p[1] * x + p[4] * x**3 + p[8] * np.sin(2 * np.pi * x / RIPPLE_PITCH_M)
    if len(table) > 1:
        at = min(max((x - lower) / (upper - lower), 0.0), 1.0) * (len(table) - 1)
        k = min(int(at), len(table) - 2)
        spring += table[k] + (at - k) * (table[k + 1] - table[k])
    smooth_sign = np.tanh(v / 2e-3)
    friction = p[2] * v + p[3] * smooth_sign + p[5] * abs(v) * v + p[7] * 0.5 * (1 + smooth_sign)
    return (u - spring - friction) / p[0]


@numba.njit(nogil=True, cache=True)
def _simulate(force, p, table, lower, upper):
    """Position at each sample, m. `p`: mass, stiffness, damping, coulomb, cubic, drag, delay, asymmetry, ripple."""
    h = SAMPLE_S / STEPS_PER_SAMPLE
    out = np.empty(len(force))
    x, v = 0.0, 0.0
    for i in range(len(force)):
        out[i] = x
        for s in range(STEPS_PER_SAMPLE):
            t = i * SAMPLE_S + s * h - p[6]
            at = t / SAMPLE_S
            u = 0.0
            if at >= 0:
                k = min(int(at), len(force) - 2)
                u = force[k] + (at - k) * (force[k + 1] - force[k])
            a1 = _acceleration(x, v, u, p, table, lower, upper)
            xm, vm = x + 0.5 * h * v, v + 0.5 * h * a1
            a2 = _acceleration(xm, vm, u, p, table, lower, upper)
            x, v = x + h * vm, v + h * a2
    return out


@dataclass(frozen=True)
class ToySystem(System):
    """The measured `trials`, and the library of `effects` on offer."""

    trials: tuple[Record, ...]
    effects: Mapping[str, Effect]
    name: str = "mass on a spring"
    parameters: tuple[Parameter, ...] = _BASE

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        return {"position_mm": _position_mm(theta, trial.payload, corrections)}

    def regressors(self, trial: Record, prediction: Channels) -> dict[str, np.ndarray]:
        position = prediction["position_mm"]
        velocity = np.gradient(position, trial.time_s)
        return {
            "position": position,
            "velocity": velocity,
            "direction of motion": np.sign(velocity),
            "force": trial.payload,
        }

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        return (Parameter("wobble", "1", 0.0, -0.5, 0.5, scale=WOBBLE_SD),)

    def sensor_noise(self, experiment: str, channel: str) -> float:
        return SENSOR_SD_MM

    @property
    def correction_sites(self) -> Mapping[str, CorrectionSite]:
        site = CorrectionSite("spring", "force of the spring", "position (m)", "N", -0.08, 0.08, 0.2, experiments=())
        return {site.name: site}

    def candidate_experiments(self) -> tuple[CandidateExperiment, ...]:
        offers = [(experiment, size) for experiment in ("steps", "sweep") for size in (0.5, 4.0)]
        unknown = np.full(len(self.trials[0].time_s), np.nan)
        return tuple(CandidateExperiment(e, {"force_N": size}, _trial(e, size, 0, None, unknown)) for e, size in offers)


def _position_mm(theta: Theta, force: np.ndarray, corrections: Sequence[Correction] = ()) -> np.ndarray:
    damping_Ns_m = theta["damping_Ns_m"] * (1 + theta.get("wobble", 0.0))
    effects = (theta.get(name, 0.0) for name in _IN_ITS_MOTION)
    p = np.array([theta["mass_kg"], theta["stiffness_N_m"], damping_Ns_m, *effects])
    table = corrections[0].table[0] if corrections else np.zeros(1)
    return 1e3 * (1 + theta.get("sensor_gain.gain", 0.0)) * _simulate(force, p, table, -0.08, 0.08)


def _force(experiment: str, size: float) -> np.ndarray:
    time = np.arange(0, 6, SAMPLE_S)
    if experiment == "steps":
        return size * (((time > 0.5) & (time < 2)).astype(float) - ((time > 3) & (time < 4.5)))
    return size * np.sin(2 * np.pi * (0.2 + 0.2 * time) * time) * (time > 0.2)


def _trial(experiment, size, repeat, order, position_mm) -> Record:
    time_s, name = np.arange(0, 6, SAMPLE_S), f"{experiment}_{size:g}N_{repeat}"
    channels = {"position_mm": position_mm}
    return Record(name, experiment, size, time_s, channels, order, _force(experiment, size))


def slow(noise: np.ndarray, correlation: float) -> np.ndarray:
    """Correlate the neighbouring samples of white noise without changing its standard deviation."""
    return lfilter([np.sqrt(1 - correlation**2)], [1.0, -correlation], noise)


def hide(
    effects: Mapping[str, float],
    *,
    seed: int = 0,
    repeats: int = 3,
    sizes: Sequence[float] = (1.0, 2.0),
    withhold: Sequence[str] = (),
    drift: float = 0.0,
    noise_correlation: float = 0.0,
) -> ToySystem:
    """Measure a mass on a spring that has `effects`, as {full parameter name: size}.

    `withhold` removes effects from the library; `drift` is the relative change of the stiffness over the
    session; `noise_correlation` is that between neighbouring samples of the sensor's noise.
    """
    draw = np.random.default_rng(seed)
    truth = draw_base(draw)
    plan = [(e, s, r) for r in range(repeats) for e in ("steps", "sweep") for s in sizes]
    trials = []
    for order, (experiment, size, repeat) in enumerate(plan):
        run = truth | dict(effects) | {"wobble": WOBBLE_SD * draw.standard_normal()}
        run["stiffness_N_m"] *= 1 + drift * order / len(plan)
        clean = _position_mm(run, _force(experiment, size))
        noise = SENSOR_SD_MM * draw.standard_normal(len(clean))
        noise = slow(noise, noise_correlation)
        trials.append(_trial(experiment, size, repeat + 1, order, clean + noise))
    library = {name: e for name, e in _EFFECTS.items() if name not in withhold}
    return ToySystem(tuple(trials), library)


def case_of(system: System, spare=None, suspected: Sequence[str] = ()) -> Case:
    """The case of any system. `spare`: conditions that are never fitted; by default those that the system spares."""
    split = split_trials(system.trials, system.spare() if spare is None else spare)
    return Case(system, split, POLICY, 0, suspected)


def with_effect(case: Case, effect: str) -> tuple[Candidate, Candidate]:
    """The fitted base model, and a fit with an effect that is warm-started from it."""
    base = case.judge(case.fit_base(1))
    structure = Structure(case.system, (effect,))
    start = [structure.start(base.fitted.theta)]
    return base, case.judge(fit(structure, case.split.fit, base.fitted.problem.floor, starts=start))


def moved(fitted: Fit, **theta: float) -> Fit:
    """The fit as if it had ended at `theta`."""
    point = replace(fitted.solution.point, values=fitted.structure.values(fitted.theta | theta))
    solution = replace(fitted.solution, point=point, cost=cost_of(fitted.problem, point))
    return replace(fitted, solution=solution)


def draw_base(draw: np.random.Generator) -> dict[str, float]:
    """Draw the parameters of the base model."""
    return {
        "mass_kg": 1.0 * np.exp(0.05 * draw.standard_normal()),
        "stiffness_N_m": 40 * np.exp(0.05 * draw.standard_normal()),
        "damping_Ns_m": 2 * np.exp(0.1 * draw.standard_normal()),
    }
