"""The C parts under AddressSanitizer and UBSan have no stray access, undefined behaviour or leak."""

import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from virtual_robot.build import PARTS
from virtual_robot.effects import EFFECTS, plant_parameters
from virtual_robot.plant import NOMINAL, nominal_curves
from virtual_robot.rig import FIRMWARE
from virtual_robot.truths.foreign import effects
from virtual_robot.truths.foreign.robot import draw_robot

pytestmark = [pytest.mark.soak, pytest.mark.uno]
HERE = Path(__file__).parent / "sanitized"
MODEST = 0.5


def initializer(value: Any) -> str:
    """C initializer of a number, a sequence, or a struct given by field names."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'.{name} = {initializer(field)}' for name, field in value.items())}}}"
    return f"{{{', '.join(map(initializer, value))}}}" if np.ndim(value) or isinstance(value, list) else f"{value}"


def foreign_robots() -> list[dict[str, Any]]:
    """Robots with all effects at once; as many as are needed to cover every form of each effect."""
    random, forms = np.random.default_rng(1), [list(effect.forms.values()) for effect in effects.EFFECTS.values()]
    robots = [draw_robot(random) for _ in range(max(map(len, forms)))]
    for number, robot in enumerate(robots):
        for of_effect in forms:
            robot |= of_effect[number % len(of_effect)](MODEST, random).robot
    return robots


def constants() -> str:
    """Contents of robots.h, which main.c includes."""
    found = {"PlantParameters PLANT": NOMINAL | plant_parameters({name: {} for name in EFFECTS})}
    for name, curve in zip(("BODY", "SMALL"), nominal_curves(), strict=True):
        found |= {f"double {name}_FORCE_N[]": curve.force_N, f"double {name}_FIRST_M": curve.first_m}
        found |= {f"double {name}_STEP_M": curve.step_m}
    found["ForeignRobot FOREIGN[]"] = foreign_robots()
    return "".join(f"static const {name} = {initializer(value)};\n" for name, value in found.items())


def test_nothing_is_found(tmp_path):
    (tmp_path / "robots.h").write_text(constants())
    sources = [path for part in PARTS for path in part.sources()]
    folders = [f"-I{tmp_path}", *(f"-I{part.folder}" for part in PARTS)]
    folders += [f"-I{i}" for part in PARTS for i in part.include]
    libraries = [f"-l{name}" for part in PARTS for name in part.libraries]
    program = tmp_path / "sanitized"
    flags = ["-g", "-O1", "-std=gnu11", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run(["gcc", *flags, *folders, HERE / "main.c", *sources, *libraries, "-o", program], check=True)
    suppressions = tmp_path / "libsimavr"  # which never frees the names of its signals
    suppressions.write_text("leak:libsimavr\n")
    environment = os.environ | {"LSAN_OPTIONS": f"suppressions={suppressions}"}
    found = subprocess.run([program, FIRMWARE], env=environment, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
