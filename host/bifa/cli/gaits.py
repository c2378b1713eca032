"""`bifa gaits`: list the library of gaits, or recompute it."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from bifa.cli._options import file_option, gait_names, requires, stoppable
from bifa.files import check_targets
from bifa.screen import Console

EXAMPLES = ("bifa gaits", "bifa gaits --make", "bifa gaits --make --model mine.toml --out my-gaits")


def gaits(
    make: Annotated[bool, typer.Option("--make", help="Rerun the searches (minutes) and write the gaits.")] = False,
    model: Annotated[Path | None, file_option("Model to search on (default: the nominal one).")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder that --make writes to (default: the package itself).")
    ] = None,
    only: Annotated[
        list[str], typer.Option(help="Only this gait; repeatable.", metavar="GAIT", autocompletion=gait_names)
    ] = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(min=0, help="Random seed of the searches (default: 0).")] = None,
) -> None:
    """List the library's gaits, with predicted speeds and files for `bifa upload`, or recompute them."""
    from bifa.gait import library

    console = Console()
    names = [library.checked(name) for name in only] or list(library.NAMES)
    if make:
        if out is None:
            requires("--out", model=model)  # the package's gaits are the nominal robot's
        folder = out or library.FOLDER
        check_targets(folders=(folder,))
        with stoppable(lambda: f"the gaits listed above are in {folder}", moves=False):
            _make(console, model, folder, names, seed or 0)
        return
    requires("--make", model=model, out=out, seed=seed)
    title = "Gaits of the nominal robot: mm/s; head, tail ahead; vacuum of body, head, tail"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for heading in ("gait", "speed", "9 in 10", "period, s", "ahead, °", "vacuum"):
        table.add_column(heading, no_wrap=heading != "vacuum")  # wraps on narrow terminals
    for name in names:
        entry = library.load(name)
        gait, notes = entry.gait, entry.provenance
        table.add_row(
            name,
            f"{notes['predicted_speed_mm_s']:.1f}",
            f"{notes['predicted_10th_percentile_mm_s']:.1f}",
            f"{gait.period_s:.2f}",
            f"{gait.psi12_deg:.0f}, {gait.psi13_deg:.0f}",
            f"{gait.duty_body:.2f}, {gait.duty_head:.2f}, {gait.duty_tail:.2f}",
        )
    console.print(table)
    for name in names:
        console.print(f"{name}: {library.load(name).purpose}")
    console.print(f"files: {library.FOLDER / 'NAME.toml'}", soft_wrap=True)


def _make(console: Console, model_path: Path | None, folder: Path, names: list[str], seed: int) -> None:
    from bifa.cli.optimize import search_progress
    from bifa.gait import optimize, simulations
    from bifa.gait.library import scenarios
    from bifa.robot import load_model, nominal

    model = load_model(model_path) if model_path else nominal()
    folder.mkdir(parents=True, exist_ok=True)
    with simulations() as runs, search_progress(console) as progress:
        for scenario in map(scenarios.SCENARIOS.__getitem__, names):
            settings = replace(scenario.settings, seed=seed)
            optimum = optimize(model, runs, settings, progress(scenario.name))
            path = scenarios.save(folder, scenario, optimum, model.name)
            console.print(
                f"{scenario.name}: {optimum.nominal_mm_s:.2f} mm/s, 10th percentile {optimum.percentile_10_mm_s:.2f} "
                f"({optimum.simulations} simulations): {path.name}"
            )
