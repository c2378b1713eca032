# SPDX-License-Identifier: GPL-3.0-or-later
"""The effects that the virtual bench can have, one entry each; the C plant (plant/src) implements them.

Parameter `p` of an effect is the plant's parameter `<effect>_p`. `sizes` are what the lab calls modest; a drawn effect
has a multiple of them. `drawn` are the remaining parameters, with the range that each is drawn from.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from virtual_robot.plant.parameters import PlantParameterError


@dataclass(frozen=True)
class Effect:
    """`sizes` are scaled together, `drawn` are not scaled; `signed` effects are drawn with either sign."""

    name: str
    sizes: Mapping[str, float]
    drawn: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    signed: bool = False

    def at(self, factor: float, random: np.random.Generator) -> dict[str, float]:
        """Parameters at `factor` times the modest size; the others are drawn."""
        sign = random.choice((-1.0, 1.0)) if self.signed else 1.0
        values = {name: sign * factor * size for name, size in self.sizes.items()}
        return values | {name: float(random.uniform(*span)) for name, span in self.drawn.items()}

    def defaults(self) -> dict[str, float]:
        """Parameters at the modest size, the others in the middle of their ranges."""
        return dict(self.sizes) | {name: 0.5 * (low + high) for name, (low, high) in self.drawn.items()}


_LOOP = {"displacement_m": (0.001, 0.004), "small_share": (0.18, 0.28)}
_MAXWELL = {"time_s": (2.0, 8.0), "small_share": (0.3, 0.5)}

_IN_LIBRARY = (
    Effect("hysteresis", {"force_N": 4.0}, _LOOP),
    Effect("viscoelasticity", {"stiffness_N_m": 150.0}, _MAXWELL),
    Effect("backlash", {"gap_m": 0.001}),
    Effect("area_variation", {"slope": 0.10}, signed=True),
    Effect("valve_latency", {"delay_s": 0.030}),
    Effect("valve_asymmetry", {"difference_s": 0.030}, signed=True),
    Effect("line_lag", {"time_s": 0.060}),
    Effect("choked_flow", {"saturation_s_per_psi": 0.045}, {"sharpness": (1.6, 2.6)}),
    Effect("leak", {"rate_per_s": 0.05}),
    Effect("supply_sag", {"resistance_s": 0.03}, {"vacuum_share": (0.8, 1.25)}),
    Effect("regulator_ripple", {"amplitude_psi": 0.3}, {"frequency_Hz": (0.3, 0.9)}),
    Effect("sensor_lag", {"time_s": 0.05}),
    Effect("sensor_position", {"share": 0.05}),
    Effect("sensor_calibration", {"gain": 0.03, "offset_psi": 0.2}, signed=True),
    Effect("stribeck", {"speed_m_s": 0.01}),
    Effect("friction_direction", {"asymmetry": 0.15}, signed=True),
    Effect("inclination", {"angle_deg": 10.0}, signed=True),
    Effect("tether_drag", {"drag_N_m": 2.0}),
)
_IN_NONE = (
    Effect("pipe_joint", {"rise": 0.4}, {"spacing_m": (0.08, 0.12), "width_m": (0.004, 0.008)}),
    Effect("area_drift", {"share": 0.06}, signed=True),
    Effect("mount_resonance", {"share": 1.0}, {"frequency_Hz": (6.0, 12.0), "damping": (0.03, 0.06)}),
    Effect("viscous_drag", {"Ns_m": 25.0}),
    Effect("leak_cracking", {"rate_per_s": 0.25}, {"pressure_psi": (3.0, 5.0)}),
    Effect("camera_scale", {"gain": 0.03}, signed=True),
    Effect("pump_fade", {"psi": 1.0}),
    Effect("quadratic_damping", {"Ns2_m2": 250.0}),
    Effect("sensor_crosstalk", {"share": 0.04}),
)
LIBRARY = tuple(effect.name for effect in _IN_LIBRARY)
OUTSIDE = tuple(effect.name for effect in _IN_NONE)
EFFECTS = {effect.name: effect for effect in (*_IN_LIBRARY, *_IN_NONE)}


def plant_parameters(effects: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """`{"hysteresis": {"force_N": 4.0}}` as plant parameters; those not given take their default."""
    numbers: dict[str, float] = {}
    for name, given in effects.items():
        if name not in EFFECTS:
            raise PlantParameterError(f"no effect {name!r}; there are {', '.join(EFFECTS)}")
        effect = EFFECTS[name]
        unknown = set(given) - set(effect.sizes) - set(effect.drawn)
        if unknown:
            allowed = ", ".join([*effect.sizes, *effect.drawn])
            raise PlantParameterError(f"{name} has no parameter {', '.join(sorted(unknown))}; it has {allowed}")
        for key, value in given.items():
            if not math.isfinite(value) or (value < 0.0 and not effect.signed):
                wanted = "a finite number" if effect.signed else "a finite number, not negative"
                raise PlantParameterError(f"{name}.{key} = {value:g} must be {wanted}")
        numbers |= {f"{name}_{key}": float(value) for key, value in (effect.defaults() | dict(given)).items()}
    return numbers
