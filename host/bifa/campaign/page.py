"""The report of a campaign: the answer first, then the evidence."""

from collections.abc import Mapping, Sequence

from bifa.report.animation import animate_walk
from bifa.report.residuals import draw_residuals
from bifa.report.robustness import draw_robustness
from bifa.report.walks import Walk, draw_walks
from lacuna.report.diagnosis import verdict_sentence
from lacuna.report.evidence import draw_errors, draw_probabilities
from lacuna.report.page import Page, Section, Table, both_palettes

GAIT_NAMES = {
    "baseline": "baseline",
    "base": "from the base model",
    "completed": "from the completed model",
}


def campaign_page(summary: Mapping, diagnosis: Mapping, traces: Sequence[Mapping], walks: Sequence[Walk]) -> Page:
    """The page of a campaign; summary, diagnosis and traces as in summary.json, diagnosis.json and residuals.json."""
    return Page(
        "What this robot does that the paper's model does not",
        _lead(summary),
        _facts(summary, diagnosis),
        [_walking(walks), _lacking(summary, diagnosis, traces), _gaits(summary, walks)],
        "Made by bifa campaign.",
    )


def _facts(summary: Mapping, diagnosis: Mapping) -> list[tuple[str, str]]:
    gaits = {gait["gait"]: gait for gait in summary["gaits"]}
    error = diagnosis["error"]
    return [
        (f"{gaits['baseline']['measured']:.1f} mm/s", "baseline gait, measured"),
        (f"{gaits['base']['measured']:.1f} mm/s", "gait from the base model, measured"),
        (f"{gaits['completed']['measured']:.1f} mm/s", "gait from the completed model, measured"),
        (
            f"{error['before']['held_out']:.1f} → {error['after']['held_out']:.2f}",
            "error on held-out trials, in units of the noise",
        ),
    ]


def _walking(walks: Sequence[Walk]) -> Section:
    return Section(
        "The robot, walking",
        ["The gait from the completed model, as the motion capture saw it."],
        svg=animate_walk(
            walks[-1].measured, 3 * walks[-1].period_s, "The robot walks with the gait from the completed model"
        ),
    )


def _lacking(summary: Mapping, diagnosis: Mapping, traces: Sequence[Mapping]) -> Section:
    error = diagnosis["error"]
    return Section(
        "What the base model lacks",
        _evidence(summary, diagnosis),
        figures=[
            both_palettes(
                lambda stream, dark: draw_errors(error, stream, dark),
                "Error before and after per experiment, on a logarithmic axis",
                "Residual of each experiment before and after the effect was added, against the noise floor.",
            ),
            both_palettes(
                lambda stream, dark: draw_residuals(traces, stream, dark),
                "Residual over time in each condition, before and after",
                "Where the residual lives: held-out trials, in standard deviations of the noise.",
            ),
            *_probabilities(diagnosis),
        ],
        tables=[*_opened(summary), prediction_table(summary["prediction_error"]), error_table(error)],
    )


def _gaits(summary: Mapping, walks: Sequence[Walk]) -> Section:
    return Section(
        "The gaits",
        ["Commands to the three chambers, measured pressures, and displacement."],
        tables=[speed_table(summary["gaits"])],
        figures=[
            both_palettes(
                lambda stream, dark: draw_walks(walks, stream, dark=dark),
                "CPG outputs, pressures and displacement of the gaits side by side",
                "In the manner of the paper's Fig. 7; dashed: predicted by the completed model.",
            ),
            both_palettes(
                lambda stream, dark: draw_robustness(summary["robustness"], GAIT_NAMES, stream, dark),
                "Speed of each gait on robots that differ slightly from this one",
                "Robustness of each gait: its speed on 256 robots whose parameters vary by 2 % (one sd).",
            ),
        ],
    )


def speed_table(gaits: Sequence[Mapping]) -> Table:
    """Predicted and measured speeds of the gaits."""
    rows = [
        [
            GAIT_NAMES[gait["gait"]],
            f"{gait['base_model']:.2f}",
            f"{gait['completed_model']:.2f}",
            f"{gait['measured']:.2f} ± {gait['spread']:.2f}",
            f"{gait['paper']:.1f}",
        ]
        for gait in gaits
    ]
    columns = ["gait", "base model predicts", "completed model predicts", "measured", "paper"]
    return Table(columns, rows, "Settled speed in mm/s; measured: mean and spread of the repeats.", len(rows) - 1)


def prediction_table(errors: Sequence[Mapping]) -> Table:
    """Errors before and after in the units of the instruments, of fitted and held-out trials, against the floor."""
    rows = [
        [
            "{} in {}, {}".format(*error["quantity"].rsplit("_", 1), error["trials"]),
            *(f"{error[side]:.3f}" for side in ("before", "after", "noise_floor")),
        ]
        for error in errors
    ]
    return Table(["trials", "base model", "completed model", "noise floor"], rows, "RMS error of prediction.")


def error_table(error: Mapping) -> Table:
    """Errors before and after, of fitted and held-out trials and by experiment, against the floor."""
    sides = ("before", "after")
    labels = {"fitted": "fitted", "held_out": "not fitted", "held_out_conditions": "conditions not fitted"}
    rows = [
        [label, *(f"{error[s][what]:.2f}" for s in (*sides, "noise_floor"))]
        for what, label in labels.items()
        if error["before"].get(what) is not None
    ]
    for name in error["before"]["by_experiment"]:
        rows.append([name.replace("_", " "), *(f"{error[s]['by_experiment'][name]:.2f}" for s in sides), ""])
    return Table(["trials", "base model", "completed model", "noise floor"], rows, f"{error['unit']}.", 1)


def _opened(summary: Mapping) -> list[Table]:
    """The verdict beside what the seal held, where there is one."""
    if summary["truth"] is None:
        return []
    named = {effect["name"]: effect["parameters"] for effect in summary["effects"]}
    rows = []
    for effect in sorted({*named, *summary["truth"]}):
        found, true = named.get(effect, {}), summary["truth"].get(effect, {})
        for parameter in dict.fromkeys([*found, *true]):
            values = (f"{side[parameter]:.3g}" if parameter in side else "" for side in (found, true))
            rows.append([f"{effect}: {parameter}".replace("_", " "), *values])
    rows = rows or [["no effect", "", ""]]
    return [Table(["", "found", "in the seal"], rows, "The seal, opened after the verdict.")]


def _lead(summary: Mapping) -> str:
    return verdict_sentence(summary["verdict"], summary["effects"], summary["remainder"])


def _evidence(summary: Mapping, diagnosis: Mapping) -> list[str]:
    left = [f"What these leave: {diagnosis['remainder']['text']}"] if summary["effects"] else []
    return [diagnosis["signature"]["text"], *_named(summary["effects"]), *left, *_rejected(diagnosis)]


def _named(effects: Sequence[Mapping]) -> list[str]:
    named = []
    for effect in effects:
        values = ", ".join(f"{name} = {value:.3g}" for name, value in effect["parameters"].items())
        named.append(
            f"{effect['name'].replace('_', ' ')}: {values}; closes {100 * effect['share_of_gap']:.0f} % of the gap; "
            f"probability {effect['probability']:.2f}."
        )
    return named


def _rejected(diagnosis: Mapping) -> list[str]:
    """What else was tried, and which experiment decided between what was confusable."""
    said = []
    tried = [t for t in diagnosis["tried"] if t["effects"] != [e["name"] for e in diagnosis["effects"]]]
    if tried:
        listed = "; ".join(f"{' + '.join(t['effects']) or 'nothing'} {t['error']:.2f}" for t in tried[:4])
        said.append(f"Also fitted, with the error on the fitted trials: {listed}.".replace("_", " "))
    for experiment in diagnosis.get("separated_by", []):
        settings = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in experiment["settings"].items())
        said.append(
            f"To separate {' and '.join(experiment['separates'])}, the rig ran {experiment['experiment']} "
            f"({settings}).".replace("_", " ")
        )
    return said


def _probabilities(diagnosis: Mapping) -> list:
    if not diagnosis["effects"]:
        return []
    return [
        both_palettes(
            lambda stream, dark: draw_probabilities(diagnosis["effects"], stream, dark),
            "Probability of each effect named",
        )
    ]
