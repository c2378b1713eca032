# SPDX-License-Identifier: GPL-3.0-or-later
"""Sealed data sets: undisclosed effects, drawn from a seed.

    python -m virtual_robot.sealed --seed 7 --out runs/seven

writes a data set of 45 trials to runs/seven, and its truth to runs/seven.sealed.toml beside the folder, which the
diagnosis never opens. The seed determines the specimen of the robot, the noise, the order of the trials, the effect,
its size (0.3 to 1.5 times what the lab calls modest) and its other parameters. `--truth foreign` takes a robot that
shares no formula with this one or with any library: 48 trials, sizes 0.3 to 1 (virtual_robot.truths.foreign,
docs/truths.md).
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tomli_w

from virtual_robot import gait
from virtual_robot.data_folder import check_numbers, new_folder, seal_of, write_csv, write_head
from virtual_robot.effects import EFFECTS, LIBRARY, OUTSIDE, plant_parameters
from virtual_robot.errors import VirtualRobotError
from virtual_robot.plant import NOMINAL, Curve, nominal_curves
from virtual_robot.trials import Lab, Plan
from virtual_robot.truths import foreign

KINDS = ("single", "none", "pair", "outside")
SIZES = (0.3, 1.5)
REPEATS = 3

# Spread between specimens, sd of the logarithm.
_SPREAD = {
    "body_damping_Ns_m": 0.08,
    "body_area_N_psi": 0.04,
    "body_alpha_n_per_s": 0.06,
    "body_alpha_s_per_s": 0.06,
    "small_damping_Ns_m": 0.08,
    "small_area_N_psi": 0.03,
    "small_alpha_n_per_s": 0.06,
    "small_alpha_s_per_s": 0.06,
    "wall_stiffness_N_m": 0.10,
    "wall_damping_Ns_m": 0.10,
    "mu_s": 0.05,
    "supply_positive_psi": 0.01,
    "supply_negative_psi": 0.01,
}
_KNOWN = ("head_mass_kg", "tail_mass_kg", "supply_positive_psi", "supply_negative_psi")


class SealedError(VirtualRobotError):
    """The request cannot be carried out."""


@dataclass(frozen=True)
class Label:
    """The truth of a sealed data set: the effects with their parameters, and the specimen."""

    seed: int
    kind: str
    sizes: Mapping[str, float]
    effects: Mapping[str, Mapping[str, float]]
    parameters: Mapping[str, float]


def plans() -> list[Plan]:
    """The 15 conditions of the day; each is repeated three times."""
    static = [*(("body", psi, 2) for psi in (0.0, 4.0, 8.5)), ("body", 0.0, 8), ("head", 0.0, 2), ("head", 8.5, 2)]
    steps = [("body", 6.0), ("body", 8.5), ("head", 8.5)]
    walks = {"baseline": gait.BASELINE, "easy": gait.EASY, "leisurely": gait.LEISURELY}
    size = {"body": "large", "head": "small"}
    return [
        *(
            Plan("static_loading", f"static_{size[chamber]}_{psi:g}psi_{mm_s}mm_s", chamber, psi, mm_s / 1e3)
            for chamber, psi, mm_s in static
        ),
        *(Plan("step_response", f"step_{size[chamber]}_{psi:g}psi", chamber, psi) for chamber, psi in steps),
        *(Plan("anchor_pull", f"anchor_{psi:g}psi", "head", psi, 0.020) for psi in (0.0, 5.0, 8.5)),
        *(Plan("locomotion", f"walk_{name}", gait=walk) for name, walk in walks.items()),
    ]


def specimen(random: np.random.Generator) -> tuple[dict[str, float], tuple[Curve, Curve]]:
    """Another robot of the same design: its parameters and its two stiffness curves."""
    numbers = dict(NOMINAL)
    for name, spread in _SPREAD.items():
        numbers[name] *= float(np.exp(spread * random.standard_normal()))
    numbers["mu_k"] = numbers["mu_s"] * float(random.uniform(0.80, 0.88))
    numbers["wall_offset_m"] += float(1e-4 * random.standard_normal())
    body, small = nominal_curves()
    deform = 0.04 * random.standard_normal((2, 3))
    return numbers, (body.deformed(*deform[0]), small.deformed(*deform[1]))


def draw_effects(kind: str, random: np.random.Generator) -> tuple[dict[str, dict[str, float]], dict[str, float]]:
    """Draw effects: their parameters, and for each the factor of its modest size."""
    pool, count = {"none": (LIBRARY, 0), "single": (LIBRARY, 1), "pair": (LIBRARY, 2), "outside": (OUTSIDE, 1)}[kind]
    names = [str(name) for name in random.choice(pool, count, replace=False)]
    sizes = {name: float(random.uniform(*SIZES)) for name in names}
    return {name: EFFECTS[name].at(sizes[name], random) for name in names}, sizes


def generate(
    seed: int,
    out: Path,
    kind: str = "single",
    effect: str | None = None,
    size: float | None = None,
    label_file: Path | None = None,
) -> Label:
    """Write the data set `out` and its label, which is complete before the data set appears.

    `effect` and `size` (a factor of its modest size) replace what would be drawn. Raises VirtualRobotError if `out`
    exists, or if the kind or effect is unknown.
    """
    out = Path(out)
    check_request(effect, size, seed)
    seal = seal_of(out, label_file)
    if kind not in KINDS:
        raise SealedError(f"no kind {kind!r}; there are {', '.join(KINDS)}")
    random = np.random.default_rng(seed)
    parameters, curves = specimen(random)
    effects, sizes = draw_effects(kind, random)
    if effect is not None:
        sizes = {effect: float(random.uniform(*SIZES)) if size is None else size}
        effects = {effect: EFFECTS[effect].at(sizes[effect], random)}
    lab = Lab(parameters | plant_parameters(effects), curves)
    label = Label(seed, kind, sizes, effects, parameters)
    with new_folder(out) as folder:
        write(folder, f"sealed-{seed}", lab, random)
        content = {"format": 1, **asdict(label)}
        seal.write_text(tomli_w.dumps(content))
    return label


def check_request(effect: str | None, size: float | None, seed: int) -> None:
    """Raise VirtualRobotError if the effect is unknown or has a size without being named, or if size or seed is out of
    range."""
    if effect is not None and effect not in EFFECTS:
        raise SealedError(f"no effect {effect!r}; there are {', '.join(EFFECTS)}")
    if size is not None and effect is None:
        raise SealedError("the size of a drawn effect is drawn as well; name the effect")
    check_numbers(seed, size)


def write(folder: Path, name: str, lab: Lab, random: np.random.Generator) -> None:
    """Run the day's trials in a random order and write them in the contract's format."""
    day = [(plan, repeat) for plan in plans() for repeat in range(1, REPEATS + 1)]
    order = {job: place for place, job in enumerate(random.permutation(len(day)))}
    entries = []
    for job, (plan, repeat) in enumerate(day):
        place = order[job]
        columns = lab.run(plan, place / (len(day) - 1), random)
        file = f"{plan.name}_{repeat}.csv"
        write_csv(folder / file, columns)
        entries.append({"file": file, **plan.entry(), "repeat": repeat, "session_order": int(place) + 1})
    write_head(folder, name, {key: round(lab.parameters[key], 6) for key in _KNOWN}, entries)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m virtual_robot.sealed",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True, help="folder of the data set; must not exist")
    parser.add_argument("--label", type=Path, help="file for the truth (default: OUT.sealed.toml)")
    parser.add_argument("--truth", choices=("own", "foreign"), default="own", help="whose equations (default: own)")
    parser.add_argument("--effect", help="effect, instead of a drawn one; an unknown name lists all")
    parser.add_argument("--form", help="form of the effect, instead of a drawn one (foreign only)")
    parser.add_argument("--size", type=float, help="factor of the effect's modest size, instead of a drawn one")
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--kind", choices=("one", "none", "pair", "outside"), default="one")
    for name, text in (
        ("none", "no effect"),
        ("pair", "two effects of the library"),
        ("outside", "an effect in no library"),
    ):
        kind.add_argument(f"--{name}", dest="kind", action="store_const", const=name, help=text)
    options = parser.parse_args(arguments)
    try:
        if options.effect is not None and options.kind != "one":
            raise SealedError("the effect is named, so that no kind is drawn: leave one of the two out")
        if options.truth == "foreign":
            foreign.generate(
                options.seed, options.out, options.kind, options.effect, options.size, options.form, options.label
            )
        elif options.form is not None:
            raise SealedError("--form needs --truth foreign: effects of the own truth have only one form")
        else:
            kind_of_own = {"one": "single"}.get(options.kind, options.kind)
            generate(options.seed, options.out, kind_of_own, options.effect, options.size, options.label)
    except VirtualRobotError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
