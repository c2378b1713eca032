"""Comparison with every figure that the paper reports and the model can predict."""

from dataclasses import dataclass

import numpy as np

from bifa.robot import BASELINE, Gait, Model
from bifa.robot.model import GRAVITY_M_S2
from bifa.simulate.gaits import speed
from bifa.simulate.passing import Passing, passing
from bifa.simulate.records import anchor_pull, static_loading, step_response
from bifa.simulate.terrain import OBSTACLES, Supports, tunnel

# Close to the nominal model's fastest gait (as found by `bifa optimize`), the counterpart of the paper's Fig. 7 (b).
FAST = Gait(2.515966106, 208.934381, 331.874322, 0.649065611, 0.442500311, 0.442500311)
# The same for `robot.strong_push()`.
FAST_STRONG = Gait(2.52425, 179.4798, 354.26768, 0.64656, 0.46758, 0.46758)
SLOW = Gait(6.0, 270.0, 90.0, 0.5, 0.5, 0.5)
_PULL_S = np.arange(0.0, 2.0, 1e-3)
_CYCLES = 14
_FINE_M = 1e-7


@dataclass(frozen=True)
class Row:
    """One line of the table. `fits`: our value agrees with the paper's within the precision of the latter."""

    what: str
    paper: str
    ours: str
    fits: bool
    remark: str = ""


def compare(model: Model, fast: Gait = FAST) -> list[Row]:
    """All rows for a model and its fastest gait. Takes about a second."""
    return [*_speeds(model, fast), *_forces(model), *_steps(model), *_tunnel(model, fast)]


def _speeds(model: Model, gait: Gait) -> list[Row]:
    baseline = float(speed(model, BASELINE, _CYCLES, _FINE_M).speed_mm_s)
    fast = speed(model, gait, _CYCLES, _FINE_M)
    best = float(fast.speed_mm_s)
    gain = best / baseline - 1.0
    return [
        _row("baseline gait, mm/s", 10.8, baseline, 0.1, "10.8 ± 0.1"),
        _row("fastest gait, mm/s", 23.3, best, 0.2, "23.3 ± 0.1"),
        _row("body duty of the fastest gait", 0.66, gait.duty_body, 0.02, "0.66"),
        Row("gain", "120 %", f"{gain:.0%}", abs(gain - 1.157) < 0.03, "23.3 over 10.8 is 116 %"),
        Row("slip in a cycle, mm", "none", f"{1e3 * fast.slip_m[-1]:.3f}", bool(fast.slip_m[-1] < 1e-5)),
    ]


def _forces(model: Model) -> list[Row]:
    pressure = model["supply_positive_psi"]
    anchored = float(anchor_pull(model, _PULL_S, 20.0, pressure)["force_N"].max())
    vented = float(anchor_pull(model, _PULL_S, 20.0, 0.0)["force_N"].max())
    weight = GRAVITY_M_S2 * (model["head_mass_kg"] + model["tail_mass_kg"])
    push = _push(model, pressure)
    needed = pressure + (150.0 - push) / model["body_area_N_psi"]
    return [
        _row(f"anchor of one segment at {pressure:g} psi, N", 33.0, anchored, 1.0, "about 33"),
        _row("anchor of one segment at 0 psi, N", 5.0, vented, 0.3, "about 5"),
        _row("both anchors at 0 psi over the weight", 3.0, 2.0 * vented / weight, 0.3, "3"),
        _row("push of the body at 0 psi, N", 40.0, _push(model, 0.0), 1.0, "about 40"),
        Row(
            f"push of the body at {pressure:g} psi, N",
            "over 150",
            f"{push:.0f}",
            push >= 150.0,
            "" if push >= 150.0 else f"150 N would need {needed:.1f} psi",
        ),
    ]


def _push(model: Model, pressure_psi: float) -> float:
    stroke = 1e3 * model.body_stiffness.stroke_m
    time = np.arange(0.0, 10.0, 0.01)
    record = static_loading(model, "large", time, np.linspace(0.0, stroke, time.size), pressure_psi)
    return -float(record["force_N"].min())


def _steps(model: Model) -> list[Row]:
    record = step_response(model, "large")
    x, time, going = record["displacement_mm"], record["time_s"], record["command"] == 1.0
    stroke = 1e3 * model.body_stiffness.stroke_m
    crossing = [time[going][np.argmax(x[going] > share * stroke)] for share in (0.2, 0.8)]
    snap = float(crossing[1] - crossing[0])
    base = model.base  # whatever effects the model has
    without, with_loop = (
        step_response(one, "large")["displacement_mm"] for one in (base, base.with_effects({"hysteresis": {}}))
    )
    offset = float(np.max(np.abs(with_loop - without)[[0, int(np.flatnonzero(going)[-1])]]))
    return [
        Row("travel between the stable states, mm", "Fig. 4", f"{stroke:.1f}", True, "the text gives no number"),
        Row("snap-through, 20 to 80 % of the travel, s", "very fast", f"{snap:.2f}", snap < 0.3),
        Row(
            "offset of the model's ends, mm",
            "about 2",
            f"{offset:.1f}",
            abs(offset - 2.0) < 0.5,
            "with 4 N of hysteresis added; K is too steep at its ends for a larger offset",
        ),
    ]


def _tunnel(model: Model, fast: Gait) -> list[Row]:
    rows = []
    for name, gait, passes in (("fastest", fast, False), ("6 s", SLOW, True)):
        through = passing(model, gait, tunnel(), Supports()).through
        paper, ours = ("yes" if passed else "no" for passed in (passes, through))
        rows.append(Row(f"{name} gait through the tunnel", paper, ours, through == passes))
    return rows


def obstacle_rows(model: Model, fast: Gait = FAST) -> list[tuple[str, str, Passing]]:
    """Rows (obstacle, gait, result) for the paper's obstacles and gaits."""
    gaits = {"fastest": fast, "baseline": BASELINE, "6 s": SLOW}
    return [
        (obstacle, name, passing(model, gait, ahead(), Supports()))
        for obstacle, ahead in OBSTACLES.items()
        for name, gait in gaits.items()
    ]


def _row(what: str, paper: float, ours: float, precision: float, shown: str) -> Row:
    digits = 2 if paper < 1.0 else 1
    return Row(what, shown, f"{ours:.{digits}f}", abs(ours - paper) <= precision)
