# SPDX-License-Identifier: GPL-3.0-or-later
"""The nominal robot, and profiles: how far the simulated bench departs from the paper's equations."""

from virtual_robot.errors import VirtualRobotError


class PlantParameterError(VirtualRobotError, ValueError):
    """A parameter or effect that the plant does not have."""


# Displacements are counted from the contracted stable state, so the wall is 0.10 mm nearer than for a curve
# whose polynomial crosses zero there.
NOMINAL: dict[str, float] = {
    "head_mass_kg": 0.175,
    "tail_mass_kg": 0.175,
    "head_segment_mass_kg": 0.1,
    "body_damping_Ns_m": 130.0,
    "body_area_N_psi": 9.0,
    "body_alpha_n_per_s": 2.0,
    "body_alpha_s_per_s": 0.575,
    "small_mass_kg": 0.015,
    "small_damping_Ns_m": 15.0,
    "small_area_N_psi": 3.2021838525,
    "small_alpha_n_per_s": 2.3,
    "small_alpha_s_per_s": 0.8,
    "wall_offset_m": 0.0277054056,
    "wall_stiffness_N_m": 8000.0,
    "wall_damping_Ns_m": 20.0,
    "mu_s": 0.45,
    "mu_k": 0.38,
    "supply_positive_psi": 8.5,
    "supply_negative_psi": -13.0,
    "load_cell_N_m": 5000.0,
    "friction_factor": 1.0,
}

# A robot after years of use, beyond the paper's equations in several ways at once: ISO 6358 flow, MHE3 switching times
# (data sheet: about 2 ms both ways), an ITV1050 that needs 0.15 s and hunts, the hysteresis loop of the paper's Fig. 5,
# and a sensor at the end of a tube.
_WORN: dict[str, float] = {
    "iso6358_share": 1.0,
    "iso6358_critical_ratio": 0.35,
    "valve_opening_s": 0.0023,
    "valve_closing_s": 0.0028,
    "regulator_time_s": 0.15,
    "regulator_ripple_amplitude_psi": 0.12,
    "regulator_ripple_frequency_Hz": 0.7,
    "hysteresis_force_N": 2.0,
    "hysteresis_displacement_m": 0.002,
    "hysteresis_small_share": 0.225,
    "sensor_lag_time_s": 0.008,
    "sensor_calibration_offset_psi": 0.05,
}
# Departures of the plant. "realistic" keeps the paper's equations: its realism is in instruments and clocks (rig.py),
# so a robot without an effect has no model error.
_PROFILES = {"ideal": {}, "realistic": {}, "worn": _WORN}


def profile(name: str) -> dict[str, float]:
    """Plant parameters of a profile, "ideal", "realistic" or "worn"; parameters not listed are 0."""
    if name not in _PROFILES:
        raise PlantParameterError(f"no profile {name!r}; there are {', '.join(_PROFILES)}")
    return NOMINAL | _PROFILES[name]
