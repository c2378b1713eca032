"""`bifa instrument`: declare the format of an instrument's files, proposed from one of them and confirmed by you."""

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bifa.cli._options import BENCH_FILE
from bifa.errors import BifaError
from bifa.files import check_targets
from bifa.screen import Console

if TYPE_CHECKING:
    from bifa.data.export import Export
    from bifa.measure.propose import Look

EXAMPLES = (
    "bifa instrument export.csv",
    "bifa instrument trial.TRA --role machine",
    "bifa instrument take.csv --role camera --bench monday.toml",
    "bifa instrument --presets",
)
_ROLES = ["machine", "camera"]
_MAX_PLOTS = 8


def instrument(
    file: Annotated[
        Path | None,
        typer.Argument(help="A file that the instrument exported.", show_default=False, exists=True, dir_okay=False),
    ] = None,
    role: Annotated[str | None, typer.Option(help="machine or camera (default: you are asked).")] = None,
    bench: Annotated[Path, typer.Option(help="File to write the declaration to.")] = BENCH_FILE,
    presets: Annotated[bool, typer.Option("--presets", help="List the programs whose formats are known.")] = False,
) -> None:
    """Inspect a file exported by an instrument, and declare its format.

    Shows the column names, the first rows, the row of units and a small plot of each of the first eight columns,
    proposes what each column is, and asks. The declaration is checked by reading the file, and written into the bench
    file, where `bifa campaign` and `bifa experiment` look for it. Nothing is declared without asking you.
    """
    from bifa.data.export import presets as known

    console = Console()
    if presets:
        for name, preset in known().items():
            console.print(f"{name:16} {preset['program']}")
        return
    if file is None:
        raise typer.BadParameter("give a file that your instrument exported, or use --presets")
    if role is not None and role not in _ROLES:
        raise typer.BadParameter(f"--role must be machine or camera, not {role}")

    from bifa.measure.bench_file import add_table, read_exports
    from bifa.measure.propose import declaration, look

    check_targets(bench, inputs=(file,))
    seen = look(file)
    _show(console, file, seen)
    while role not in _ROLES:
        if role is not None:
            typer.echo(f"answer one of {', '.join(_ROLES)}")
        role = typer.prompt(f"Which instrument wrote it? ({', '.join(_ROLES)})")
    if role in read_exports(bench):
        raise BifaError(
            f"{bench} already declares [instrument.{role}]: remove that table first, or name another --bench"
        )
    table = _ask_declaration(console, seen, role)
    text = declaration(role, table)
    console.print(f"\n{text}")  # before it is checked, so that the answers are not lost if that fails
    _verify(console, file, role, table)
    if typer.confirm(f"Write this into {bench}?", default=False):
        add_table(bench, text)
        console.print(f"written: {bench}")


def _show(console: Console, file: Path, seen: "Look") -> None:
    """Show what was found in the file: format, names, units, rows, plots."""
    import numpy as np

    from bifa.data.errors import DatasetError
    from bifa.measure.text_plot import panel
    from bifa.report.page import PageTable
    from bifa.report.terminal import print_table

    plain = not console.encoding.lower().startswith("utf")
    how = ", ".join(f"{key} {value!r}" for key, value in seen.how.items())
    how = how or "comma-separated, decimal points, names in the first line"
    console.print(f"{file}: {how}; {len(seen.sheet)} rows from line {seen.sheet.line(0)} on")
    for role, name in seen.presets.items():
        console.print(f"As the file of a {role}, it matches the preset {name}.")
    labels, units = seen.sheet.labels(), map(" ".join, seen.sheet.units)
    rows = [[label, unit, *row] for label, unit, row in zip(labels, units, zip(*seen.rows(), strict=True), strict=True)]
    print_table(console, PageTable(["column", "units row", *["row"] * len(seen.rows())], rows, ""))
    for place, label in list(enumerate(labels))[:_MAX_PLOTS]:
        try:
            values = seen.sheet.numbers(place, label)
        except DatasetError as error:
            console.print(f"{label}: {error}")
            continue
        known = np.flatnonzero(np.isfinite(values))
        if len(known) > 1:
            for line in panel(known.astype(float), values[known], "row", label, plain, console.width):
                console.print(line)


def _ask_declaration(console: Console, seen: "Look", role: str) -> dict[str, Any]:
    """Ask for the declaration, question by question; Enter accepts the proposal in brackets."""
    from bifa.data.export import units_for
    from bifa.measure.propose import parsed, wanted

    preset = seen.presets.get(role)
    if preset and not typer.confirm(f"Use the preset {preset}?", default=True):
        preset, seen = None, replace(seen, sheet=seen.without_preset)
    given = parsed(role, seen.by_preset(role)) if preset else None
    columns: dict[str, str] = {}
    units: dict[str, str] = {}
    more: dict[str, Any] = {}
    changes: dict[str, dict[str, float]] = {"factor": {}, "sign": {}}
    for name in [*wanted(role), *(["displacement_tail_mm"] if role == "camera" else [])]:
        proposed = given.columns.get(name) if given else None
        if not (proposed and seen.sheet.has(proposed)):
            proposed = seen.guess(name) if name != "displacement_tail_mm" else None  # it would be the head's again
        if name != "time_s":
            proposed = proposed or "-"
        column = _column(console, seen, name, proposed)
        if column == "-":
            continue
        columns[name] = column
        first = column.split(" + ")[0]
        stated, told = seen.stated(first), seen.unit(name, first)
        if stated and not told:
            console.print(f"The file says {stated!r} for {column!r}, which is none of the units.")
        elif given:
            told = told or given.units.get(name)
        units[name], scale = _unit(column, units_for(name), told, name == "time_s")
        changes["factor"] |= {name: scale} if scale is not None else {}
        if name != "time_s" and typer.confirm(f"Reverse the sign of {name}?", default=False):
            changes["sign"][name] = -1
        more |= _clock(units[name], given) if name == "time_s" else {}
    table: dict[str, Any] = seen.by_preset(role) if preset else dict(seen.how)
    if not given or any(given.columns.get(n) != c or given.units.get(n) != units[n] for n, c in columns.items()):
        table |= {"columns": columns, "units": units}
    table |= {key: value for key, value in more.items() if not given or getattr(given, key) != value}
    return table | {key: chosen for key, chosen in changes.items() if chosen} | _sync(console, seen)


def _column(console: Console, seen: "Look", name: str, proposed: str | None) -> str:
    while True:
        optional = "" if name == "time_s" else " (- if there is none)"
        column = typer.prompt(f"Which column is {name}{optional}?", default=proposed)
        if column == "-" and optional:
            return column
        if all(_is_there(console, seen, part) for part in column.split(" + ")):
            return column


def _is_there(console: Console, seen: "Look", column: str) -> bool:
    """Whether the export has the column; prints an error if it has not."""
    from bifa.data.errors import DatasetError
    from bifa.data.export import ROW_NUMBER

    try:
        if column != ROW_NUMBER:
            seen.sheet.find(column)
    except DatasetError as error:
        console.print(str(error))
        return False
    return True


def _unit(column: str, allowed: list[str], told: str | None, is_time: bool) -> tuple[str, float | None]:
    """Ask for a column's unit, or the factor by which a signal in another one, such as volts, comes in the first."""
    from lacuna.decimals import number

    other = "" if is_time else f"; or a number, how many {allowed[0]} one of the file's is"
    while True:
        answer = typer.prompt(f"What is the unit of {column!r}? ({', '.join(allowed)}{other})", default=told)
        if answer in allowed:
            return answer, None
        if other and 0.0 < abs(scale := number(answer) or 0.0) < math.inf:
            return allowed[0], scale
        typer.echo(f"answer one of {', '.join(allowed)}{other}")


def _clock(unit: str, given: "Export | None") -> dict[str, Any]:
    """Ask for what else is needed to read times given as frames or dates."""
    if unit == "frame":
        return {"rate_hz": typer.prompt("Frames per second?", default=given.rate_hz if given else None, type=float)}
    if unit != "date":
        return {}
    form = typer.prompt("Date format (strptime; Enter: ISO 8601)?", default="", show_default=False)
    zone = typer.prompt("Time zone, if the dates include none (e.g. Europe/Berlin; Enter: UTC)?", default="UTC")
    return ({"date_format": form} if form else {}) | ({"zone": zone} if zone != "UTC" else {})


def _sync(console: Console, seen: "Look") -> dict[str, Any]:
    """Ask where the strobe's edges are recorded."""
    while True:
        answer = typer.prompt(
            "Where is the strobe (D10) recorded? file: its edges are in a file beside this one; frames: it triggered "
            "every row as a frame; or the name of the column that sampled it",
            default="file",
        )
        if answer == "file":
            return {}
        if answer == "frames":
            return {"sync": "frames"}
        if _is_there(console, seen, answer):
            return {
                "sync": {
                    "column": answer,
                    "threshold": typer.prompt("Threshold above which it is high?", default=2.5, type=float),
                }
            }


def _verify(console: Console, file: Path, role: str, table: dict[str, Any]) -> None:
    """Read the file as declared, and print what it contains; raises DatasetError if that fails."""
    import numpy as np

    from bifa.data.export import read_export, refuse_falling
    from bifa.measure.propose import parsed, wanted

    export = parsed(role, table)
    named = table.get("columns", export.columns)
    columns, sheet, rows = read_export(file, export, [n for n in wanted(role) if n in named])
    refuse_falling(columns["time_s"], sheet, rows, export)
    step_s = float(np.median(np.diff(columns["time_s"]))) if len(rows) > 1 else np.nan
    console.print(f"\nRead as declared: {len(rows)} rows, one every {1e3 * step_s:.3g} ms.")
    for name, values in columns.items():
        known = values[np.isfinite(values)]
        gaps = len(values) - len(known)
        told = f"{known.min():.6g} to {known.max():.6g}" if len(known) else "no values"
        console.print(f"  {name}: {told}{f', {gaps} empty' if gaps else ''}")
