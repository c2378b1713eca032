"""bifa: drive a soft in-pipe robot and learn from data how it really behaves.

dataset = bifa.load_dataset("out/bench")
robot = bifa.Robot()
verdict = robot.diagnose(dataset)
"""

from importlib import import_module
from typing import Any

from bifa.version import __version__

_WHERE = {  # imported when first asked for: a command waits only for what it uses
    "load_dataset": ("bifa.notebook", "load_dataset"),
    "Robot": ("bifa.notebook", "Robot"),
    "connect": ("bifa.notebook", "connect"),
    "Gait": ("bifa.robot.gait", "Gait"),
    "BASELINE": ("bifa.robot.gait", "BASELINE"),
    "load_gait": ("bifa.robot.gait", "load_gait"),
    "save_gait": ("bifa.robot.gait", "save_gait"),
    "BifaError": ("bifa.errors", "BifaError"),
}
__all__ = ["__version__", *_WHERE]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"bifa has no {name}; it has {', '.join(_WHERE)}")
    module, attribute = _WHERE[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return __all__
