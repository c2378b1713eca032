"""The settled central pattern generator: phases and thresholds of eq. (9), which the Uno integrates (`lib/cpg`).

Phases settle at phi_j - phi_i = +psi_ij, so that head and tail run ahead of the body by psi_12 and psi_13. u_i = 1
(positive pressure) when the wrapped phase exceeds 2 pi d_i: a duty is the fraction of the cycle at vacuum.
"""

import numpy as np

from bifa.robot.gait import Gait

COUPLING_PER_S = 10.0  # alpha_phi of eq. (9)


def phase_offsets_rad(gait: Gait) -> np.ndarray:
    """Phases of body, head and tail ahead of the body once settled, shape (3,)."""
    return np.radians([0.0, gait.psi12_deg, gait.psi13_deg])


def duties(gait: Gait) -> np.ndarray:
    """Fractions of the cycle at vacuum for body, head and tail, shape (3,)."""
    return np.array([gait.duty_body, gait.duty_head, gait.duty_tail])
