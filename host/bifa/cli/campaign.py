"""`bifa campaign`: measure, fit, find what is missing, optimise, walk, compare."""

import json
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from bifa.cli._options import (
    BENCH_FILE,
    KNOWN,
    OUT,
    PROFILE,
    QUICK,
    RERUN,
    WATCH,
    Profile,
    port_option,
    requires,
    stoppable,
)
from bifa.computer import EXAMPLE_PORT
from bifa.errors import BifaError
from bifa.files import check_targets
from bifa.printable import counted
from bifa.screen import Console, Countdown

if TYPE_CHECKING:
    from bifa.measure.by_hand import ByHand
    from bifa.measure.desk import Desk


EXAMPLES = (
    "bifa campaign --port virtual --seed 3",
    "bifa campaign --quick",
    "bifa campaign --rerun diagnose",
    f"bifa campaign --port {EXAMPLE_PORT} --watch records --out out/monday",
    f"bifa campaign --port {EXAMPLE_PORT} --known head_mass_kg=0.182 --out out/monday",
)


_PROFILE: Profile = "realistic"


def campaign(
    out: Annotated[Path, OUT] = Path("out/campaign"),
    port: Annotated[str, port_option("`virtual`, a serial port, or the name of your own rig.")] = "virtual",
    seed: Annotated[
        int,
        typer.Option(
            min=0,
            help="Random seed of the searches and, with a virtual robot, of its undisclosed effect and all noise.",
        ),
    ] = 0,
    quick: Annotated[bool, QUICK] = False,
    watch: Annotated[Path | None, WATCH] = None,
    bench: Annotated[
        Path,
        typer.Option(
            help="File that declares what is known of your bench, and your instruments' formats (serial port)."
        ),
    ] = BENCH_FILE,
    known: Annotated[list[str], KNOWN] = [],  # noqa: B006
    profile: Annotated[Profile, PROFILE] = _PROFILE,
    rerun: Annotated[list[str], RERUN] = [],  # noqa: B006
) -> None:
    """Run the whole loop on a robot; a virtual robot has an undisclosed effect.

    On a serial port, your own camera and testing machine measure: the campaign tells you what to mount and start, reads
    the files that they save (in the formats declared with bifa instrument), aligns them with the Uno by the strobe,
    shows each trial, and repeats it on request. See docs/campaign.md.

    Every stage can be interrupted and resumed, even days later, and is rerun only if something that it depends on has
    changed. Only the stages that measure need the robot. Declare what you have weighed or measured yourself in the
    bench file or with --known; everything else is fitted, or kept at its nominal value if no experiment determines it.
    A virtual robot declares its masses and its supply pressure.
    """
    from bifa.campaign.stages import check_folder
    from bifa.rig import check_port, is_offered

    check_targets(None if is_offered(port) or bench.exists() else bench, folders=(out,))
    check_folder(out)
    check_port(port)
    if port != "virtual":
        requires("--port virtual", profile=profile != _PROFILE)
    if is_offered(port):
        requires("a serial port", watch=watch)

    console = Console()
    with stoppable(lambda: f"{kept_on_disk(out)}. Run the same command to resume"):
        from bifa.campaign.setup import Effort, Setup
        from bifa.measure.bench_file import load_or_ask_known, parse_known

        options = {"sealed": seed, "profile": profile} if port == "virtual" else {}
        setup = Setup(port, seed, options, parse_known(known))
        if setup.is_by_hand:
            desk, hands = at_desk(console, watch, bench)
            setup = replace(setup, known={**load_or_ask_known(bench, desk), **setup.known}, hands=hands)

        with console.status("starting"):  # slow imports, so the questions come first
            from bifa.campaign import loop
            from bifa.campaign.progress import StageProgress
            from bifa.campaign.stages import run_stages

        with closing(StageProgress(console)) as progress:
            if setup.hands is not None:
                setup.hands.before = progress.close
            stages = loop.campaign(setup, Effort(quick), progress.update)
            run_stages(out, stages, rerun=rerun, on_start=progress.start, on_end=progress.end)
    _print_summary(console, out)


def _print_summary(console: Console, out: Path) -> None:
    from bifa.campaign.page import prediction_table, speed_table
    from bifa.report.diagnosis import noise_table, verdict_sentence
    from bifa.report.terminal import plain_spaces, print_lines, print_table
    from bifa.report.words import effect_words

    summary = json.loads((out / "summary.json").read_text())
    verdict, effects = summary["verdict"], summary["effects"]
    named = "; ".join(effect_words(e["name"], e["parameters"]) for e in effects)
    said = f", {plain_spaces(named)}" if named else f". {verdict_sentence(summary)}"
    console.print(Text.assemble("verdict: ", (verdict, "bold"), said))
    if summary["truth"] is not None:
        inside = "; ".join(effect_words(name, values) for name, values in summary["truth"].items())
        print_lines(console, [f"the seal opened: {inside or 'nothing'}"])
    print_table(console, prediction_table(summary["prediction_error"]))
    print_table(console, noise_table(summary["error"]))
    print_table(console, speed_table(summary["gaits"]))
    for number, one in enumerate(summary["rounds"], 1):
        console.print(
            f"round {number}, a gait that was not fitted{', at the edge' if one['at_edge'] else ''}: "
            f"{one['predicted_mm_s']:.2f} mm/s predicted ({one['interval_90_mm_s'][0]:.2f} to "
            f"{one['interval_90_mm_s'][1]:.2f}, walks with probability {one['walks_probability']:.2f}), "
            f"{one['measured_mm_s']:.2f} ± {one['spread_mm_s']:.2f} measured"
        )
    console.print(f"report: {out / 'report.html'}", soft_wrap=True)


def at_desk(console: Console, watch: Path | None, bench: Path) -> "tuple[Desk, ByHand]":
    """Return the desk on this terminal, and the recorder for instruments worked by hand (`bifa.measure.by_hand`)."""
    from bifa.measure.bench_file import read_exports
    from bifa.measure.by_hand import ByHand
    from bifa.measure.desk import Desk

    if watch is not None and not watch.is_dir():
        raise BifaError(f"--watch: the folder {watch} does not exist; create it, and set the instruments to save there")
    plain = not console.encoding.lower().startswith("utf")
    desk = Desk(lambda text: console.print(text), watch, Countdown(console))
    exports = partial(read_exports, bench)
    exports()  # reports errors in the bench file before anything moves
    return desk, ByHand(desk, watch, plain, exports, console.width)


def kept_on_disk(out: Path) -> str:
    """Describe what an interrupted campaign has left on disk."""
    from bifa.campaign.stages import PROVENANCE, trials_in

    try:
        done = list(json.loads((out / PROVENANCE).read_text())["stages"])
    except (OSError, ValueError, KeyError):
        done = []
    trials = sum(map(trials_in, out.glob(".*-unfinished")))
    under_way = f"{counted(trials, 'trial')} of the stage under way" if trials else ""
    kept = " and ".join(part for part in (f"the stages {', '.join(done)}" if done else "", under_way) if part)
    return f"{out} keeps {kept}" if kept else "nothing has been finished yet"
