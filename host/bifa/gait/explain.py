"""How two gaits differ and why one is faster: the paper's three reasons (section VI.A) as numbers."""

from dataclasses import dataclass

import numpy as np

from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import SimulatedTrial, walk

CYCLES = 8
_RATE_HZ = 1000.0


@dataclass(frozen=True)
class Anatomy:
    """One settled cycle of a gait on a model. Times in s, pressures in psi.

    extension_s, contraction_s: from the body's command until it passes its unstable point; NaN if it never does.
    tail_lead_s: from the tail's command to anchor to the body's to extend; head_lead_s: from the head's to anchor to
    the body's to contract (both negative if after it). extended_psi, contracted_psi: body pressure when the next
    command is given.
    """

    gait: Gait
    record: SimulatedTrial
    advance_mm: float
    speed_mm_s: float
    extension_s: float
    contraction_s: float
    tail_lead_s: float
    head_lead_s: float
    extended_psi: float
    contracted_psi: float


def anatomy(model: Model, gait: Gait) -> Anatomy:
    """Simulate the gait and analyse its last cycles."""
    samples = round(CYCLES * gait.period_s * _RATE_HZ) + 1
    record = walk(model, gait, time_s=np.arange(samples) / _RATE_HZ)
    time, head = record["time_s"], record["displacement_head_mm"]
    start = (CYCLES - 1) * gait.period_s
    advance = float(np.interp(CYCLES * gait.period_s, time, head) - np.interp(start, time, head))
    unstable = model.body_stiffness.unstable_m
    on = _switch(gait, "body", to_positive=True)
    off = _switch(gait, "body", to_positive=False)
    body_psi = record["body_psi"]
    return Anatomy(
        gait=gait,
        record=record,
        advance_mm=advance,
        speed_mm_s=advance / gait.period_s,
        extension_s=_first_after(time, record["body_m"] - unstable, _late(on, gait)),
        contraction_s=_first_after(time, unstable - record["body_m"], _late(off, gait)),
        tail_lead_s=_wrapped(on - _switch(gait, "tail", to_positive=True), gait.period_s),
        head_lead_s=_wrapped(off - _switch(gait, "head", to_positive=True), gait.period_s),
        extended_psi=float(np.interp(_late(off, gait) - 1e-3, time, body_psi)),
        contracted_psi=float(np.interp(_late(on, gait) - 1e-3, time, body_psi)),
    )


def reasons(before: Anatomy, after: Anatomy) -> list[str]:
    """Describe what changed from `before` to `after`, one sentence with figures for each reason."""
    model_supply = max(abs(before.extended_psi), abs(after.extended_psi))
    return [
        f"Speed {before.speed_mm_s:.1f} to {after.speed_mm_s:.1f} mm/s: the cycle takes {after.gait.period_s:.2f} s "
        f"instead of {before.gait.period_s:.2f} s and advances {after.advance_mm:.1f} mm "
        f"instead of {before.advance_mm:.1f} mm.",
        f"The body has {100 * after.gait.duty_body:.0f} % of the cycle to contract, previously "
        f"{100 * before.gait.duty_body:.0f} %: it snaps {_seconds(after.contraction_s)} after the command when "
        f"contracting, {_seconds(after.extension_s)} when extending, because the bulging fabric deflates slowly.",
        f"The tail is commanded to anchor {_lead(after.tail_lead_s)} the body's extension, previously "
        f"{_lead(before.tail_lead_s)}; the head {_lead(after.head_lead_s)} its contraction, previously "
        f"{_lead(before.head_lead_s)}: the body responds later than the ends, so less waiting is needed.",
        f"The body's pressure is reversed at {after.extended_psi:.1f} and {after.contracted_psi:.1f} psi, previously "
        f"{before.extended_psi:.1f} and {before.contracted_psi:.1f} psi: passing the spring's peak is enough, "
        f"and the full supply pressure ({model_supply:.1f} psi was reached) is not needed.",
    ]


def _switch(gait: Gait, chamber: str, to_positive: bool) -> float:
    """Time of a chamber's switch within the cycle: at phase 2 pi d to positive, at phase 0 to vacuum."""
    values = gait.as_dict()
    ahead = {"body": 0.0, "head": gait.psi12_deg, "tail": gait.psi13_deg}[chamber] / 360.0
    return ((values[f"duty_{chamber}"] if to_positive else 0.0) - ahead) % 1.0 * gait.period_s


def _late(within_cycle: float, gait: Gait) -> float:
    """Shift a time within the cycle to the last cycle but one, so that what follows it is recorded."""
    return (CYCLES - 2) * gait.period_s + within_cycle


def _first_after(time: np.ndarray, signal: np.ndarray, start: float) -> float:
    """Seconds from `start` until `signal` turns positive from below; NaN if it does not."""
    later = np.flatnonzero((time[1:] > start) & (signal[:-1] <= 0.0) & (signal[1:] > 0.0))
    return float(time[later[0] + 1] - start) if later.size else float("nan")


def _wrapped(seconds: float, period_s: float) -> float:
    return (seconds + 0.5 * period_s) % period_s - 0.5 * period_s


def _seconds(value: float) -> str:
    return "never" if np.isnan(value) else f"{value:.2f} s"


def _lead(seconds: float) -> str:
    return f"{abs(seconds):.2f} s {'before' if seconds >= 0 else 'after'}"
