"""Results of a campaign with a made-up robot, for tests of pages: nothing is simulated."""

import json
import re
from dataclasses import replace

import numpy as np

from bifa.campaign.page import campaign_page
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series
from bifa.report.evidence import BASE, COMPLETED
from bifa.report.page import ChartedSection
from bifa.report.walks import MEASURED, Walk
from bifa.robot import nominal, save_model
from bifa.robot.gait import BASELINE, Gait, save_gait

EFFECT = {
    "name": "hysteresis",
    "form": "as in the library",
    "parameters": {"force_N": 4.399, "displacement_m": 0.002744, "small_share": 0.242},
    "interval_90": {"force_N": [4.39, 4.408], "displacement_m": [0.002614, 0.002874], "small_share": [0.2397, 0.2442]},
    "probability": 0.97,
    "share_of_gap": 0.9989,
    "confusable_with": ["viscoelasticity"],
}


def _error(fitted, held_out, conditions, **by_experiment):
    return {"fitted": fitted, "held_out": held_out, "held_out_conditions": conditions, "by_experiment": by_experiment}


ERROR = {
    "before": _error(21.3, 20.8, 21.0, static_loading=27.3, step_response=11.5, anchor_pull=0.97, locomotion=5.5),
    "after": _error(1.02, 1.05, 1.08, static_loading=1.0, step_response=1.01, anchor_pull=0.97, locomotion=1.1),
    "noise_floor": _error(1.0, 1.0, 1.0),
}
CURVE = {
    "term": "rate of a chamber's pressure, eq. (2)",
    "unit": "psi/s",
    "variable": "pressure (psi)",
    "lower": -14.5,
    "upper": 14.5,
    "rows": {"filling": [0.0, 0.2, 0.5, 0.1, -0.3], "emptying": [0.1, 0.0, -0.2, -0.6, -0.8]},
}
DIAGNOSIS = {
    "verdict": "identified",
    "effects": [EFFECT],
    "remainder": {
        "matters": False,
        "share_of_gap": 0.001,
        "times_floor": 0.6,
        "text": "Repeats share a residual that the model does not explain: pressure_body_psi in locomotion (0.6 x the "
        "floor).",
    },
    "base_parameters": {
        "mu_k": {"value": 0.3812, "interval_90": [0.3795, 0.3829]},
        "wall_damping_Ns_m": {"value": 20.0, "interval_90": [None, None]},
        "body_shape_1": {"value": 0.1, "interval_90": [0.0, 0.2]},
    },
    "nearest": [
        {"effects": ["sensor_position"], "share_of_gap": 0.018},
        {"effects": ["valve_asymmetry", "line_lag"], "share_of_gap": 0.045},
    ],
    "warnings": ["head_segment_mass_kg = 0.1946 kg lies outside its plausible range."],
    "error": ERROR,
    "signature": {
        "text": "Repeats share a residual that the model does not explain: force_N in static_loading (15.1 x the floor)"
        ", as in static_large_0psi_2mm_s_1.csv.",
    },
    "learnt": [CURVE],
    "not_detectable_here": ["inclination", "tether_drag"],
    "next_experiment": {
        "separates": ["hysteresis", "viscoelasticity"],
        "experiment": "static_loading",
        "settings": {"actuator": "large", "pressure_psi": 0.0, "rate_mm_s": 0.5},
    },
}
PREDICTION_ERRORS = [
    {"quantity": quantity, "trials": trials, "before": before, "after": after, "noise_floor": floor}
    for quantity, before, after, floor in (
        ("displacement_mm", 0.4814, 0.09753, 0.09546),
        ("pressure_psi", 0.1549, 0.02785, 0.02154),
        ("force_N", 3.113, 0.1963, 0.159),
    )
    for trials in ("fitted", "held-out")
]
LABELS = {"static_large_0psi_2mm_s_1.csv": "static loading, large, 0 psi, 2 mm/s (run 1)"}
_GAIT = Gait(2.8, 204.5, 331.7, 0.6535, 0.44, 0.4).as_dict()
ROUNDS = [
    {
        "effects": ["hysteresis"],
        "gait": _GAIT,
        "predicted_mm_s": 21.4,
        "at_edge": False,
        "interval_90_mm_s": [21.30, 21.50],
        "walks_probability": 0.97,
        "inside": False,
        "measured_mm_s": 20.6,
        "spread_mm_s": 0.01,
        "error_mm": 2.31,
        "floor_mm": 0.104,
        "ended": None,
    },
    {
        "effects": ["hysteresis", "valve_latency"],
        "gait": _GAIT | {"period_s": 2.61},
        "predicted_mm_s": 20.87,
        "at_edge": True,
        "interval_90_mm_s": [20.77, 20.97],
        "walks_probability": 0.97,
        "inside": True,
        "measured_mm_s": 20.88,
        "spread_mm_s": 0.02,
        "error_mm": 0.117,
        "floor_mm": None,
        "ended": "predicted",
    },
]
_GAITS = (("baseline", 5.7, 8.0, 10.8), ("base", 2.9, 20.4, 23.3), ("completed", 2.8, 20.6, 23.3))


def text_of(html):
    """The text of a page that a reader sees."""
    shown = re.sub(r"<(script|style|title)\b.*?</\1>", " ", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", shown)).replace("\N{NO-BREAK SPACE}", " ")


def columns(period_s, cycles=14, speed_mm_s=10.0):
    """Columns of a walk."""
    time_s = np.arange(0, cycles * period_s, 0.02)
    phase = 2 * np.pi * time_s / period_s
    record = {
        "time_s": time_s,
        "displacement_head_mm": speed_mm_s * time_s + 5 * np.sin(phase),
        "displacement_tail_mm": speed_mm_s * time_s - 5 * np.sin(phase),
    }
    for lag, chamber in enumerate(("body", "head", "tail")):
        command = (np.sin(phase - lag) > 0).astype(float)
        record |= {f"command_{chamber}": command, f"pressure_{chamber}_psi": 20 * command - 12}
    return record


def walks():
    """One walk of each gait; the base model is 2 % slow."""
    found = {}
    for name, period_s, speed, _ in _GAITS:
        true, slow = (columns(period_s, speed_mm_s=share * speed) for share in (1.0, 0.98))
        found[name] = Walk(f"{name} gait", period_s, {MEASURED: true, COMPLETED: true, BASE: slow})
    return found


def traces():
    """Residuals of three conditions."""
    conditions = (
        ("static loading, small, 0 psi, 2 mm/s", "force_N", 5.0),
        ("static loading, large, 0 psi, 2 mm/s", "force_N", 20.0),
        ("walk, period 5.7 s", "pressure_body_psi", 8.0),
    )
    time_s = np.linspace(0, 20, 300)
    return [
        {
            "trial": f"{n}.csv",
            "label": label,
            "experiment": label.split(",")[0].replace(" ", "_"),
            "channel": channel,
            "time_s": time_s.tolist(),
            "before": (size * np.sin(time_s)).tolist(),
            "after": np.cos(9 * time_s).tolist(),
        }
        for n, (label, channel, size) in enumerate(conditions)
    ]


def curves():
    """A static loading at 8.5 psi, measured and modelled: its displacement and its numbers are no round ones."""
    x = np.concatenate([np.linspace(-0.3, 30.2, 300), np.linspace(30.2, -0.3, 300)])
    over, measured, base = Axis("displacement, mm"), 8.48 + 0.22 * np.sin(40 * x), np.full(x.size, 8.5)
    both = [Series(("measured",), x, measured, "measured"), Series((BASE,), x, base, "before", "dashed")]
    off = [Series((BASE,), np.abs(x), measured - base, "before")]
    panels = [Panel(both, over, Axis("pressure, psi")), Panel(off, over, Axis("error, psi"), height=0.55)]
    keys = [Key("measured", "measured"), Key(BASE, "before", "dashed")]
    chart = Chart([Column(panels, "static loading, small, 8.5 psi, 2 mm/s")] * 3, keys, "measured and modelled")
    return ChartedSection("Static loading", charts=[chart])


def summary(sealed=True):
    """The content of summary.json; of 256 robots that differ a little, 59 % do not walk with the baseline."""
    return {
        "gaits": [
            {
                "gait": name,
                "base_model": 0.98 * speed,
                "completed_model": speed,
                "measured": speed,
                "spread": 0.01,
                "paper": paper,
                "settled_cycles": 15,
                "interval_90_mm_s": [0.99 * speed, 1.01 * speed],
                "walks_probability": 0.97,
            }
            for name, _, speed, paper in _GAITS
        ],
        "verdict": DIAGNOSIS["verdict"],
        "effects": DIAGNOSIS["effects"],
        "remainder": DIAGNOSIS["remainder"],
        "error": ERROR,
        "prediction_error": PREDICTION_ERRORS,
        "rounds": ROUNDS,
        "robustness": {
            "baseline": [0.0] * 151 + np.linspace(3, 11, 105).tolist(),
            "base": [0.0] * 10 + np.linspace(20.2, 20.6, 246).tolist(),
            "completed": np.linspace(20.3, 20.7, 256).tolist(),
        },
        "truth": {"hysteresis": {"force_N": 4.419, "displacement_m": 0.00294, "small_share": 0.2415}}
        if sealed
        else None,
    }


def page(sealed=True):
    """The campaign's page."""
    made = [("measured", "2026-11-21"), ("command", "bifa campaign --port virtual --seed 0"), ("seed", "0")]
    return campaign_page(summary(sealed), DIAGNOSIS, traces(), walks(), LABELS, "virtual robot 0", made)


def finished(folder, area_N_psi=9.0, effects=None):
    """The folder of a finished campaign, as `bifa campaign` leaves it."""
    folder.mkdir(parents=True)
    told = summary()
    if effects is not None:
        told |= {"effects": effects, "verdict": "unexplained"}
    (folder / "summary.json").write_text(json.dumps(told))
    model = nominal()
    area = model.parameters["body_area_N_psi"].with_value(area_N_psi, sd=0.01)
    model = replace(model, parameters={**model.parameters, "body_area_N_psi": area})
    for which in ("base", "completed"):
        save_model(folder / f"model-{which}.toml", model)
        save_gait(folder / f"gait-{which}.toml", BASELINE, {})
    return folder
