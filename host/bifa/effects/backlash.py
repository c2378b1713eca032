"""Backlash: play between the bistable mechanism and the moving end."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="backlash",
    summary="the spring follows the moving end only after play is taken up; in an anchor pull, so does the head",
    equation="K(y), y follows x with play of width gap_m; anchor pull: the load train is slack over gap_m",
    source="play operator, e.g. M. Brokate and J. Sprekels, Hysteresis and Phase Transitions, ch. 2",
    enters="eq. (1), the argument of K; the load train of the anchor pull",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    parameters=(EffectParameter("gap_m", "m", 0.0, 0.01, 0.001, "width of the play", size=True),),
    states=1,
)


def initial(position_m):
    """Initial position of the spring: the moving end is in the middle of the play."""
    return position_m


def play(gap_m, position_m, state):
    """Position of the spring when the moving end is at `position_m`."""
    return min(max(state, position_m - 0.5 * gap_m), position_m + 0.5 * gap_m)


play_state = play


def slack(gap_m):
    """Travel of the load train before it pulls."""
    return gap_m
