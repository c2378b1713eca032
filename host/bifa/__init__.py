"""bifa: drive a soft in-pipe robot and learn from data how it really behaves.

dataset = bifa.load_dataset("out/bench")
robot = bifa.Robot()
verdict = robot.diagnose(dataset)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bifa.version import __version__

_WHERE = {  # imported on first use, so that a command loads only what it needs
    **dict.fromkeys(("load_dataset", "Robot", "connect"), "bifa.notebook"),
    **dict.fromkeys(("Gait", "BASELINE", "load_gait", "save_gait"), "bifa.robot.gait"),
    "BifaError": "bifa.errors",
}
__all__ = ["__version__", *_WHERE]

if TYPE_CHECKING:  # the same names, for type checkers
    from bifa.errors import BifaError as BifaError
    from bifa.notebook import Robot as Robot
    from bifa.notebook import connect as connect
    from bifa.notebook import load_dataset as load_dataset
    from bifa.robot.gait import BASELINE as BASELINE
    from bifa.robot.gait import Gait as Gait
    from bifa.robot.gait import load_gait as load_gait
    from bifa.robot.gait import save_gait as save_gait


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"bifa has no {name}; it has {', '.join(_WHERE)}")
    return getattr(import_module(_WHERE[name]), name)


def __dir__() -> list[str]:
    return __all__
