"""Many simulations of one kind at once, in C, each in a lane of the processor's vectors (docs/lanes.md).

Without a C compiler, the same simulations run in numba.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bifa.simulate import layout
from bifa.simulate.entries import entries
from bifa.simulate.lanes.kernel import ANCHOR, PROGRESS, SEEN, STEP, WALK, Experiment, Kernel, kernels, single_precision
from bifa.simulate.locomotion import READ_BODY, SLIP
from bifa.simulate.plant import Plant
from bifa.simulate.stepper import V_HEAD, V_TAIL, X_HEAD, X_TAIL, Mounting
from bifa.simulate.tables import sealed

__all__ = [
    "ANCHOR",
    "PROGRESS",
    "SEEN",
    "SEEN_OF_WALK",
    "STEP",
    "WALK",
    "Experiment",
    "load",
    "march",
    "width",
]


_WORTH_LANES = 3  # fewest simulations to run in lanes: a step of all lanes costs a little more than two of one lane
SEEN_OF_WALK = [X_HEAD, V_HEAD, X_TAIL, V_TAIL, READ_BODY, READ_BODY + 1, READ_BODY + 2]
_PROGRESS_OF_WALK = [X_HEAD, SLIP]


def width(single: bool = False) -> int:
    """Number of simulations that run side by side, in double or in `single` precision."""
    found = kernels()
    if not found:
        return 1
    return (single_precision(found[0]) if single else found[0]).lanes


def _kernels_for(plants: Sequence[Plant]) -> tuple[Kernel, Kernel] | None:
    found = kernels()
    return found if found and not any(plant.active & found[0].refused for plant in plants) else None


def march(plants: Sequence[Plant], what: Experiment, together: bool) -> list[np.ndarray]:
    """Run each robot's experiment. Returns rows (columns, samples) for each.

    `together`: for robots that differ little, as in derivatives. They share their steps, so that the integrator's
    errors are nearly equal and cancel in the differences from the first robot.
    """
    found = _kernels_for(plants)
    if found is None:
        return [in_numba(what, k, plant) for k, plant in enumerate(plants)]
    many, one = found
    if together and len(plants) > 1:
        return _around_the_first(many, plants, what)
    if len(plants) < _WORTH_LANES:
        return one.march(plants, what, False)
    return (single_precision(many) if what.single else many).march(plants, what, False)


def _around_the_first(kernel: Kernel, plants: Sequence[Plant], what: Experiment) -> list[np.ndarray]:
    """March in packs that each contain the first robot, and shift each pack so that its run of the first robot
    equals that in the first pack."""
    others = kernel.lanes - 1
    packs = [[0, *range(k, min(k + others, len(plants)))] for k in range(1, len(plants), others)]
    order = [k for pack in packs for k in pack]
    chosen = replace(
        what,
        rigs=[what.rigs[k] for k in order],
        switches=[what.switches[k] for k in order],
        sample_s=[what.sample_s[k] for k in order],
    )
    rows = iter(kernel.march([plants[k] for k in order], chosen, True))
    found: list[np.ndarray] = []
    for pack in packs:
        mine = [next(rows) for _ in pack]
        if found:
            correction = found[0] - mine[0]
            for row in mine[1:]:
                row += correction
        found += mine[bool(found) :]
    return found


def load(
    plants: Sequence[Plant], rigs: Sequence[Mounting], paths_m: Sequence[np.ndarray], sample_s: np.ndarray
) -> list[np.ndarray]:
    """Run each robot's static loading. Returns rows (2, samples) for each: force in N, pressure reading in psi."""
    found = _kernels_for(plants)
    if found is None:
        return load_in_numba(plants, rigs, paths_m, sample_s)
    return found[len(plants) < _WORTH_LANES].load(plants, rigs, paths_m, sample_s)


def load_in_numba(
    plants: Sequence[Plant], rigs: Sequence[Mounting], paths_m: Sequence[np.ndarray], sample_s: np.ndarray
) -> list[np.ndarray]:
    size = layout.state_size()
    return [
        entries.static_record(sealed_plant(plant), rig, size, path, sample_s).T
        for plant, rig, path in zip(plants, rigs, paths_m, strict=True)
    ]


def sealed_plant(plant: Plant) -> Plant:
    """A copy whose tables are read-only. They become writable when pickled to another process, and numba would compile
    everything a second time for writable ones."""
    return plant._replace(body_curve=sealed(plant.body_curve.view()), small_curve=sealed(plant.small_curve.view()))


def in_numba(what: Experiment, k: int, plant: Plant) -> np.ndarray:
    commands = what.switches[k]
    place = (sealed_plant(plant), what.rigs[k], layout.state_size())
    end = (what.sample_s[k], what.tolerance_m)
    if what.kind == STEP:
        return entries.step_record(*place, commands.time_s, commands.command, *end).T
    if what.kind == ANCHOR:
        return entries.anchor_record(*place, what.extended_psi, what.rate_m_s, what.load_cell_N_m, *end).T
    rows = entries.walk_record(*place, commands.time_s, commands.chamber, commands.command, *end, what.settled).T
    return rows if what.kind == WALK else rows[SEEN_OF_WALK if what.kind == SEEN else _PROGRESS_OF_WALK]
