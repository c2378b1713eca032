"""Sealed data sets measured through the real firmware: the `realistic` truth.

    python -m harness.sealed_campaign --seed 7 --out ../out/seven [--kind one|none|pair|outside] [--effect NAME]

A robot is drawn as `python -m virtual_robot.sealed` draws it, and the campaign's own session measures it: the
firmware image in the simulated chip, the link, instruments with clocks of their own, profile `realistic`. Writes the
data set and, beside it, its truth in OUT.sealed.toml. An interrupted session resumes.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import tomli_w

from bifa.errors import BifaError
from bifa.files import write_text
from bifa.measure import plan
from bifa.measure.session import Event, run_session
from virtual_robot.data_folder import check_new
from virtual_robot.effects import EFFECTS
from virtual_robot.errors import VirtualRobotError
from virtual_robot.rig import open_rig
from virtual_robot.sealed import SIZES, check_request

KINDS = {"one": "single", "none": "none", "pair": "pair", "outside": "outside"}


def _shown(event: Event) -> None:
    if sys.stderr.isatty():
        print(f"\r{event.number:3d} of {event.total}  {event.planned.file:50}", end="", file=sys.stderr)


def generate(
    seed: int,
    out: Path,
    kind: str = "one",
    effect: str | None = None,
    size: float | None = None,
    label: Path | None = None,
    trials: Sequence[plan.PlannedTrial] | None = None,
    profile: str = "realistic",
) -> None:
    """Measure a sealed robot into the data set `out`, and its seal before it (default: OUT.sealed.toml).

    `effect` and `size` (a factor of its modest size) replace what would be drawn; `trials` replaces the campaign's
    session. Raises VirtualRobotError or BifaError.
    """
    forced: dict[str, dict[str, float]] = {}
    check_new(out)
    check_request(effect, size, seed)
    if effect is not None:
        random = np.random.default_rng([seed, 0xEF])
        factor = float(random.uniform(*SIZES)) if size is None else size
        forced = {effect: EFFECTS[effect].at(factor, random)}
    drawn = "none" if forced else KINDS[kind]
    with open_rig(profile=profile, seed=seed, sealed=seed, sealed_kind=drawn, effects=forced, keep_events=False) as rig:
        inside = rig.open_seal()
        sizes = {name: _factor(name, values) for name, values in inside.items()}
        content = {"format": 1, "truth": profile, "seed": seed, "kind": kind, "sizes": sizes, "effects": inside}
        content["parameters"] = rig.truth
        # before the data set, which is not measured again once it is complete
        seal = label or out.with_name(out.name + ".sealed.toml")
        seal.parent.mkdir(parents=True, exist_ok=True)
        write_text(seal, tomli_w.dumps(content))
        run_session(
            rig,
            out,
            trials or plan.session(),
            name=f"bench-{seed}",
            known=rig.known,
            provenance={"recorded_by": "harness.sealed_campaign", "port": "virtual"},
            on_event=_shown,
        )
        if sys.stderr.isatty():
            print(file=sys.stderr)


def _factor(name: str, values: dict[str, float]) -> float:
    key, modest = next(iter(EFFECTS[name].sizes.items()))
    return abs(values[key] / modest)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m harness.sealed_campaign",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True, help="folder of the data set, new or interrupted")
    parser.add_argument("--kind", choices=KINDS, default="one")
    parser.add_argument("--effect", help="effect, instead of a drawn one; an unknown name lists all")
    parser.add_argument("--size", type=float, help="factor of the effect's modest size, instead of a drawn one")
    parser.add_argument("--label", type=Path, help="file for the truth (default: OUT.sealed.toml)")
    parser.add_argument("--profile", choices=("ideal", "realistic", "worn"), default="realistic")
    parser.add_argument("--quick", action="store_true", help="fewer conditions, each twice")
    options = vars(parser.parse_args(arguments))
    trials = plan.session(quick=options.pop("quick"))
    try:
        generate(**options, trials=trials)
    except (VirtualRobotError, BifaError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
