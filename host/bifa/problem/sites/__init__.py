"""Sites where a learnt curve may be added: the robot's equations, quantities that differ between trials, and the
instruments. To add a site, add an entry to one of the tables."""

from collections.abc import Mapping, Sequence

from bifa.problem.curves import FittedCurve
from bifa.problem.inputs import Inputs
from bifa.problem.sites import equations, instruments, trials
from bifa.problem.sites.site import Range
from bifa.robot import Model
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from bifa.simulate.plant import with_curve
from lacuna.system import Channels, Correction, CorrectionSite

SITES = {
    site.name: site for site in sorted((*equations.SITES, *trials.SITES, *instruments.SITES), key=lambda s: s.name)
}


def declared(model: Model, curves: Mapping[str, FittedCurve]) -> dict[str, CorrectionSite]:
    """The sites of a model. Sites over a spring's range use that of its fitted curve, if there is one."""
    springs = {"body": model.body_stiffness, "small": model.small_stiffness}
    fitted = {prefix: curves[prefix].fit if prefix in curves else spring for prefix, spring in springs.items()}
    ranges = {prefix: Range("displacement (m)", spring.lower_m, spring.upper_m) for prefix, spring in fitted.items()}
    return {name: site.declared(ranges) for name, site in SITES.items()}


def corrected(plant: Plant, corrections: Sequence[Correction], place_in_session: float = 0.0) -> Plant:
    """The plant with the learnt curves applied. place_in_session: 0 for the day's first trial, 1 for its last."""
    for correction in corrections:
        site = SITES[correction.site]
        if site.equation:
            plant = with_curve(plant, site.name, _curve(plant, correction))
        elif site.plant:
            plant = site.plant(plant, _curve(plant, correction), place_in_session)
    return plant


def corrected_inputs(
    inputs: Inputs, corrections: Sequence[Correction], plant: Plant, place_in_session: float = 0.0
) -> Inputs:
    """The inputs that reach the robot with the learnt curves applied: late valves, different grip of the pipe."""
    for correction in corrections:
        if act := SITES[correction.site].inputs:
            inputs = act(inputs, _curve(plant, correction), place_in_session)
    return inputs


def corrected_readings(channels: Channels, corrections: Sequence[Correction], inputs: Inputs, plant: Plant) -> Channels:
    """The channels with the learnt curves of the instruments applied."""
    for correction in corrections:
        if act := SITES[correction.site].readings:
            channels = channels | act(channels, _curve(plant, correction), inputs, plant)
    return channels


def learnt_curves(plant: Plant, corrections: Sequence[Correction]) -> dict[str, LearntCurve]:
    """Curves of the corrections in the robot's own equations, as a model holds them. Corrections of the instruments,
    and those that change over the day, are not part of the robot."""
    return {c.site: _curve(plant, c) for c in corrections if SITES[c.site].equation}


def _curve(plant: Plant, correction: Correction) -> LearntCurve:
    over = SITES[correction.site].over
    if isinstance(over, str):
        table = plant.body_curve if over == "body" else plant.small_curve
        return LearntCurve(float(table[0, 0]), float(table[0, 1]), correction.table)
    return LearntCurve(over.lower, over.upper, correction.table)
