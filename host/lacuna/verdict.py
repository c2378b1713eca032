"""The result as the user sees it: text, a page, figures, tables, and the completed model as a function."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.named import Estimated
from lacuna.diagnosis.record import as_record
from lacuna.errors import LacunaError, MisuseError
from lacuna.estimation.fit import Fit
from lacuna.estimation.structure import is_learnt
from lacuna.function_system import FunctionSystem
from lacuna.records import read
from lacuna.system import Record, System
from lacuna.values import Values


class CompletedModel:
    """The completed model, called like `simulate`: `model(record)` or `model(record, theta)`.

    `record` is anything that `diagnose` accepts as one record. `theta` maps parameters to values that replace the
    fitted ones, which are in `model.theta`. Nuisances have their expected values unless `theta` gives others; if these
    depend on an output that the record lacks, give them all. Returns what `simulate` returns; for a segment of a longer
    record, only the segment's own samples. If the model is a function, an unknown parameter raises MisuseError, and so
    does another value of a fixed or tied one.
    """

    def __init__(self, system: System, fitted: Fit):
        self._system, self._theta, self._effects = system, fitted.theta, fitted.structure.effects
        self._corrections = fitted.structure.corrections(fitted.theta)
        self._nuisances = {p.name for each in map(system.nuisances, fitted.problem.trials) for p in each}
        names = [p.name for p in fitted.structure.parameters if not is_learnt(p.name)]
        self.theta = Values({name: system.told(name, fitted.theta[name]) for name in names})
        if isinstance(system, FunctionSystem):
            values = system.values(fitted.theta)
            self.theta |= {name: values[name] for name in system.held.of(self._effects)}

    def __call__(self, record: Any, theta: Mapping[str, float] | None = None) -> Any:
        system, given = self._system, dict(theta or {})
        record = _one(record, system.outputs) if isinstance(system, FunctionSystem) else record
        fitted = self._theta | self._expected(record, given)
        if not isinstance(system, FunctionSystem):
            return system.predict(fitted | given, self._effects, record, corrections=self._corrections)
        values = system.values(fitted, self._corrections)
        if unknown := set(given) - set(values) - self._nuisances:
            raise MisuseError(f"no parameter {', '.join(sorted(unknown))}; there are {', '.join(values)}.")
        if held := [name for name in given if name in system.held and given[name] != values[name]]:
            raise MisuseError(f"{held[0]} is fixed or tied, so it cannot be given: declare the system without that.")
        values |= given
        system.held.fill(values)
        try:
            return system.simulated(record, values)
        except KeyError as error:  # raised by the record or by the model itself
            raise MisuseError(f"the model finds no {error.args[0]}.") from error

    def _expected(self, record: Any, given: Mapping[str, float]) -> dict[str, float]:
        """The nuisances' expected values, which may depend on an output that a record lacks; {} if all are `given`."""
        if self._nuisances <= given.keys():
            return {}
        try:
            return {p.name: p.value for p in self._system.nuisances(record)}
        except LacunaError as error:
            values = ", ".join(f'"{name}": ...' for name in sorted(self._nuisances))
            raise MisuseError(f"{str(error).rstrip('.')}. Give their values: model(record, {{{values}}}).") from error

    def __repr__(self) -> str:
        return f"Model({', '.join(f'{name}={value:.4g}' for name, value in self.theta.items())})"


def _one(record: Any, outputs: tuple[str, ...]) -> Record:
    """Read one record in any form; it need not contain the outputs, which are yet to be predicted."""
    given = read(record)
    if len(given) != 1:
        raise MisuseError(f"the model is called with one record, not {len(given)}: call it once for each.")
    found = given[0]
    if isinstance(found, Record):
        return found
    return found.record([name for name in outputs if name in found.columns])


class Verdict:
    """The result of a diagnosis.

    - `verdict`: "none", "identified" or "unexplained".
    - `effects`: the named effects, with sizes, intervals and weights (`probability`).
    - `error`: RMS error on held-out records, in units of the noise, as a dict of "before", "after" and "floor".
    - `warnings`: what to bear in mind, as sentences.
    - `theta`, `model`, `nuisances`: the completed model's parameters; that model as a function (`CompletedModel`); the
      nuisances fitted to each record. All three come from the fit that is reported: for a model given as a function, to
      every record, made after the errors were computed.
    - `record`: everything in plain types, for JSON. `diagnosis`: the engine's complete result.

    `print(verdict)` shows a screen of text, `report` writes a page, `plot` draws a figure, `to_frame` returns tables,
    and `save` writes a file that `lacuna.load` reads.
    """

    def __init__(self, system: System, diagnosis: Diagnosis):
        self.system, self.diagnosis = system, told(system, diagnosis)
        self.verdict, self.effects, self.warnings = diagnosis.verdict, self.diagnosis.effects, diagnosis.warnings
        fitted = diagnosis.told
        self.model = CompletedModel(system, fitted)
        self.theta = self.model.theta
        problem, point = fitted.problem, fitted.solution.point
        nuisances = {t.name: problem.named(i, point.nuisances[i]) for i, t in enumerate(problem.trials)}
        self.nuisances = {name: values for name, values in nuisances.items() if values}
        self.record = as_record(self.diagnosis)
        self.error = {side: getattr(diagnosis, side).held_out for side in ("before", "after", "floor")}

    def __repr__(self) -> str:
        return repr(self.diagnosis)

    def __str__(self) -> str:
        from lacuna.report.text import screen_of

        return screen_of(self.system.name, self.record, self.diagnosis)

    def report(self, path: str | Path) -> Path:
        """Write a page with the evidence (self-contained HTML without scripts) and return its path."""
        from lacuna.report.diagnosis import diagnosis_page
        from lacuna.report.page import render

        return _write(path, render(diagnosis_page(self.system.name, self.record, self.diagnosis)))

    def to_frame(self, what: str = "parameters") -> Any:
        """Return a pandas DataFrame of the "parameters" of the completed model or of the explanations "compared".

        "parameters": values and 90 % intervals. If a curve was learnt, the intervals are those of the explanation
        without it, so a value may lie outside. "compared": by how much held-out log-likelihood each explanation is
        worse than the chosen one, the standard error of that difference, and the explanation's weight. Raises
        MisuseError for any other `what`.
        """
        return _frame(self.record, self.theta, what)

    def save(self, path: str | Path) -> Path:
        """Write the verdict as JSON, to be read with `lacuna.load`, and return its path. The completed model itself is
        not saved: it is your function with the values in `theta`."""
        kept = {"system": self.system.name, "record": self.record, "theta": dict(self.theta), "text": str(self)}
        return _write(path, json.dumps(kept, indent=1, default=float))

    def plot(self) -> Any:
        """Return a Matplotlib figure: errors before and after, explanations tried, and the worst predicted held-out
        records."""
        from lacuna.report.figures import overview

        return overview(self.record, self.diagnosis)


class SavedVerdict:
    """A verdict read by `lacuna.load`: `verdict`, `record`, `theta`, `warnings`, `error`, and the screen of text."""

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
        """Return a pandas DataFrame, as `Verdict.to_frame` does."""
        return _frame(self.record, self.theta, what)


def load(path: str | Path) -> SavedVerdict:
    """Read a verdict that `Verdict.save` wrote. Raises MisuseError for any other file."""
    try:
        kept = json.loads(Path(path).read_text(encoding="utf-8"))
        return SavedVerdict(kept)
    except (ValueError, KeyError, TypeError) as error:
        raise MisuseError(f"{path} is not a verdict written by `Verdict.save`.") from error


def _write(path: str | Path, text: str) -> Path:
    """Write `text` to `path` atomically and return the path."""
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
        raise MisuseError(f'to_frame takes "parameters" or "compared", not {what!r}.')
    known = {name: one["interval_90"] for name, one in record["base_parameters"].items()}
    for effect in record["effects"]:
        known |= {f"{effect['name']}.{name}": ends for name, ends in effect["interval_90"].items()}
    rows = [
        {"parameter": name, "value": value, "lower_90": ends[0], "upper_90": ends[1]}
        for name, value in theta.items()
        for ends in [known.get(name, (math.nan, math.nan))]
    ]
    return pandas.DataFrame(rows, columns=["parameter", "value", "lower_90", "upper_90"]).set_index("parameter")


def told(system: System, diagnosis: Diagnosis) -> Diagnosis:
    """Return `diagnosis` with all sizes, values and intervals converted to the user's own parameters."""
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
