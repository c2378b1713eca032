"""Definition of the format: experiments with their columns, keys and ranges (docs/data-format.md)."""

from dataclasses import dataclass

from bifa.ranges import CHAMBERS

FORMAT = 1
TABLE_FILE = "dataset.toml"
RAW = "raw"  # folder in a data set for unchanged copies of the instruments' files

INCLINATION_RANGE_DEG = (-90.0, 90.0)
PRESSURE_RANGE_PSI = (-15.0, 15.0)  # the sensor's span, Honeywell ABP...015PD: +-15 psi
# Settings of a trial that are one of some words, and those within a range.
CHOICES = {"actuator": ("large", "small"), "direction": ("forward", "backward")}
LIMITS = {"pressure_psi": PRESSURE_RANGE_PSI, "inclination_deg": INCLINATION_RANGE_DEG}

# Parameters of a trial's gait, required and optional.
GAIT = ("period_s", "psi12_deg", "psi13_deg", "duty_body", "duty_head", "duty_tail")
GAIT_OPTIONAL = ("coupling_per_s",)


@dataclass(frozen=True)
class Layout:
    """Columns and keys of one experiment.

    `required` and `optional` are keys of a `[[trial]]` in addition to those that every trial has.
    """

    columns: tuple[str, ...]
    rate_hz: float
    required: tuple[str, ...]
    optional: tuple[str, ...] = ()
    optional_columns: tuple[str, ...] = ()

    @property
    def all_columns(self) -> tuple[str, ...]:
        """All columns that a file of this experiment may have."""
        return self.columns + self.optional_columns


EXPERIMENTS: dict[str, Layout] = {
    "static_loading": Layout(
        columns=("time_s", "displacement_mm", "force_N", "pressure_psi"),
        rate_hz=50.0,
        required=("actuator", "pressure_psi", "rate_mm_s"),
    ),
    "step_response": Layout(
        columns=("time_s", "command", "displacement_mm", "pressure_psi"),
        rate_hz=100.0,
        required=("actuator", "pressure_psi"),
    ),
    "anchor_pull": Layout(
        columns=("time_s", "displacement_mm", "force_N", "pressure_psi"),
        rate_hz=50.0,
        required=("pressure_psi", "rate_mm_s"),
        optional=("load_cell_N_m", "direction"),
    ),
    "locomotion": Layout(
        columns=(
            "time_s",
            *(f"command_{chamber}" for chamber in CHAMBERS),
            "displacement_head_mm",
            *(f"pressure_{chamber}_psi" for chamber in CHAMBERS),
        ),
        optional_columns=("displacement_tail_mm",),
        rate_hz=100.0,
        required=("gait",),
        optional=("pressure_psi", "inclination_deg"),
    ),
}

# Settings of a single trial that are not fields of their own; they live in Trial.extra.
SETTINGS = ("load_cell_N_m", "inclination_deg", "direction")

# Notes that fits use, with their allowed ranges. A clock outside its range is considered broken.
NOTED = {
    "set_point_psi": PRESSURE_RANGE_PSI,
    "extended_psi": PRESSURE_RANGE_PSI,
    "switch_error_s": (0.0, 0.1),
    "command_age_s": (-0.1, 0.1),
    "gait_ahead_s": (0.0, 0.1),
    "tick_s": (0.0, 0.1),
    "averaged_s": (0.0, 0.01),
    "clock_rate": (0.9, 1.1),
    "dead_time_s": (0.0, 0.1),
}


def is_command(column: str) -> bool:
    """Whether a column holds a valve command (1 positive, 0 vacuum)."""
    return column == "command" or column.startswith("command_")
