"""Priors for quantities that were not measured and that the experiments hardly determine.

The moving mass on a stand is not the robot's, and the load cell and the wall are not the nominal ones. Fixed at a wrong
value, they lead to false discoveries (a stand's mass of 0.05 kg where the model has 0.175 leaves 0.6 floors in the
pressure of every step response). Left free, they stall the fit, since hardly anything depends on them. Each therefore
has a prior around its nominal value, unless `[known]` declares its value.
"""

from lacuna.system import Parameter

# Standard deviation of the prior around the model's value, for parameters that [known] may declare.
PRIOR_SD = {
    "head_mass_kg": 0.02,
    "tail_mass_kg": 0.02,
    "head_segment_mass_kg": 0.02,
    "small_mass_kg": 0.005,
    "wall_stiffness_N_m": 2500.0,
    "wall_damping_Ns_m": 10.0,
}

STAND_MASS, LOAD_CELL = "stand_mass_kg", "load_cell_N_m"

# Parameters of the bench, not of the robot.
BENCH = {
    STAND_MASS: Parameter(
        STAND_MASS,
        "kg",
        0.175,
        0.005,
        0.5,
        plausible=(0.02, 0.25),
        scale=0.05,
        source="half the robot's mass; on a stand, the large actuator moves whatever is mounted on it",
        prior_sd=0.1,
    ),
    LOAD_CELL: Parameter(
        LOAD_CELL,
        "N/m",
        5000.0,
        500.0,
        50_000.0,
        plausible=(3000.0, 8000.0),
        scale=500.0,
        source="about 5000 N/m unless the data set says otherwise",
        prior_sd=500.0,
    ),
}
