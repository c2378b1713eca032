"""lacuna: find what a model lacks. It names the mechanism that is missing, or says that none is, or that none fits.

system = lacuna.System(simulate, parameters=[...], effects=[...])
verdict = lacuna.diagnose(system, records)
"""

from importlib import import_module
from typing import Any

from lacuna.version import __version__

_WHERE = {  # imported when first asked for: who wants one class need not wait for SciPy
    "System": ("lacuna.function_system", "FunctionSystem"),
    "Parameter": ("lacuna.system", "Parameter"),
    "Effect": ("lacuna.system", "Effect"),
    "Record": ("lacuna.system", "Record"),
    "CorrectionSite": ("lacuna.system", "CorrectionSite"),
    "CandidateExperiment": ("lacuna.system", "CandidateExperiment"),
    "diagnose": ("lacuna.run", "diagnose"),
    "Verdict": ("lacuna.verdict", "Verdict"),
    "load": ("lacuna.verdict", "load"),
    "windows": ("lacuna.records", "windows"),
    "segments": ("lacuna.records", "segments"),
    "Policy": ("lacuna.diagnosis.policy", "Policy"),
    "LacunaError": ("lacuna.errors", "LacunaError"),
}
__all__ = ["__version__", *_WHERE]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"lacuna has no {name}; it has {', '.join(_WHERE)}")
    module, attribute = _WHERE[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return __all__
