"""Switch times of the valves, from columns sampled every 10 ms only."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bifa.data import Dataset, DatasetError, Trial, read_dataset, write_dataset
from bifa.problem.inputs import inputs_of
from bifa.problem.switches import step_timeline, switch_sd_s, valves_of, walk_timeline
from bifa.simulate import timeline, vented_between
from bifa.simulate.stepper import OFF

TIME = np.arange(2000) * 0.01
CHAMBERS = ("body", "head", "tail")


def _of(gait):
    phases = np.array([0.0, gait["psi12_deg"], gait["psi13_deg"]]) / 360
    return phases, np.array([gait["duty_body"], gait["duty_head"], gait["duty_tail"]])


def walk(gait, start_s=0.0, phases=None, **extra) -> Trial:
    """The commands of a settled CPG, sampled at 100 Hz."""
    settled, duties = _of(gait)
    u = ((TIME[:, None] - start_s) / gait["period_s"] + (settled if phases is None else phases)) % 1.0 > duties
    columns = {"time_s": TIME} | {f"command_{c}": u[:, i].astype(float) for i, c in enumerate(CHAMBERS)}
    return Trial("walk.csv", "locomotion", columns, gait=gait, extra=extra)


def exact(gait, chamber, start_s=0.0):
    """Times of all switches between the first and the last sample."""
    phases, duties = _of(gait)
    i = CHAMBERS.index(chamber)
    turns = np.arange(-2, 60)
    times = np.concatenate([turns + duties[i] - phases[i], turns - phases[i]]) * gait["period_s"] + start_s
    return np.sort(times[(times > 0.02) & (times < TIME[-1] - 0.02)])


def found(timeline, chamber):
    times = timeline.time_s[timeline.chamber == CHAMBERS.index(chamber)]
    return times[(times > 0.02) & (times < TIME[-1] - 0.02)]


GAIT = {"period_s": 3.0, "psi12_deg": 200.0, "psi13_deg": 100.0, "duty_body": 0.5, "duty_head": 0.4, "duty_tail": 0.4}
RANGES = {"per": st.floats(2.0, 4.0), "psi": st.floats(10.0, 350.0), "dut": st.floats(0.2, 0.8)}
gaits = st.fixed_dictionaries({name: RANGES[name[:3]] for name in GAIT})


@settings(max_examples=100)
@given(gait=gaits, age_s=st.none() | st.floats(0.0, 0.009))
@example(GAIT | {"period_s": 2.0, "psi13_deg": 120.0, "duty_tail": 1 / 3}, None)  # the tail switches at time 0
def test_a_walk_switches_when_its_gait_says_not_when_the_sample_shows_it(gait, age_s):
    """A row's time is that of its pressures; if the commands' age is noted, they are those of the strobe before."""
    trial = walk(gait)
    if age_s is not None:
        trial = replace(trial, columns=trial.columns | {"time_s": TIME + age_s}, extra={"command_age_s": age_s})
    timeline = walk_timeline(trial)
    for chamber in CHAMBERS:
        assert found(timeline, chamber) == pytest.approx(exact(gait, chamber), abs=1e-4)


@settings(max_examples=60)
@given(gait=gaits, start_s=st.floats(0.0, 0.03))
def test_a_walk_that_began_between_samples_is_shifted_as_a_whole(gait, start_s):
    timeline = walk_timeline(walk(gait, start_s))
    for chamber in CHAMBERS:
        truth, times = exact(gait, chamber, start_s), found(timeline, chamber)
        inside = truth[(truth > 0.06) & (truth < TIME[-1] - 0.06)]
        nearest = np.abs(times[None, :] - inside[:, None]).min(axis=1)
        assert nearest.max(initial=0.0) <= 0.01 + 1e-5


def test_commands_that_do_not_follow_the_gait_are_taken_from_the_column():
    trial = walk(GAIT, phases=np.array([0.3, 0.1, 0.8]))
    timeline = walk_timeline(trial)
    for chamber in CHAMBERS:
        at = np.flatnonzero(np.diff(trial.columns[f"command_{chamber}"]))
        assert found(timeline, chamber) == pytest.approx(TIME[at] + 0.005, abs=0.0051)


def test_noted_times_count_most():
    noted = {c: [float(t) + 0.001 for t in exact(GAIT, c)] for c in CHAMBERS}
    timeline = walk_timeline(walk(GAIT, switch_time_s=noted))
    for chamber in CHAMBERS:
        assert list(found(timeline, chamber)) == noted[chamber]


def step(rise_s, **extra) -> Trial:
    columns = {"time_s": TIME, "command": ((rise_s - 1e-9 <= TIME) & (rise_s + 3.0 - 1e-9 > TIME)).astype(float)}
    return Trial("s.csv", "step_response", columns, actuator="large", pressure_psi=8.5, extra=extra)


@pytest.mark.parametrize(("rise_s", "middle_s"), [(0.5, 0.495), (0.504, 0.505), (0.4999, 0.495)])
def test_a_step_is_between_the_samples_that_show_it_on_round_times_too(rise_s, middle_s):
    timeline = step_timeline(step(rise_s))
    assert timeline.time_s == pytest.approx([0.0, middle_s, middle_s + 3.0], abs=1e-9)
    assert list(timeline.command) == [0, 1, 0]
    assert switch_sd_s(step(rise_s)) == pytest.approx(0.005 / np.sqrt(3.0))


def test_a_declared_schedule_is_exact():
    declared = step(0.5, switch_time_s=[0.493, 3.494])
    assert list(step_timeline(declared).time_s) == [0.0, 0.493, 3.494]
    assert switch_sd_s(declared) == 0.0
    assert switch_sd_s(step(0.5, switch_time_s=[0.493, 3.494], switch_error_s=0.001)) == pytest.approx(5.774e-4, 1e-3)


def test_a_command_that_never_changes_has_no_switches():
    columns = {"time_s": TIME, "command": np.zeros(len(TIME))}
    timeline = step_timeline(Trial("s.csv", "step_response", columns, actuator="large", pressure_psi=8.5))
    assert (list(timeline.time_s), list(timeline.command)) == ([0.0], [0])


@settings(max_examples=40)
@given(gait=gaits, dead_time_s=st.floats(1e-3, 0.02))
def test_from_one_supply_to_the_other_a_chamber_is_vented(gait, dead_time_s):
    commands = walk_timeline(walk(gait))
    valves = vented_between(commands, dead_time_s)
    assert (np.diff(valves.time_s) >= 0.0).all()
    for chamber in range(3):
        commanded = commands.time_s[commands.chamber == chamber][1:]
        commanded = commanded[np.diff(commanded, append=np.inf) > 2 * dead_time_s]
        vented = valves.at(commanded + 0.5 * dead_time_s)[:, chamber]
        assert (vented == OFF).all()
        expected = commands.at(commanded)[:, chamber]
        np.testing.assert_array_equal(valves.at(commanded + 1.001 * dead_time_s)[:, chamber], expected)
        np.testing.assert_array_equal(
            valves.at(commanded - 1e-6)[:, chamber], commands.at(commanded - 1e-6)[:, chamber]
        )


def test_a_chamber_that_is_off_waits_for_no_dead_time():
    commands = timeline([(0.0, 0, OFF), (1.0, 0, 1), (2.0, 0, OFF), (3.0, 0, 0)])
    np.testing.assert_array_equal(vented_between(commands, 0.004).time_s, commands.time_s)


def test_valves_are_told_in_seconds_of_the_quartz():
    trial = step(0.5, switch_time_s=[0.5, 3.5], clock_rate=1.002, dead_time_s=0.004)
    valves = valves_of(step_timeline(trial), trial)
    assert valves.time_s * 1.002 == pytest.approx([0.0, 0.5, 0.504, 3.5, 3.504])
    assert list(valves.command) == [0, 2, 1, 2, 0]
    inputs = inputs_of(trial)
    assert inputs.time_s[-1] * 1.002 == pytest.approx(TIME[-1])
    np.testing.assert_array_equal(inputs.commands.time_s, valves.time_s)


def test_without_notes_the_commands_are_what_the_valves_do():
    trial = step(0.5, switch_time_s=[0.5, 3.5])
    np.testing.assert_array_equal(valves_of(step_timeline(trial), trial).time_s, step_timeline(trial).time_s)


@pytest.mark.parametrize("begin_s", [0.0, 100.0, -5.0])
def test_noted_times_count_from_the_trials_begin_wherever_its_clock_stands(begin_s, tmp_path):
    declared = step(0.5, switch_time_s=[0.493, 3.494])
    columns = {"time_s": TIME + begin_s, "command": declared.columns["command"]}
    columns |= {name: np.zeros(len(TIME)) for name in ("displacement_mm", "pressure_psi")}
    trial = replace(declared, columns=columns)
    (read,) = read_dataset(write_dataset(tmp_path / "day", Dataset(None, "day", {}, (trial,)))).trials
    assert list(step_timeline(read).time_s) == [0.0, 0.493, 3.494]
    absolute = replace(trial, extra={"switch_time_s": [begin_s + 100.493, begin_s + 103.494]})
    with pytest.raises(DatasetError, match="must be increasing times in s since the trial began"):
        write_dataset(tmp_path / "absolute", Dataset(None, "day", {}, (absolute,)))


def test_noted_times_that_are_not_as_many_as_the_switches_are_not_used():
    assert switch_sd_s(step(0.5, switch_time_s=[])) == switch_sd_s(step(0.5)) > 0.0


@pytest.mark.parametrize("age_s", [0.05, -0.05])
@pytest.mark.parametrize("extra", [{}, {"switch_time_s": {c: list(exact(GAIT, c)) for c in CHAMBERS}}])
def test_a_record_begins_at_0_however_old_its_commands_are(age_s, extra):
    """Commands that follow no gait, or with noted times: nothing switches before the record begins."""
    other = GAIT if extra else {**GAIT, "period_s": 3.4}
    commands = walk_timeline(replace(walk(GAIT, command_age_s=age_s, **extra), gait=other))
    for chamber in range(3):
        assert commands.time_s[commands.chamber == chamber].min() == 0.0
