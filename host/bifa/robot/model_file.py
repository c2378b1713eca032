"""Model files: TOML, format 1, read strictly."""

import math
import tomllib
from collections.abc import Set
from dataclasses import asdict, fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from bifa.errors import BifaError, check_range
from bifa.files import read_text, write_text
from bifa.robot.learnt import LearntCurve
from bifa.robot.model import Covariance, Model, Scatter
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameter
from bifa.robot.stiffness import StiffnessCurve
from bifa.toml import parse_toml

FORMAT = 1
_FURTHEST_M = 1.0  # of a spring: one in millimetres, which would walk as well, is outside
_MOST_SCATTER = 1e6
_EARLIER = "switch_error_s"  # in the scatter of earlier versions


class ModelFileError(BifaError):
    """A model file is invalid; the text gives file, name and range."""


def nominal() -> Model:
    """The parameter set shipped with the package, which reproduces the paper's figures."""
    springs = tomllib.loads(resources.files("bifa.robot").joinpath("nominal.toml").read_text("utf-8"))
    body, small = (_read_curve(name, springs[name]) for name in ("body", "small"))
    provenance = "Found by search: reproduces the figures that the paper reports (docs/model.md)."
    return Model("nominal", BASE_PARAMETERS, body, small, provenance=provenance)


def strong_push() -> Model:
    """A parameter set with a larger body area that also reproduces the paper's push of 150 N."""
    model = nominal().with_values({"body_area_N_psi": 12.98, "body_alpha_n_per_s": 1.6, "body_alpha_s_per_s": 0.447})
    return replace(
        model,
        name="strong push",
        body_stiffness=replace(model.body_stiffness, lower_m=-0.005916, upper_m=0.058962799999999996),
        provenance="Found by search: also pushes 150 N at 8.5 psi; area up, convergence down, travel 1.4 % less "
        "(docs/model.md).",
    )


def load_model(path: str | Path) -> Model:
    """Read a model file. Raises ModelFileError for another format, unknown or missing names, or values out of range."""
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ModelFileError(f"cannot read the model {path}: {error}") from None
    try:
        document = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise ModelFileError(f"{path} is not TOML: {error}") from None
    if (version := document.get("format", FORMAT)) != FORMAT:
        raise ModelFileError(f"{path}: format {version!r}; this version reads format {FORMAT}")
    try:
        return _build(document)
    except BifaError as error:
        raise ModelFileError(f"{path}: {error}") from None


def save_model(path: str | Path, model: Model) -> None:
    """Write a model file, from which `load_model` restores the same numbers."""
    known, scatter = model.covariance, model.scatter
    document = {
        "provenance": model.provenance,
        "parameters": {name: _entry(parameter) for name, parameter in model.parameters.items()},
        "stiffness": {"body": _curve(model.body_stiffness), "small": _curve(model.small_stiffness)},
        "effects": {name: dict(values) for name, values in model.effects.items()},
        "learnt": {
            name: {"lower": c.lower, "upper": c.upper, "values": c.values.tolist()} for name, c in model.learnt.items()
        },
        "covariance": known and {"names": list(known.names), "matrix": known.matrix.tolist()},
        "scatter": scatter and asdict(scatter),
    }
    filled = {key: value for key, value in document.items() if value}
    write_text(path, tomli_w.dumps({"format": FORMAT, "name": model.name, **filled}))


def _entry(parameter: ModelParameter) -> dict[str, Any]:
    entry = {"value": parameter.value, "unit": parameter.unit, "source": parameter.source}
    return entry if parameter.sd is None else entry | {"sd": parameter.sd}


def _curve(curve: StiffnessCurve) -> dict[str, Any]:
    return {"lower_m": curve.lower_m, "upper_m": curve.upper_m, "coefficients": list(curve.coefficients)}


def _build(document: dict[str, Any]) -> Model:
    optional = {"provenance", "effects", "learnt", "covariance", "scatter"}
    _only(document, "model", {"format", "name", "parameters", "stiffness"}, optional)
    _only(document["stiffness"], "stiffness", {"body", "small"})
    entries = document["parameters"]
    _only(entries, "parameters", set(BASE_PARAMETERS))
    effects, learnt = _tables(document, "effects"), _tables(document, "learnt")
    for name, entry in learnt.items():
        _only(entry, f"learnt.{name}", {"lower", "upper", "values"})
        try:
            _numbers(list(entry.values()))
        except TypeError:
            raise ModelFileError(f"learnt.{name} must hold numbers, its values in rows") from None
    return Model(
        name=str(document["name"]),
        parameters={name: _parameter(name, entries[name]) for name in BASE_PARAMETERS},
        body_stiffness=_read_curve("body", document["stiffness"]["body"]),
        small_stiffness=_read_curve("small", document["stiffness"]["small"]),
        effects=effects,
        learnt={name: LearntCurve(**entry) for name, entry in learnt.items()},
        covariance=_read_covariance(document["covariance"]) if "covariance" in document else None,
        provenance=str(document.get("provenance", "")),
        scatter=_read_scatter(document["scatter"]) if "scatter" in document else None,
    )


def _tables(document: dict[str, Any], key: str) -> dict[str, dict[str, Any]]:
    """The sub-tables of an optional table."""
    tables = document.get(key, {})
    if not isinstance(tables, dict) or not all(isinstance(values, dict) for values in tables.values()):
        raise ModelFileError(f"{key} must hold tables, such as [{key}.NAME]")
    return tables


def _read_covariance(entry: dict[str, Any]) -> Covariance:
    _only(entry, "covariance", {"names", "matrix"})
    names, matrix = entry["names"], entry["matrix"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ModelFileError("covariance.names must be a list of names")
    try:
        return Covariance(tuple(names), np.array(_numbers(matrix), dtype=float))
    except (TypeError, ValueError, OverflowError):
        raise ModelFileError("covariance.matrix must be a square matrix of numbers, with one row per name") from None


def _parameter(name: str, entry: dict[str, Any]) -> ModelParameter:
    base = BASE_PARAMETERS[name]
    _only(entry, f"parameters.{name}", {"value"}, {"unit", "source", "sd"})
    if entry.get("unit", base.unit) != base.unit:
        raise ModelFileError(f"parameters.{name} is in {base.unit!r}, not {entry['unit']!r}")
    sd = entry.get("sd")
    if sd is not None and not (isinstance(sd, (int, float)) and not isinstance(sd, bool) and 0 <= sd < math.inf):
        raise ModelFileError(f"parameters.{name}.sd must be a number, at least 0")
    return base.with_value(entry["value"], sd=sd, source=str(entry.get("source", base.source)))


def _read_scatter(entry: dict[str, Any]) -> Scatter:
    _only(entry, "scatter", set(), {field.name for field in fields(Scatter)} | {_EARLIER})
    numbers = {name: value for name, value in entry.items() if name != _EARLIER}
    for name, value in numbers.items():
        check_range(ModelFileError, f"scatter.{name}", value, 0.0, _MOST_SCATTER)
    return Scatter(**{name: float(value) for name, value in numbers.items()})


def _read_curve(name: str, entry: dict[str, Any]) -> StiffnessCurve:
    _only(entry, f"stiffness.{name}", {"lower_m", "upper_m", "coefficients"})
    for end in ("lower_m", "upper_m"):
        check_range(ModelFileError, f"stiffness.{name}.{end}", entry[end], -_FURTHEST_M, _FURTHEST_M, "m")
    try:
        coefficients = tuple(float(value) for value in _numbers(entry["coefficients"]))
    except (TypeError, ValueError, OverflowError):
        raise ModelFileError(f"stiffness.{name} must hold numbers") from None
    curve = StiffnessCurve(coefficients, float(entry["lower_m"]), float(entry["upper_m"]))
    curve.equilibria_m  # noqa: B018 - raises if the curve is not bistable
    return curve


def _numbers(values: Any) -> Any:
    """Return `values`, a list of numbers or of such lists. Raises TypeError if they hold anything else, such as the
    text or the truth values that float and NumPy would convert."""
    if not isinstance(values, list):
        raise TypeError
    for value in values:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            _numbers(value)
    return values


def _only(table: dict[str, Any], where: str, required: set[str], optional: Set[str] = frozenset()) -> None:
    if not isinstance(table, dict):
        raise ModelFileError(f"{where} must be a table")
    unknown = sorted(set(table) - required - optional)
    missing = sorted(required - set(table))
    if unknown or missing:
        what = f"unknown: {', '.join(unknown)}" if unknown else f"missing: {', '.join(missing)}"
        raise ModelFileError(f"{where}: {what}; allowed here are {', '.join(sorted(required | optional))}")
