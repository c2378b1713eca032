"""`bifa simulate`: simulate a walk, or compare the model with the paper's figures."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from bifa.cli._options import PICTURES, Obstacle, file_option, requires
from bifa.files import check_targets, written, written_into
from bifa.screen import Console

if TYPE_CHECKING:
    import numpy as np

    from bifa.robot import Gait, Model
    from bifa.simulate import Advance
    from bifa.simulate.passing import Passing


_CYCLES, _BUCKLING_N = 10, 27.0

_RED = ("red", "red")
EXAMPLES = (
    "bifa simulate",
    "bifa simulate --model fitted.toml --gait fast.toml --pictures out/walk",
    "bifa simulate --inclination 90 --payload 0.1",
    "bifa simulate --obstacle tunnel --gait fast.toml",
    "bifa simulate --paper",
)


def simulate(
    model: Annotated[Path | None, file_option("Model file (default: the nominal model).")] = None,
    gait: Annotated[Path | None, file_option("Gait file (default: the paper's baseline).")] = None,
    cycles: Annotated[int, typer.Option(min=1, max=1000, help="Cycles to walk, from rest.")] = _CYCLES,
    inclination: Annotated[
        float, typer.Option(help="Pipe inclination in degrees (positive = uphill).", min=-90, max=90)
    ] = 0.0,
    payload: Annotated[float, typer.Option(help="Payload towed by the tail, in kg.", min=0.0)] = 0.0,
    obstacle: Annotated[
        Obstacle | None,
        typer.Option(help="Obstacle from the paper, placed 10 cm ahead.", show_default=False),
    ] = None,
    buckling: Annotated[
        float | None,
        typer.Option(
            help=f"Force in N that buckles a ring of supports under an --obstacle (default: {_BUCKLING_N:g}, assumed)."
        ),
    ] = None,
    pictures: Annotated[Path | None, PICTURES] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write all channels at 100 Hz as CSV, like a data set's walk.")
    ] = None,
    paper: Annotated[
        bool,
        typer.Option(
            "--paper",
            help="Compare the model with the paper's figures and obstacles; --gait names the model's fastest gait.",
        ),
    ] = False,
) -> None:
    """Simulate a walk and print the advance of each cycle; --pictures plots commands, pressures and displacement.

    Effects in the model file (`bifa diagnose` adds them) act here as they did in the data.
    """
    walks = (cycles, inclination, payload, obstacle, buckling, pictures, out)
    if paper and walks != (_CYCLES, 0.0, 0.0, None, None, None, None):
        raise typer.BadParameter("--paper simulates its own walks; only --model and --gait can be combined with it")
    if not obstacle:
        requires("--obstacle", buckling=buckling)

    check_targets(out, folders=(pictures,), inputs=(model, gait))

    from bifa import robot

    console = Console()
    chosen = robot.load_model(model) if model else robot.nominal()
    file = robot.read_gait_file(gait) if gait else robot.GaitFile(robot.BASELINE)
    if file.others:
        console.print(
            f"not simulated: {', '.join(file.others)} (for the Uno only; the model has its own supply pressure)"
        )
    if paper:
        _print_paper(console, chosen if model or gait else None, file.gait if gait else None)
        return
    chosen = chosen.with_values({"tail_mass_kg": chosen["tail_mass_kg"] + payload})
    with console.status("simulating"):
        import numpy as np

        from bifa.simulate import SimulationError, Supports, gait_rows, obstacles, speeds, terrain, walk
        from bifa.simulate.passing import passing

        ahead = obstacles(obstacle) if obstacle else ()
        supports = Supports(_BUCKLING_N if buckling is None else buckling)
        place: dict[str, Any] = {"inclination_deg": inclination}
        if ahead:
            place["terrain"] = terrain(ahead, supports)
        record = walk(chosen, file.gait, cycles, **place)
        progress = speeds(chosen, gait_rows([file.gait]), cycles, 1e-6, **place)
    if not (np.isfinite(record["displacement_head_mm"]).all() and np.isfinite(progress.advance_m).all()):
        raise SimulationError(f"{chosen.name} cannot be simulated: a curve or a value is unlike any robot's")
    if out:
        write_csv(out, record.columns)
    if pictures:
        from bifa.report.walks import SIMULATED, Walk, draw_walks

        title = f"{chosen.name}, {progress.speed_mm_s[0]:.1f} mm/s"
        with written_into(pictures) as aside:
            draw_walks([Walk(title, file.gait.period_s, {SIMULATED: record.columns})], aside / "walk.png")
    _print_walk(console, chosen, file.gait, progress)
    if ahead:
        _print_passing(console, passing(chosen, file.gait, ahead, supports, inclination))
    if not (obstacle or inclination):
        from bifa.gait import predict_speed, spread_of

        known = spread_of(chosen)
        with console.status("predicting"):
            prediction = predict_speed(chosen, known, file.gait)
        console.print(f"predicted, 90 %: {prediction.text}")
        console.print(f"what is known: {known.text}")
    if out:
        console.print(f"channels: {out}")
    if pictures:
        console.print(f"picture: {pictures / 'walk.png'}")


def _print_walk(console: Console, model: "Model", gait: "Gait", progress: "Advance") -> None:
    from bifa.gait.settling import MIN_CYCLES, settling

    table = Table(title=f"{model.name}, period {gait.period_s:g} s", title_justify="left")
    for heading in ("cycle", "advance [mm]", "slip [mm]", "speed [mm/s]"):
        table.add_column(heading, justify="right")
    for k, (advance, slip) in enumerate(zip(progress.advance_m[0], progress.slip_m[0], strict=True)):
        table.add_row(str(k + 1), f"{1e3 * advance:.2f}", f"{1e3 * slip:.3f}", f"{1e3 * advance / gait.period_s:.2f}")
    console.print(table)
    console.print(f"speed of the last cycle: {progress.speed_mm_s[0]:.2f} mm/s")
    found = settling(1e3 * progress.advance_m[0])
    if found.is_settled:
        console.print(f"settled from cycle {found.begins + 1} on")
    elif found.cycles < MIN_CYCLES:
        console.print("too few cycles to tell whether it settles; try more --cycles")
    else:
        console.print(f"not settled: the last {found.cycles} cycles vary by {found.varies:.1%}; try more --cycles")


def _print_passing(console: Console, outcome: "Passing") -> None:
    from bifa.simulate.passing import LONGEST_S

    said = f"through after {outcome.seconds:.0f} s" if outcome.through else f"not through in {LONGEST_S:.0f} s"
    console.print(said)
    for name, end, stroke in (("extension", "head", outcome.extension), ("contraction", "tail", outcome.contraction)):
        console.print(
            f"{name}: the body's pressure builds up {stroke.built_up_N:.0f} N before the next command; the spring's "
            f"peak and the {end}'s supports need {stroke.needed_N:.0f} N{'' if stroke.enough else ': not enough'}"
        )


def _print_paper(console: Console, model: "Model | None", gait: "Gait | None") -> None:
    """Compare both shipped models with their fastest gaits, or one model and gait, with the paper's figures and its
    section VI.B: which gaits pass an obstacle, and which strokes build up too little force."""
    from bifa import robot

    with console.status("simulating every experiment"):
        from bifa.simulate.paper import FAST, FAST_STRONG, compare, obstacle_rows

        pairs = [(model, gait or FAST)] if model else [(robot.nominal(), FAST), (robot.strong_push(), FAST_STRONG)]
        tables = [compare(*pair) for pair in pairs]
    headings = ("", "paper", *(chosen.name for chosen, _ in pairs), "remark on the first")
    title = Text.assemble("The paper and the model; ", _RED, ": they disagree")
    table = Table(*headings, title=title, title_justify="left")
    for rows in zip(*tables, strict=True):
        shown = (Text(row.ours, "" if row.fits else "red") for row in rows)
        table.add_row(rows[0].what, rows[0].paper, *shown, rows[0].remark)
    console.print(table)
    for chosen, fast in pairs:
        title = Text.assemble(
            f"Obstacles, {chosen.name}: force in N that a stroke builds up / needs; ", _RED, ": not enough"
        )
        table = Table("obstacle", "gait", "through", "extension", "contraction", title=title, title_justify="left")
        for obstacle, which, outcome in obstacle_rows(chosen, fast):
            through = Text(f"{outcome.seconds:.0f} s") if outcome.through else Text("no", "red")
            strokes = (outcome.extension, outcome.contraction)
            forces = (Text(f"{s.built_up_N:.0f} / {s.needed_N:.0f}", "" if s.enough else "red") for s in strokes)
            table.add_row(obstacle, which, through, *forces)
        console.print(table)


def write_csv(path: Path, columns: "Mapping[str, np.ndarray]") -> None:
    """Write columns, arrays of shape (n,), by name."""
    import numpy as np

    rows = np.column_stack(list(columns.values()))
    with written(path) as aside:
        np.savetxt(aside, rows, "%.9g", delimiter=",", header=",".join(columns), comments="")
