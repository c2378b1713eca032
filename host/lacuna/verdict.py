"""A verdict as a person reads it: a line, a screen of text, a page, a figure, and the completed model to call."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.named import Estimated
from lacuna.diagnosis.record import as_record
from lacuna.errors import MisuseError
from lacuna.estimation.fit import Fit
from lacuna.estimation.structure import is_learnt
from lacuna.function_system import FunctionSystem
from lacuna.records import read, stretched
from lacuna.system import Record, System
from lacuna.values import Values


class CompletedModel:
    """The completed model, called like `simulate`: `model(record)` or `model(record, theta)`.

    `record` is anything that `diagnose` takes as one record, `theta` a mapping of values that differ from the fitted
    ones, `model.theta`. What differs from run to run (a nuisance) has its expected value, if `theta` does not say
    otherwise. Returns what `simulate` returns, of a window or a segment its own samples.
    """

    def __init__(self, system: System, fitted: Fit):
        self._system, self._theta, self._effects = system, fitted.theta, fitted.structure.effects
        self._corrections = fitted.structure.corrections(fitted.theta)
        names = [p.name for p in fitted.structure.parameters if not is_learnt(p.name)]
        self.theta = Values({name: system.told(name, fitted.theta[name]) for name in names})
        if isinstance(system, FunctionSystem):
            values = system.values(fitted.theta)
            self.theta |= {name: values[name] for name in system.held.of(self._effects)}

    def __call__(self, record: Any, theta: Mapping[str, float] | None = None) -> Any:
        system, given = self._system, dict(theta or {})
        record = _one(record, system.outputs) if isinstance(system, FunctionSystem) else record
        fitted = self._theta | {p.name: p.value for p in system.nuisances(record)}
        if not isinstance(system, FunctionSystem):
            return system.predict(fitted | given, self._effects, record, corrections=self._corrections)
        values = system.values(fitted, self._corrections)
        if unknown := set(given) - set(values):
            raise MisuseError(f"no parameter {', '.join(sorted(unknown))}; there are {', '.join(values)}.")
        if held := [name for name in given if name in system.held]:
            raise MisuseError(f"{held[0]} is fixed or tied, so it cannot be given: declare the system without that.")
        values |= given
        system.held.fill(values)
        try:
            return system.simulated(record, values)
        except KeyError as error:  # of a record, or of the model's own
            raise MisuseError(f"the model finds no {error.args[0]}.") from error

    def __repr__(self) -> str:
        return f"Model({', '.join(f'{name}={value:.4g}' for name, value in self.theta.items())})"


def _one(record: Any, outputs: tuple[str, ...]) -> Record:
    """A record, whichever form it has; outputs that it lacks have yet to be predicted."""
    given = read(record)
    if len(given) != 1:
        raise MisuseError(f"the model is called with one record, not {len(given)}: call it with each of them.")
    found = given[0]
    if isinstance(found, Record):
        return found
    return stretched(found, found.record([name for name in outputs if name in found.columns]), outputs)


class Verdict:
    """The engine's result. `verdict`: "none", "identified" or "unexplained"; `effects`: the effects named, with sizes,
    intervals and weights (`probability`); `error`: before, after and of the floor, RMS in units of the noise, on
    records that were not fitted; `warnings`; `theta`: the completed model's parameters; `model`: that model, to call;
    `nuisances`: by record, what was fitted to each. For a system of a function these three are fitted to every record,
    once the errors are known.

    `print(verdict)` shows a screen of text, `report` writes a page, `plot` draws, `to_frame` makes tables of it, `save`
    keeps it (`lacuna.load`). `record` is all of it in plain types for JSON, `diagnosis` the engine's complete result.
    """

    def __init__(self, system: System, diagnosis: Diagnosis):
        self.system, self.diagnosis = system, told(system, diagnosis)
        self.verdict, self.effects, self.warnings = diagnosis.verdict, self.diagnosis.effects, diagnosis.warnings
        fitted = diagnosis.told if isinstance(system, FunctionSystem) else diagnosis.final
        self.model = CompletedModel(system, fitted)
        self.theta = self.model.theta
        self.nuisances = _nuisances(fitted)
        self.record = as_record(self.diagnosis)
        self.error = {side: getattr(diagnosis, side).held_out for side in ("before", "after", "floor")}

    def __repr__(self) -> str:
        return repr(self.diagnosis)

    def __str__(self) -> str:
        from lacuna.report.text import screen_of

        return screen_of(self.system.name, self.record, self.diagnosis)

    def report(self, path: str | Path) -> Path:
        """Write a page (HTML, self-contained, no script) with the evidence; return its path."""
        from lacuna.report.diagnosis import diagnosis_page
        from lacuna.report.page import render

        return _written(path, render(diagnosis_page(self.system.name, self.record, self.diagnosis)))

    def to_frame(self, what: str = "parameters") -> Any:
        """A pandas DataFrame: the `parameters` of the completed model with their 90 % intervals (where a curve was
        learnt: the intervals of the explanation without it, so that a value may lie outside), or the explanations
        `compared`: by how much log-likelihood each is worse than the chosen one where nothing was fitted, the standard
        error of that, and its weight. Raises MisuseError for another word."""
        return _frame(self.record, self.theta, what)

    def save(self, path: str | Path) -> Path:
        """Write the verdict as JSON, to be read again with `lacuna.load`; return its path. The completed model is a
        function of yours with the values in `theta`."""
        kept = {"system": self.system.name, "record": self.record, "theta": dict(self.theta), "text": str(self)}
        return _written(path, json.dumps(kept, indent=1, default=float))

    def plot(self) -> Any:
        """A Matplotlib figure: error before and after, what was tried, and the worst predicted held-out records."""
        from lacuna.report.figures import overview

        return overview(self.record, self.diagnosis)


class SavedVerdict:
    """What `Verdict.save` kept: `verdict`, `record`, `theta`, `warnings`, `error`, and the screen of text."""

    def __init__(self, kept: Mapping[str, Any]):
        self.record, self.theta, self._text = kept["record"], Values(kept["theta"]), kept["text"]
        self.verdict, self.warnings = self.record["verdict"], tuple(self.record["warnings"])
        error = self.record["error"]
        sides = (("before", "before"), ("after", "after"), ("floor", "noise_floor"))
        self.error = {name: error[side]["held_out"] for name, side in sides}

    def __str__(self) -> str:
        return str(self._text)

    def __repr__(self) -> str:
        return f"<{', '.join([self.verdict, *(e['name'] for e in self.record['effects'])])}>"

    def to_frame(self, what: str = "parameters") -> Any:
        """As `Verdict.to_frame`."""
        return _frame(self.record, self.theta, what)


def load(path: str | Path) -> SavedVerdict:
    """A verdict as `Verdict.save` wrote it. Raises MisuseError where the file is none."""
    try:
        kept = json.loads(Path(path).read_text(encoding="utf-8"))
        return SavedVerdict(kept)
    except (ValueError, KeyError, TypeError) as error:
        raise MisuseError(f"{path} is no verdict that `Verdict.save` wrote.") from error


def _written(path: str | Path, text: str) -> Path:
    """`path`, once all of the text is there."""
    path = Path(path)
    unfinished = path.with_name(path.name + ".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)
    return path


def _frame(record: Mapping[str, Any], theta: Mapping[str, float], what: str) -> Any:
    import pandas

    if what == "compared":
        rows = [one | {"effects": " + ".join(one["effects"]) or "base model"} for one in record["compared"]]
        return pandas.DataFrame(rows, columns=["effects", "worse_by", "standard_error", "weight"])
    if what != "parameters":
        raise MisuseError(f'to_frame makes "parameters" or "compared", not {what!r}.')
    known = {name: one["interval_90"] for name, one in record["base_parameters"].items()}
    for effect in record["effects"]:
        known |= {f"{effect['name']}.{name}": ends for name, ends in effect["interval_90"].items()}
    rows = [
        {"parameter": name, "value": value, "lower_90": ends[0], "upper_90": ends[1]}
        for name, value in theta.items()
        for ends in [known.get(name, (math.nan, math.nan))]
    ]
    return pandas.DataFrame(rows, columns=["parameter", "value", "lower_90", "upper_90"]).set_index("parameter")


def _nuisances(fitted: Fit) -> dict[str, dict[str, float]]:
    problem, point = fitted.problem, fitted.solution.point
    found = {t.name: problem.named(i, point.nuisances[i]) for i, t in enumerate(problem.trials)}
    return {name: nuisances for name, nuisances in found.items() if nuisances}


def told(system: System, diagnosis: Diagnosis) -> Diagnosis:
    """`diagnosis` with its sizes, values and intervals in the person's own parameters."""
    if not isinstance(system, FunctionSystem):
        return diagnosis
    effects = []
    for one in diagnosis.effects:
        coordinates = {name: system.coordinate(f"{one.name}.{name}") for name in one.parameters}
        values = {name: coordinates[name].told(value) for name, value in one.parameters.items()}
        intervals = {name: coordinates[name].interval(*ends) for name, ends in one.interval.items()}
        effects.append(replace(one, parameters=values, interval=intervals))
    base = {
        name: Estimated(system.told(name, one.value), system.coordinate(name).interval(*one.interval))
        for name, one in diagnosis.base_parameters.items()
    }
    return replace(diagnosis, effects=tuple(effects), base_parameters=base)
