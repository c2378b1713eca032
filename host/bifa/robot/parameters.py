"""The model's named values: unit, bounds and source of each (paper, sections III and IV).

The paper has no table of identified parameters. A value whose source says "found to reproduce" comes from a search for
values that reproduce every figure that the paper reports (docs/model.md, `bifa simulate --paper`).
The paper's symbols, with their equations: m_h, m_t (4), m_h of a pull (7); m, b, b_b (1); a (2); alpha_n, alpha_s (3);
x_w, k_w, b_w (8); mu_s, mu_k (5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from bifa.errors import BifaError, check_range


class ModelParameterError(BifaError):
    """A parameter's name, bounds or value is wrong; the text gives the name and the range."""


@dataclass(frozen=True)
class ModelParameter:
    """One value of the model in SI units (pressures in psi, as everywhere in the paper).

    `lower` and `upper` bound the values that can be simulated and fitted; `plausible` is the range expected of an
    intact robot; `sd` is the standard deviation from a fit (None: not fitted).
    """

    name: str
    value: float
    unit: str
    lower: float
    upper: float
    plausible: tuple[float, float]
    meaning: str
    source: str
    sd: float | None = None

    def with_value(self, value: float, sd: float | None = None, source: str | None = None) -> ModelParameter:
        """A copy with another value. Raises ModelParameterError if it is outside the bounds."""
        self.check(value)
        return replace(self, value=float(value), sd=sd, source=self.source if source is None else source)

    def check(self, value: float) -> None:
        """Raise ModelParameterError, naming the range, unless `value` is a finite number within the bounds."""
        check_range(ModelParameterError, self.name, value, self.lower, self.upper, self.unit)


_SEARCHED = "found to reproduce the paper's reported speeds and forces"


BASE_PARAMETERS = {
    row[0]: ModelParameter(*row)
    for row in (
        ("head_mass_kg", 0.175, "kg", 0.02, 1.0, (0.1, 0.3), "mass of the head", "paper: 350 g, a half each"),
        ("tail_mass_kg", 0.175, "kg", 0.02, 1.0, (0.1, 0.3), "mass of the tail", "paper: 350 g, a half each"),
        ("head_segment_mass_kg", 0.1, "kg", 0.0, 0.5, (0.05, 0.15), "mass of the head's segment in a pull", _SEARCHED),
        ("body_damping_Ns_m", 130.0, "N s/m", 10.0, 1000.0, (60.0, 260.0), "damping of the body", _SEARCHED),
        ("body_area_N_psi", 9.0, "N/psi", 2.0, 25.0, (7.0, 12.0), "area of the body", _SEARCHED),
        ("body_alpha_n_per_s", 2.0, "1/s", 0.1, 20.0, (1.2, 3.5), "filling rate αn of the body", _SEARCHED),
        ("body_alpha_s_per_s", 0.575, "1/s", 0.05, 10.0, (0.35, 1.0), "filling rate αs of the body", _SEARCHED),
        ("small_mass_kg", 0.015, "kg", 0.002, 0.2, (0.007, 0.03), "moving mass of a small actuator", _SEARCHED),
        ("small_damping_Ns_m", 15.0, "N s/m", 1.0, 200.0, (7.0, 30.0), "damping of a small actuator", _SEARCHED),
        ("small_area_N_psi", 3.2021838525, "N/psi", 0.5, 10.0, (2.4, 4.3), "area of a small actuator", _SEARCHED),
        ("small_alpha_n_per_s", 2.3, "1/s", 0.1, 20.0, (1.4, 4.0), "filling rate αn of a small actuator", _SEARCHED),
        ("small_alpha_s_per_s", 0.8, "1/s", 0.05, 10.0, (0.45, 1.4), "filling rate αs of a small actuator", _SEARCHED),
        ("wall_offset_m", 0.0278019066198, "m", 0.015, 0.034, (0.0262, 0.0291), "offset of the wall", _SEARCHED),
        ("wall_stiffness_N_m", 8000.0, "N/m", 300.0, 1e5, (3000.0, 2e4), "stiffness of the wall", _SEARCHED),
        ("wall_damping_Ns_m", 20.0, "N s/m", 0.0, 500.0, (0.0, 80.0), "damping of the wall", _SEARCHED),
        ("mu_s", 0.45, "", 0.02, 2.0, (0.3, 0.65), "static friction coefficient", _SEARCHED),
        ("mu_k", 0.38, "", 0.02, 2.0, (0.25, 0.55), "kinetic friction coefficient", _SEARCHED),
        ("supply_positive_psi", 8.5, "psi", 0.0, 14.0, (7.5, 9.5), "positive supply", "paper, section V.B"),
        ("supply_negative_psi", -13.0, "psi", -14.7, 0.0, (-14.0, -12.0), "vacuum supply", "paper, section V.B"),
    )
}
