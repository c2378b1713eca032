"""What a session consists of."""

from bifa.measure.plan import session


def test_the_pipes_slope_is_a_setting_of_walks_only():
    trials = session(settings={"inclination_deg": 10.0})
    assert {trial.experiment for trial in trials if trial.settings} == {"locomotion"}
