"""What the format allows: experiments, their columns, their keys and ranges (docs/data-format.md)."""

from dataclasses import dataclass

FORMAT = 1
TABLE_FILE = "dataset.toml"
ACTUATORS = ("large", "small")
DIRECTIONS = ("forward", "backward")

PRESSURE_RANGE_PSI = (-15.0, 15.0)  # the sensor's span, Honeywell ABP...015PD: +-15 psi

# The gait's six parameters and the coupling, with the ranges that the firmware accepts.
GAIT_RANGES: dict[str, tuple[float, float]] = {
    "period_s": (0.5, 60.0),
    "psi12_deg": (0.0, 360.0),
    "psi13_deg": (0.0, 360.0),
    "duty_body": (0.0, 1.0),
    "duty_head": (0.0, 1.0),
    "duty_tail": (0.0, 1.0),
}
GAIT_OPTIONAL_RANGES: dict[str, tuple[float, float]] = {"coupling_per_s": (0.0, 20.0)}


@dataclass(frozen=True)
class Layout:
    """Columns and keys of one experiment.

    `required` and `optional` are keys of a `[[trial]]` beside those that every trial has.
    """

    columns: tuple[str, ...]
    optional_columns: tuple[str, ...]
    rate_hz: float
    required: tuple[str, ...]
    optional: tuple[str, ...] = ()

    @property
    def all_columns(self) -> tuple[str, ...]:
        """Every column that a file of this experiment may have."""
        return self.columns + self.optional_columns


EXPERIMENTS: dict[str, Layout] = {
    "static_loading": Layout(
        columns=("time_s", "displacement_mm", "force_N", "pressure_psi"),
        optional_columns=(),
        rate_hz=50.0,
        required=("actuator", "pressure_psi", "rate_mm_s"),
    ),
    "step_response": Layout(
        columns=("time_s", "command", "displacement_mm", "pressure_psi"),
        optional_columns=(),
        rate_hz=100.0,
        required=("actuator", "pressure_psi"),
    ),
    "anchor_pull": Layout(
        columns=("time_s", "displacement_mm", "force_N", "pressure_psi"),
        optional_columns=(),
        rate_hz=50.0,
        required=("pressure_psi", "rate_mm_s"),
        optional=("load_cell_N_m", "direction"),
    ),
    "locomotion": Layout(
        columns=(
            "time_s",
            "command_body",
            "command_head",
            "command_tail",
            "displacement_head_mm",
            "pressure_body_psi",
            "pressure_head_psi",
            "pressure_tail_psi",
        ),
        optional_columns=("displacement_tail_mm",),
        rate_hz=100.0,
        required=("gait",),
        optional=("pressure_psi", "inclination_deg"),
    ),
}

# Settings of a single trial that are not fields of their own; they live in Trial.extra.
SETTINGS = ("load_cell_N_m", "inclination_deg", "direction")


def is_command(column: str) -> bool:
    """Whether a column holds a valve command (1 positive, 0 vacuum)."""
    return column == "command" or column.startswith("command_")
