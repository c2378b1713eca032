"""`bifa experiment`: the paper's characterisation experiments on a rig, written as a data set."""

import math
import shlex
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn
from rich.table import Column

from bifa.cli._options import (
    BENCH,
    BENCH_FILE,
    KNOWN,
    PORT,
    PROFILE,
    WATCH,
    Profile,
    file_option,
    kept,
    requires,
    stoppable,
)
from bifa.computer import EXAMPLE_PORT
from bifa.files import check_targets
from bifa.printable import counted
from bifa.screen import Console, warning, words

if TYPE_CHECKING:
    from bifa.measure.plan import PlannedTrial
    from bifa.measure.session import Event
    from bifa.robot import Gait


EXAMPLES = (
    "bifa experiment all --port virtual --out out/bench",
    "bifa experiment static_loading --actuator large --pressure 0 --pressure 8 --port virtual --out out/static",
    "bifa experiment locomotion --inclination 10 --port virtual --out out/uphill",
    f"bifa experiment step_response --port {EXAMPLE_PORT} --watch records --out out/steps",
    "bifa experiment anchor_pull --instrument pull.csv --telemetry out/telemetry --pressure 0 --out out/pull",
)


NAMES = ("static_loading", "step_response", "anchor_pull", "locomotion", "all")
_USED_BY = {  # options that only some experiments use
    "actuator": ("static_loading", "step_response"),
    "rate": ("static_loading", "anchor_pull"),
    "gait": ("locomotion",),
    "cycles": ("locomotion",),
    "inclination": ("locomotion",),
}


def _check_name(text: str) -> str:
    if text not in NAMES:
        raise typer.BadParameter(f"{text!r} is not one of {', '.join(NAMES)}")
    return text


WHICH = typer.Argument(
    help=f"{', '.join(NAMES[:-1])}, or all (the paper's section IV, and walks).",
    callback=_check_name,  # a Literal would be listed as one word, which narrow terminals cannot wrap
    autocompletion=lambda: list(NAMES),
    metavar="EXPERIMENT",
)


def experiment(
    name: Annotated[str, WHICH],
    out: Annotated[Path, typer.Option(help="Folder of the data set: a new one, or that of an interrupted session.")],
    port: Annotated[str | None, PORT] = None,
    actuator: Annotated[
        Literal["large", "small"] | None, typer.Option(help="Only this actuator (static_loading, step_response).")
    ] = None,
    pressure: Annotated[list[float] | None, typer.Option(help="Pressure in psi; repeatable.")] = None,
    rate: Annotated[float | None, typer.Option(min=0.1, help="Cross-head or pull speed in mm/s.")] = None,
    gait: Annotated[
        list[Path] | None, file_option("Gait file to walk; repeatable (default: three built-in gaits).")
    ] = None,
    cycles: Annotated[int | None, typer.Option(min=1, help="Cycles of each walk; 5, or 3 with --quick.")] = None,
    inclination: Annotated[float, typer.Option(help="Pipe inclination in degrees (positive = uphill).")] = 0.0,
    repeats: Annotated[int | None, typer.Option(min=1, help="Repeats of each condition; 3, or 2 with --quick.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Quick run: fewer repeats and cycles, higher speed.")] = False,
    profile: Annotated[Profile | None, PROFILE] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Random seed of a virtual rig's noise.")] = None,
    known: Annotated[list[str], KNOWN] = [],  # noqa: B006
    watch: Annotated[Path | None, WATCH] = None,
    bench: Annotated[Path | None, BENCH] = None,
    instrument: Annotated[Path | None, file_option("Import this file of your own instrument, without a rig.")] = None,
    telemetry: Annotated[
        Path | None, typer.Option(help="The Uno's telemetry of the same trial (bifa record).", exists=True)
    ] = None,
    add: Annotated[
        bool,
        typer.Option(
            "--add", help="With --instrument: add the trial to the data set OUT as the next repeat of its condition."
        ),
    ] = False,
) -> None:
    """Run a characterisation experiment and write the measurements as a data set.

    Pressures are commanded through the real firmware and link; timed commands are executed on the Uno. The instruments
    have their own clocks, synchronised with the Uno's by its sampling strobe (D10); each trial records how well.
    On a serial port, your own instruments measure: you are told what to mount and start, trial by trial, and the
    files that they save are read as declared in bench.toml (see bifa instrument and docs/campaign.md).
    Run the same command again to resume an interrupted session. Ctrl-C leaves the valves off.
    """
    from bifa.rig import check_port

    given = {"actuator": actuator, "rate": rate, "gait": gait, "cycles": cycles, "inclination": inclination or None}
    for option, users in _USED_BY.items():
        if name not in (*users, "all"):
            requires(f"{', '.join(users)} or all", **{option: given[option]})
    if instrument is None:
        requires("--instrument", telemetry=telemetry, add=add)
    else:
        of_rig = {"port": port, "watch": watch, "profile": profile, "seed": seed}
        requires("a rig, not --instrument", **of_rig, repeats=repeats, cycles=cycles, quick=quick)
    check_targets(folders=(out,))
    check_port(port)

    from bifa.data.layout import INCLINATION_RANGE_DEG
    from bifa.data.write import refuse_existing
    from bifa.measure import plan
    from bifa.measure.bench_file import parse_known
    from bifa.ranges import RANGES
    from bifa.robot import BASELINE

    console = Console()
    if not add:
        refuse_existing(out)
    for psi in pressure or []:
        _check_within("--pressure", psi, *RANGES["pressure_psi"])
        if psi == 0.0 and name == "locomotion":
            raise typer.BadParameter("--pressure 0: at 0 psi nothing walks; give a higher pressure")
    _check_within("--inclination", inclination, *INCLINATION_RANGE_DEG, "degrees")
    if rate is not None and not math.isfinite(rate):
        raise typer.BadParameter(f"--rate must be a finite number of mm/s, not {rate:g}")
    gaits = [_load(path) for path in gait] if gait else [BASELINE, plan.BRISK, plan.AMBLE]
    trials = plan.session(
        plan.EXPERIMENTS if name == "all" else (name,),
        actuators=(actuator,) if actuator else plan.ACTUATORS,
        repeats=repeats,
        pressures_psi=pressure or None,
        rate_mm_s=rate,
        gaits=gaits,
        cycles=cycles,
        settings={"inclination_deg": inclination} if inclination else None,
        quick=quick,
    )
    if instrument is not None:
        console.print(_import(instrument, telemetry, trials, out, known, add, bench or BENCH_FILE))
        return
    options = {key: value for key, value in (("profile", profile), ("seed", seed)) if value is not None}
    with stoppable(lambda: kept(out, "finished trial")):
        _run(console, port, options, out, trials, name, parse_known(known), watch, bench)


def _check_within(option: str, value: float, low: float, high: float, unit: str) -> None:
    """Raise a usage error if `value` is out of range; typer's own ranges would accept NaN."""
    if not low <= value <= high:
        raise typer.BadParameter(f"{option} must be {low:g} to {high:g} {unit}, not {value:g}")


def _load(path: Path) -> "Gait":
    from bifa.robot.gait import read_gait_file

    file = read_gait_file(path)
    if file.others:
        raise typer.BadParameter(f"{path}: an experiment sets {', '.join(file.others)} itself; remove it from the file")
    return file.gait


def _run(
    console: Console,
    port: str | None,
    options: dict[str, Any],
    out: Path,
    trials: "Sequence[PlannedTrial]",
    name: str,
    known: dict[str, float],
    watch: Path | None,
    bench: Path | None,
) -> None:

    from bifa.cli.campaign import at_desk
    from bifa.measure.session import provenance, run_session
    from bifa.rig import open_rig

    wrapped = words("{task.description}", table_column=Column(no_wrap=False))  # on narrow terminals
    # Cycles are not part of a walk's condition, but a session can only be resumed with the same number of them.
    cycles = max(trial.cycles for trial in trials)
    errors: list[float] = []
    with open_rig(port, **options) as rig:
        hands = None
        if rig.instruments is None:
            hands = at_desk(console, watch, bench or BENCH_FILE)[1]
        else:
            requires("a rig without instruments", watch=watch, bench=bench)
        bars = Progress(wrapped, BarColumn(20), MofNCompleteColumn(), TimeRemainingColumn(), console=console)
        task = bars.add_task(name, total=len(trials))

        def on_event(event: "Event") -> None:
            bars.update(task, description=event.planned.title, completed=event.number - 1 + event.share)
            if event.trial is not None:
                errors.append(event.trial.extra["clock_error_s"])
            if event.misfit and hands is None:
                console.print(warning(event.misfit))

        with nullcontext() if hands else bars:  # a bar would redraw itself over questions and answers
            dataset = run_session(
                rig,
                out,
                trials,
                name=f"{name} on the bench",
                known={**rig.known, **known},
                provenance=provenance("bifa experiment", port, options | ({"cycles": cycles} if cycles else {})),
                record=hands,
                on_event=on_event,
            )
            bars.update(task, completed=len(trials))
    console.print(f"{out}: {counted(len(dataset.trials), 'trial')}, {len(errors)} just recorded.")
    if errors:
        console.print(
            f"Instruments and Uno synchronised to {1e3 * max(errors):.2f} ms (RMS of the edges, worst trial)."
        )
    quoted = shlex.quote(str(out))
    console.print(f"Next: bifa check {quoted}, then bifa fit {quoted} --out model.toml", soft_wrap=True)


def _import(
    instrument: Path,
    telemetry: Path | None,
    trials: "Sequence[PlannedTrial]",
    out: Path,
    known: list[str],
    add: bool,
    bench: Path,
) -> str:
    """Import a record of the only condition that the options select, which cannot be guessed; say what was imported."""
    from bifa.data.export import ROLES
    from bifa.measure.bench_file import parse_known, read_exports
    from bifa.measure.instrument_csv import import_trial

    first = [trial for trial in trials if trial.repeat == 1]
    if len(first) > 1:
        raise typer.BadParameter(
            f"--instrument imports one trial, but {len(first)} conditions match, from {first[0].title!r} to "
            f"{first[-1].title!r}: specify the experiment, --actuator, --pressure, --rate or --gait"
        )
    values = parse_known(known)
    if telemetry is None:
        raise typer.BadParameter(
            "--instrument requires --telemetry: the Uno's telemetry of the same time, from `bifa record`"
        )
    export = read_exports(bench).get(ROLES[first[0].experiment])
    dataset, clock = import_trial(instrument, telemetry, first[0], out, values, add=add, export=export)
    trial = dataset.trials[-1]
    return (
        f"{out}: {trial.file}, {len(trial.time_s)} samples; synchronised over {clock.edges} edges to "
        f"{1e3 * clock.rms_s:.2f} ms RMS, drift {1e6 * (clock.rate - 1):+.0f} ppm."
    )
