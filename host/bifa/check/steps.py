"""Step responses whose command, pressure or displacement has the wrong sign."""

from collections.abc import Iterator

from bifa.check.finding import Finding
from bifa.data import Trial

from .swing import follow, swing

# Of the range, the other way round. Healthy: 0.92 and more of a pressure, 0.53 and more of a displacement.
AGAINST = -0.5
PORTS = "where it should rise: are the sensor's two ports exchanged? Reverse the sign"
_MOVES_MM = 5.0  # the other way; small actuators have a stroke of 30 mm


def check_step_response(trial: Trial) -> Iterator[Finding]:
    """A chamber fills and its actuator extends while the command is 1."""
    command, time_s = trial.columns["command"], trial.time_s
    share = follow(command, trial.columns["pressure_psi"], time_s)
    moved_mm = swing(command, trial.columns["displacement_mm"], time_s)
    if share is None or moved_mm is None:
        return
    falls, shrinks = share < AGAINST, moved_mm < -_MOVES_MM
    if falls and shrinks:
        text = (
            f"while it is 1 the pressure falls and the displacement shrinks by {-moved_mm:.1f} mm: 1 is positive "
            "pressure, 0 vacuum; exchange them"
        )
        yield Finding("sign", text, trial.file, column="command")
    elif falls:
        psi = -(swing(command, trial.columns["pressure_psi"], time_s) or 0.0)
        text = f"falls by {psi:.2f} psi while the command is positive, {PORTS}"
        yield Finding("sign", text, trial.file, column="pressure_psi")
    elif shrinks:
        text = (
            f"shrinks by {-moved_mm:.1f} mm while the actuator is inflated: displacement is positive when extending; "
            "reverse its sign"
        )
        yield Finding("sign", text, trial.file, column="displacement_mm")
