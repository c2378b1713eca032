"""`bifa optimize`: find the gait for a real robot, from a model of it."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, TimeElapsedColumn
from rich.table import Table

from bifa import cluster
from bifa.cli._options import PICTURES, Method, file_option
from bifa.files import check_targets, named, written_into
from bifa.screen import Console, passing_bars, warning, words

if TYPE_CHECKING:
    from bifa.gait.pool import Simulations
    from bifa.gait.search import Optimum
    from bifa.robot import Model


EXAMPLES = (
    "bifa optimize --model MODEL.toml --out GAIT.toml",
    "bifa optimize --model MODEL.toml --edge --begin WALKED.toml --out GAIT.toml",
    "bifa optimize --out fast.toml --nominal --method de",
    "bifa optimize --model MODEL.toml --begin slow.toml --out GAIT.toml",
    "bifa optimize --out paper.toml --nominal --method bo --evaluations 200",
    "bifa optimize --out GAIT.toml --dask tcp://scheduler:8786",
)


def optimize(
    out: Annotated[Path, typer.Option(help="Gait file to write.", show_default=False)],
    model: Annotated[Path | None, file_option("Model file (default: the paper's nominal robot).")] = None,
    method: Annotated[Method, typer.Option(help="Search method; bo, the paper's, is slow.")] = "cma",
    robust: Annotated[
        bool,
        typer.Option("--robust/--nominal", help="Maximise the speed that 9 in 10 robots reach, or the model's own."),
    ] = True,
    edge: Annotated[
        bool,
        typer.Option("--edge", help="Maximise the mean speed, if 19 in 20 robots walk, as campaigns do."),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the search and of the sampled robots.")] = 0,
    evaluations: Annotated[
        int | None,
        typer.Option(
            min=20,
            help="Gaits to explore per run, at most; later rounds scale with it; 1000 for bo.",
            show_default=False,
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(
            min=1, max=20, help="Number of runs, each with the next seed; 3 for bo, else 1.", show_default=False
        ),
    ] = None,
    spread: Annotated[
        float | None,
        typer.Option(
            help="Relative standard deviation of every parameter (default: from the model's fit, else a guess of 0.02)."
        ),
    ] = None,
    begin: Annotated[
        list[Path] | None, file_option("Gait known to walk, used as a further start of the search; repeatable.")
    ] = None,
    period: Annotated[tuple[float, float], typer.Option(help="Range of periods to search, in s.")] = (2.0, 4.0),
    dask: Annotated[str | None, typer.Option(help=cluster.HELP)] = None,
    dask_ca: Annotated[Path | None, typer.Option(help=cluster.CA_HELP)] = None,
    dask_cert: Annotated[Path | None, typer.Option(help=cluster.CERT_HELP)] = None,
    dask_key: Annotated[Path | None, typer.Option(help=cluster.KEY_HELP)] = None,
    pictures: Annotated[Path | None, PICTURES] = None,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Do not draw pictures.")] = False,
) -> None:
    """Find the gait that maximises the settled speed, verified with a finer step.

    By default, the 10th percentile of the speed over the model's uncertainty is maximised: the fastest gait of the
    model itself may have no slip at all, and then collapses if a parameter changes by 1 %. Pictures go to a folder next
    to the gait file by default.
    """
    if edge and not robust:
        raise typer.BadParameter("choose one of --edge and --nominal", param_hint="--edge")
    folder = pictures or pictures_beside(out)
    check_targets(out, folders=() if no_pictures else (folder,), inputs=(model, *(begin or ())))

    console = Console()
    with ExitStack() as stack:
        with console.status("starting"):
            from bifa.gait import Settings, optimize, paper_space, simulations
            from bifa.gait.library.scenarios import provenance
            from bifa.robot import load_gait, load_model, nominal, save_gait

            robot = load_model(model) if model else nominal()
            space = paper_space(period_s=period)
            known = tuple(load_gait(file) for file in begin or ())
            refine = method != "bo"
            first = Settings(method, robust, seed, evaluations, spread, space, refine=refine, at_edge=edge, begin=known)
            settings = [replace(first, seed=seed + run) for run in range(runs or (1 if refine else 3))]
            tls = cluster.Tls(dask_ca, dask_cert, dask_key)
            pool = stack.enter_context(simulations(dask, tls=tls))
        optima = []
        for one in settings:
            with search_progress(console) as progress:
                found = optimize(robot, pool, one, progress(f"seed {one.seed}"))
            optima.append(found)
            best = max(optima, key=lambda o: o.quantile_mm_s if robust else o.nominal_mm_s)
            # before anything is printed: output that nobody reads must not lose it
            save_gait(out, best.gait, provenance(best, robot.name, "bifa optimize"))
            low = "mean of those that walk" if edge else "10th percentile"
            reached = found.quantile_mm_s if edge else found.percentile_10_mm_s
            console.print(
                f"seed {one.seed}: {found.nominal_mm_s:.2f} mm/s on the model, {low} {reached:.2f} mm/s; "
                f"{found.evaluations} gaits, {found.simulations} simulations"
            )
            if found.doubt:
                console.print(warning(str(found.doubt)))
        if not no_pictures:
            what = "pictures: what changed and why, sensitivity, front, distribution"
            with console.status(what), written_into(folder) as aside:
                reasons = draw_pictures(robot, pool, best, aside)
        console.print(_summary(best))
        console.print(f"gait: {out}")
        if no_pictures:
            return
        for sentence in reasons:
            console.print(f"- {sentence}")
        console.print(f"pictures: {folder}")


def pictures_beside(out: Path) -> Path:
    """Folder for the pictures: the gait file's name without suffix, unless that is the file itself or a data set."""
    out = named(out)
    folder = out.with_suffix("")
    taken = folder == out or (folder / "dataset.toml").exists()
    return out.with_name(f"{folder.name}-pictures") if taken else folder


@contextmanager
def search_progress(console: Console) -> Iterator[Callable[[str], Callable[[str, float, float], None]]]:
    """Show progress bars; yields a function that adds one by its title and returns the callback for `optimize`."""
    columns = (words("{task.description}"), BarColumn(), TimeElapsedColumn(), words("{task.fields[best]}"))
    with passing_bars(console, *columns) as progress:

        def begin(title: str) -> Callable[[str, float, float], None]:
            task = progress.add_task(title, total=1.0, best="")

            def report(stage: str, share: float, best: float) -> None:
                progress.update(task, description=f"{title}: {stage}", completed=share, best=f"best {best:.2f} mm/s")

            return report

        yield begin


def _summary(optimum: "Optimum") -> Table:
    import numpy as np

    from bifa.report.words import gait_parameter_words

    table = Table(title="The gait", title_justify="left", show_header=False)
    for name, value in optimum.gait.as_dict().items():
        table.add_row(gait_parameter_words(name), f"{value:.4f}")
    speeds = optimum.speeds_mm_s
    table.add_row("speed on the model, 20 cycles, fine step", f"{optimum.nominal_mm_s:.2f} mm/s")
    if optimum.settings.at_edge:
        table.add_row(optimum.settings.aim, f"{optimum.quantile_mm_s:.2f} mm/s")
    for share in (5, 10, 50, 90):
        table.add_row(f"{share}th percentile of {speeds.size} robots", f"{np.percentile(speeds, share):.2f} mm/s")
    lost = float(np.mean(speeds < 0.5 * optimum.nominal_mm_s))
    table.add_row("robots that lose over half the speed", f"{100 * lost:.1f} %")
    table.add_row("predicted, 90 %", optimum.prediction.text)
    table.add_row("uncertainty", optimum.spread.text)
    return table


def draw_pictures(robot: "Model", pool: "Simulations", optimum: "Optimum", folder: Path) -> list[str]:
    from bifa.gait import Settings, library, optimize
    from bifa.gait.explain import anatomy, reasons
    from bifa.gait.objectives import distribution
    from bifa.gait.prediction import FINE_M
    from bifa.gait.search import SearchRun
    from bifa.gait.sensitivity import front, sensitivity
    from bifa.report.gaits import distribution_chart, front_chart, sensitivity_chart
    from bifa.report.picture import draw_chart
    from bifa.report.walks import SIMULATED, Walk, draw_walks
    from bifa.robot import BASELINE
    from bifa.simulate import gait_rows, plant

    flat, settings = plant(robot), optimum.settings
    # The same robots as in the verification: near a cliff, other robots would give different results.
    robots = SearchRun(robot, pool, optimum.spread, settings).verifying_robots()
    metric = replace(settings.rules, tolerance_m=FINE_M)
    before, after = anatomy(robot, BASELINE), anatomy(robot, optimum.gait)
    walks = [
        Walk(f"{title}: {one.speed_mm_s:.1f} mm/s", one.gait.period_s, {SIMULATED: one.record.columns})
        for title, one in (("baseline", before), ("optimised", after))
    ]
    draw_walks(walks, folder / "changes.png")
    scans = sensitivity(pool, flat, robots[:24], optimum.gait, metric)
    draw_chart(sensitivity_chart(scans), folder / "sensitivity.png")
    if settings.robust:
        robust = optimum.gait
        quick = Settings(
            robust=False, seed=settings.seed, evaluations=1500, spread=settings.spread, space=settings.space
        )
        fast = optimize(robot, pool, quick).gait
        other = {"fastest on the model": fast}
    else:
        robust, fast = library.load("robust").gait, optimum.gait
        other = {"the library's robust gait": robust}
    found = front(pool, flat, robots[:48], robust, fast, metric)
    draw_chart(front_chart(found, (optimum.nominal_mm_s, optimum.percentile_10_mm_s)), folder / "front.png")
    shown = {"baseline": BASELINE, **other}
    speeds = distribution(pool, robots, gait_rows(list(shown.values())), metric)
    draw_chart(distribution_chart(optimum, dict(zip(shown, speeds, strict=True))), folder / "distribution.png")
    return reasons(before, after)
