"""Positions of a model's parameters in the flat vector `q` that compiled code reads."""

import itertools
from functools import cache

from bifa import effects
from bifa.robot.parameters import BASE_PARAMETERS

# Each actuator has a block: BODY + DAMPING, SMALL + AREA ...
MASS, DAMPING, AREA, ALPHA_N, ALPHA_S, THRESHOLD, CONTRACTED, STROKE, VOLUME = range(9)
BODY, SMALL = 0, 9
# Parameters of the whole robot
(
    HEAD_MASS,
    TAIL_MASS,
    SEGMENT_MASS,
    WALL_OFFSET,
    WALL_STIFFNESS,
    WALL_DAMPING,
    MU_S,
    MU_K,
    SUPPLY_POSITIVE,
    SUPPLY_NEGATIVE,
) = range(18, 28)
_EFFECTS = 28

BLOCK_NAMES = {
    "damping_Ns_m": DAMPING,
    "area_N_psi": AREA,
    "alpha_n_per_s": ALPHA_N,
    "alpha_s_per_s": ALPHA_S,
}
ROBOT_NAMES = {
    "head_mass_kg": HEAD_MASS,
    "tail_mass_kg": TAIL_MASS,
    "head_segment_mass_kg": SEGMENT_MASS,
    "small_mass_kg": SMALL + MASS,
    "wall_offset_m": WALL_OFFSET,
    "wall_stiffness_N_m": WALL_STIFFNESS,
    "wall_damping_Ns_m": WALL_DAMPING,
    "mu_s": MU_S,
    "mu_k": MU_K,
    "supply_positive_psi": SUPPLY_POSITIVE,
    "supply_negative_psi": SUPPLY_NEGATIVE,
}
ACTUATORS = 3  # body, head, tail


@cache
def parameter_indices() -> dict[str, int]:
    table = dict(ROBOT_NAMES)
    for name, place in BLOCK_NAMES.items():
        table[f"body_{name}"] = BODY + place
        table[f"small_{name}"] = SMALL + place
    assert table.keys() == BASE_PARAMETERS.keys()
    parameters = [f"{e.name}.{p.name}" for e in effects.library().values() for p in e.parameters]
    return table | {name: _EFFECTS + i for i, name in enumerate(parameters)}


def index(name: str) -> int:
    """Index of a parameter (`mu_k`, `hysteresis.force_N`) in `q`."""
    return parameter_indices()[name]


@cache
def size() -> int:
    """Length of `q`."""
    return max(parameter_indices().values()) + 1


@cache
def effect_bit(name: str) -> int:
    """Number of an effect's bit in the mask of active effects."""
    return list(effects.library()).index(name)


@cache
def effect_slots() -> dict[str, int]:
    """Index of the first of each effect's three states (body, head, tail) in `z`."""
    before = itertools.accumulate((effect.states for effect in effects.library().values()), initial=0)
    return {name: ACTUATORS * states for name, states in zip(effects.library(), before, strict=False)}


def state_size() -> int:
    """Length of `z`."""
    return ACTUATORS * sum(effect.states for effect in effects.library().values())
