"""Real measurements: the EMPS benchmark, a cart on a screw. `python docs/examples/emps.py DATA_EMPS.mat`"""

import sys

import numba
import numpy as np
from scipy.io import loadmat
from scipy.signal import savgol_filter

import lacuna
from lacuna import Effect, Parameter


@numba.njit(nogil=True, cache=True)
def cart(q, v, motor_N, pulses_N, mass, damping, coulomb, offset, d_coulomb, d_damping, dip, v_dip, delay_s, gain):
    out, n = np.empty(len(motor_N)), len(motor_N)
    for i in range(n):
        out[i], k = q, max(i - delay_s / 1e-3, 0.0)
        force = (1 - k % 1) * motor_N[int(k)] + k % 1 * motor_N[min(int(k) + 1, n - 1)] + gain * pulses_N[i] - offset
        side = 1.0 if v > 0 else -1.0
        slide = max(coulomb + side * d_coulomb + dip * np.exp(-abs(v) / v_dip), 0.0)
        free = v + 1e-3 * (force - (damping + side * d_damping) * v) / mass
        v = np.sign(free) * max(abs(free) - 1e-3 * slide / mass, 0.0)  # Coulomb friction is a set: it sticks exactly
        q += 1e-3 * v
    return 1e3 * out


def simulate(record, theta):  # theta in the order in which its parameters are declared below
    *values, v_m_s = theta.values()  # nuisances come last
    return {"position_mm": cart(1e-3 * record["position_mm"][0], v_m_s, record["motor_N"], record["pulses_N"], *values)}


def start(record):  # the speed that a window begins with is only known to a few millimetres a second
    return [Parameter("v_m_s", "m/s", record["speed_m_s"][0], -1.0, 1.0, scale=2e-3)]


friction = Parameter("force_N", "N", 3.0, -30.0, 30.0), Parameter("damping_Ns_m", "N s/m", 20.0, -150.0, 150.0)
dip = Parameter("force_N", "N", 5.0, -30.0, 60.0), Parameter("speed_m_s", "m/s", 0.01, 1e-3, 0.1)
effects = [  # of each parameter its name, unit, a typical value, and bounds
    Effect("viscous", Parameter("damping_Ns_m", "N s/m", 200.0, 0.0, 600.0)),
    Effect("coulomb", Parameter("force_N", "N", 20.0, 0.0, 100.0)),
    Effect("offset", Parameter("force_N", "N", 3.0, -30.0, 30.0)),
    Effect("asymmetric_friction", friction, sizes=2),
    Effect("stribeck", dip),
    Effect("delay", Parameter("delay_s", "s", 2e-3, 0.0, 0.05)),
    Effect("pulses", Parameter("gain", "1", 1.0, -3.0, 3.0)),  # logged, but the motor's signal has them already
]
mass = [Parameter("mass_kg", "kg", 95.0, 50.0, 150.0)]
system = lacuna.System(simulate, mass, effects, nuisances=start, name="EMPS")


def read(mat_file):
    mat = {name: column.ravel() for name, column in loadmat(mat_file).items() if name[0] != "_"}
    motor_N, v_m_s = mat["gtau"][0] * mat["vir"], savgol_filter(mat["qm"], 31, 3, deriv=1, delta=1e-3)
    inputs = {"motor_N": motor_N, "speed_m_s": v_m_s, "pulses_N": mat.get("pulses_N", 0.0 * motor_N)}
    return {"time_s": 1e-3 * np.arange(len(motor_N)), "position_mm": 1e3 * mat["qm"]} | inputs


def windows(record):
    return lacuna.windows(record, 1.0, every=6.24 / 6, period=6.24)  # at the same place of each cycle: repeats


if __name__ == "__main__":
    print(lacuna.diagnose(system, windows(read(sys.argv[1]))))
