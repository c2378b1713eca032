"""lacuna: find what a model lacks. It names the missing mechanism, or reports that none is missing or that none fits.

system = lacuna.System(simulate, parameters=[...], effects=[...])
verdict = lacuna.diagnose(system, records)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lacuna.version import __version__

_WHERE = {  # imported on first use, so that importing one class does not import SciPy
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

if TYPE_CHECKING:  # the same, for type checkers
    from lacuna.diagnosis.policy import Policy as Policy
    from lacuna.errors import LacunaError as LacunaError
    from lacuna.function_system import FunctionSystem
    from lacuna.records import segments as segments
    from lacuna.records import windows as windows
    from lacuna.run import diagnose as diagnose
    from lacuna.system import CandidateExperiment as CandidateExperiment
    from lacuna.system import CorrectionSite as CorrectionSite
    from lacuna.system import Effect as Effect
    from lacuna.system import Parameter as Parameter
    from lacuna.system import Record as Record
    from lacuna.verdict import Verdict as Verdict
    from lacuna.verdict import load as load

    System = FunctionSystem


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"lacuna has no {name}; it has {', '.join(_WHERE)}")
    module, attribute = _WHERE[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return __all__
