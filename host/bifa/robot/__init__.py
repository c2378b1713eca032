"""The robot of the paper: parameters, stiffness, model files, gaits and the CPG (sections III and V.A)."""

from bifa.robot.gait import BASELINE, Gait, GaitError, GaitFile, load_gait, read_gait_file, save_gait
from bifa.robot.model import Covariance, Model
from bifa.robot.model_file import ModelFileError, load_model, nominal, save_model, strong_push
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameterError
from bifa.robot.stiffness import StiffnessCurve

__all__ = [
    "BASELINE",
    "BASE_PARAMETERS",
    "Covariance",
    "Gait",
    "GaitError",
    "GaitFile",
    "Model",
    "ModelFileError",
    "ModelParameterError",
    "StiffnessCurve",
    "load_gait",
    "load_model",
    "nominal",
    "read_gait_file",
    "save_gait",
    "save_model",
    "strong_push",
]
