"""Defects of recordings: saturated, stuck or clipped channels, clocks that jump, lost markers, missing repeats."""

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from bifa.data import EXPERIMENTS, Dataset, Trial
from bifa.data.dataset import conditions_of
from bifa.data.layout import is_command
from bifa.data.lost import codes, held, runs

from .finding import Finding
from .lag import displacement_lag, misfit, session_misfit

SENSOR_SPAN_PSI = 15.0  # Honeywell ABP...015PD: +-15 psi; beyond it the output is not specified
# The middles of counts 0 and 1023 (`sensor_mpsi` in lib/pressure): 10-90 % of the supply span 30 psi.
ADC_LIMITS_PSI = (-18.73, 18.73)
REPEATS_WANTED = 3  # as in the paper's section IV
SHORT_SHARE = 0.75  # of how long the other repeats last: a record cut off, as when the power fails
MOTION_MM = 1.0  # every experiment moves by more than this (strokes of 30 and 54 mm)
FLAT_SAMPLES = 8  # repetitions in a row of an extreme value, in a channel that otherwise hardly repeats a value
SPIKE_MM = 5.0  # there and back within two samples; a snap-through does not come back


def check_recordings(dataset: Dataset) -> list[Finding]:
    """Return all defects: those of single trials in the order of the data set, then those of the whole."""
    findings = [found for trial in dataset.trials for found in check_recording(trial)]
    return findings + [found for check in DATASET_CHECKS for found in check(dataset)]


def check_recording(trial: Trial) -> list[Finding]:
    """Return the defects of a single trial."""
    return [found for check in TRIAL_CHECKS for found in check(trial)]


def _columns(trial: Trial, *kinds: str) -> Iterator[tuple[str, np.ndarray]]:
    """Name and values of the columns of these quantities, such as "pressure"."""
    return ((name, values) for name, values in trial.columns.items() if name.startswith(kinds))


def _saturated_pressure(trial: Trial) -> Iterator[Finding]:
    low, high = ADC_LIMITS_PSI
    for name, values in _columns(trial, "pressure"):
        rows = np.flatnonzero((values <= low) | (values >= high))
        if rows.size:
            text = f"{rows.size} samples at the ADC's limit of +-{high:g} psi: saturated, or the sensor is broken"
            yield Finding("saturated", text, trial.file, trial.line(rows[0]), name)
            continue
        rows = np.flatnonzero(np.abs(values) > SENSOR_SPAN_PSI)
        if rows.size:
            worst = values[rows][np.argmax(np.abs(values[rows]))]
            text = f"{rows.size} samples beyond the sensor's +-{SENSOR_SPAN_PSI:g} psi, up to {worst:.2f}"
            yield Finding("clipped", text, trial.file, trial.line(rows[0]), name)


def _clipped_instrument(trial: Trial) -> Iterator[Finding]:
    """Flat tops in displacement or force: an extreme value repeats in a channel whose noise never repeats a value."""
    for name, values in _columns(trial, "displacement", "force"):
        same = np.diff(values) == 0
        for extreme in (values.max(), values.min()):
            flat = same & (values[1:] == extreme)
            row, end = max(runs(flat), key=lambda run: run[1] - run[0], default=(0, 0))
            elsewhere = np.mean(same[~flat]) if (~flat).any() else 1.0
            if end - row >= FLAT_SAMPLES and elsewhere < 0.05:
                text = f"{end - row + 1} samples in a row read exactly {extreme:g}: the sensor is clipped"
                yield Finding("clipped", text, trial.file, trial.line(row), name)


def _stuck_channel(trial: Trial) -> Iterator[Finding]:
    for name, values in trial.columns.items():
        if name != "time_s" and not is_command(name) and np.ptp(values) == 0:
            yield Finding("stuck", f"every sample reads {values[0]:g}: is it connected?", trial.file, column=name)


def _spikes(trial: Trial) -> Iterator[Finding]:
    for name, values in _columns(trial, "displacement"):
        step = np.diff(values)
        there, back = step[:-1], step[1:]
        rows = np.flatnonzero((there * back < 0) & (np.minimum(np.abs(there), np.abs(back)) > SPIKE_MM)) + 1
        if rows.size:
            text = f"{rows.size} single samples jump by over {SPIKE_MM:g} mm and back: lost markers?"
            yield Finding("spike", text, trial.file, trial.line(rows[0]), name)


def _no_value(trial: Trial) -> Iterator[Finding]:
    for name, values in trial.columns.items():
        rows = np.flatnonzero(codes(values)) if name != "time_s" else np.array([])
        if rows.size:
            text = f"{rows.size} samples read {values[rows[0]]:g}, a code for a missing value: record it again"
            yield Finding("no value", text, trial.file, trial.line(rows[0]), name)


def _held_marker(trial: Trial) -> Iterator[Finding]:
    if trial.experiment not in ("step_response", "locomotion"):
        return  # a cross-head may rest
    for name, values in _columns(trial, "displacement"):
        rows = np.flatnonzero(held(values))
        if rows.size:
            text = f"{rows.size} samples repeat the one before and then jump: a marker was lost, and held or set to 0"
            yield Finding("held", text, trial.file, trial.line(rows[0]), name)


def _clock(trial: Trial) -> Iterator[Finding]:
    step = np.diff(trial.time_s)
    nominal = 1.0 / trial.nominal_rate_hz
    median = float(np.median(step))
    if abs(median / nominal - 1) > 0.05:
        text = f"sampled at {1 / median:.1f} Hz, but the format specifies {trial.nominal_rate_hz:g} Hz"
        yield Finding("rate", text, trial.file, column="time_s")
    camera_hz = trial.extra.get("camera_rate_hz")
    if isinstance(camera_hz, int | float) and camera_hz < 0.95 * trial.nominal_rate_hz:
        text = f"the camera recorded at {camera_hz:g} Hz, but the format specifies {trial.nominal_rate_hz:g} Hz"
        yield Finding("rate", text, trial.file, column="time_s")
    rows = np.flatnonzero(step > 1.5 * median)
    if rows.size:
        missing = int(np.round(step[rows] / median - 1).sum())
        text = f"the clock jumps {rows.size} times, by up to {step[rows].max():.3f} s; about {missing} samples missing"
        yield Finding("clock jump", text, trial.file, trial.line(rows[0] + 1), "time_s")
    rows = np.flatnonzero(step < 0.5 * median)
    if rows.size:
        text = f"{rows.size} samples follow within half a sampling period, the closest after {step[rows].min():.6f} s"
        yield Finding("clock jump", text, trial.file, trial.line(rows[0] + 1), "time_s")


def _no_motion(trial: Trial) -> Iterator[Finding]:
    for name, values in _columns(trial, "displacement"):
        if np.ptp(values) < MOTION_MM:
            text = f"moves by only {np.ptp(values):.3f} mm: nothing happened in this trial"
            yield Finding("no motion", text, trial.file, column=name)


def _no_command(trial: Trial) -> Iterator[Finding]:
    for name, values in trial.columns.items():
        if is_command(name) and np.ptp(values) == 0:
            yield Finding("no command", f"stays {values[0]:g} throughout", trial.file, column=name)


def _start(trial: Trial) -> Iterator[Finding]:
    """Trials begin contracted (displacement 0); a step response begins under vacuum."""
    for name, values in _columns(trial, "displacement"):
        # Vacuum draws an actuator in beyond its contracted state: small ones by a sixth of their range of motion.
        share = 0.25 if trial.experiment == "step_response" else 0.1
        if abs(values[0]) > 2.0 + share * np.ptp(values):
            text = f"begins at {values[0]:.2f} mm: displacement is 0 at the contracted state"
            yield Finding("start", text, trial.file, trial.line(0), name)
    if trial.experiment == "step_response" and trial.columns["command"][0] != 0:
        yield Finding("start", "begins under pressure, not under vacuum", trial.file, trial.line(0), "command")


def _commanded_pressure(trial: Trial) -> Iterator[Finding]:
    if trial.experiment not in ("static_loading", "anchor_pull") or trial.pressure_psi is None:
        return
    measured = float(np.mean(trial.columns["pressure_psi"]))
    if abs(measured - trial.pressure_psi) > max(1.0, 0.15 * abs(trial.pressure_psi)):
        sign = ": its sign is reversed" if measured * trial.pressure_psi < 0.0 else ""
        text = f"{measured:.2f} psi on average, but {trial.pressure_psi:g} psi was commanded{sign}"
        yield Finding("pressure", text, trial.file, column="pressure_psi")


def _missing_repeats(dataset: Dataset) -> Iterator[Finding]:
    called = conditions_of(dataset)
    for group in dataset.repeats():
        numbers, lacking = {trial.repeat for trial in group}, REPEATS_WANTED - len(group)
        if lacking > 0:
            absent = [number for number in range(1, REPEATS_WANTED + 1) if number not in numbers][:lacking]
            why = "no noise floor can be estimated from it" if len(group) == 1 else "the noise floor is less certain"
            which = f"repeat {absent[0]} is" if len(absent) == 1 else f"repeats {', '.join(map(str, absent))} are"
            text = f"{which} missing; {why}"
            yield Finding("missing repeats", text, condition=called[group[0].file])


def _short_repeats(dataset: Dataset) -> Iterator[Finding]:
    for group in dataset.repeats():
        lasts_s = [float(np.ptp(trial.time_s)) for trial in group]
        for place, trial in enumerate(group):
            others_s = lasts_s[:place] + lasts_s[place + 1 :]
            if others_s and lasts_s[place] < SHORT_SHARE * (usual_s := float(np.median(others_s))):
                text = f"lasts {lasts_s[place]:.2f} s, the others {usual_s:.2f} s: was it cut off? Record it again"
                yield Finding("short", text, trial.file, trial.line(len(trial.time_s) - 1), "time_s")


def _missing_experiments(dataset: Dataset) -> Iterator[Finding]:
    present = {trial.experiment for trial in dataset.trials}
    for experiment in EXPERIMENTS:
        if experiment not in present:
            yield Finding("missing experiment", f"no trial of {experiment}")
    for actuator in ("large", "small"):
        statics = dataset.of("static_loading", actuator)
        if statics and not any(abs(trial.commanded_psi) < 0.5 for trial in statics):
            text = f"no static loading of the {actuator} actuator at 0 psi: its stiffness curve K depends on the area"
            yield Finding("missing experiment", text)


def _lags(dataset: Dataset) -> Iterator[Finding]:
    """Instruments whose clocks were aligned wrongly in single trials, or in all of them."""
    lags = {trial.file: lag for trial in dataset.trials if (lag := displacement_lag(trial)) is not None}
    for file, lag in lags.items():
        others = [other for name, other in lags.items() if name != file]
        if others and (text := misfit(lag, others)):
            yield Finding("lag", text, file)
    if text := session_misfit(list(lags.values())):
        yield Finding("lag", f"median of the {len(lags)} trials that show it: {text}")


def _session_order(dataset: Dataset) -> Iterator[Finding]:
    orders = [trial.session_order for trial in dataset.trials]
    known = [order for order in orders if order is not None]
    if known and len(known) < len(orders):
        text = f"{len(orders) - len(known)} of {len(orders)} trials have no session_order"
        yield Finding("session order", f"{text}: a drift over the session is only partly visible")
    twice = sorted(order for order, count in Counter(known).items() if count > 1)
    if twice:
        yield Finding("session order", f"session_order {', '.join(map(str, twice))} is given to several trials")


TRIAL_CHECKS: tuple[Callable[[Trial], Iterator[Finding]], ...] = (
    _saturated_pressure,
    _clipped_instrument,
    _stuck_channel,
    _spikes,
    _no_value,
    _held_marker,
    _clock,
    _no_motion,
    _no_command,
    _start,
    _commanded_pressure,
)
DATASET_CHECKS: tuple[Callable[[Dataset], Iterator[Finding]], ...] = (
    _missing_repeats,
    _short_repeats,
    _missing_experiments,
    _session_order,
    _lags,
)
