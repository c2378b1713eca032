"""Your own system in the engine: an electro-mechanical positioning system with real measurements (EMPS benchmark).

python docs/examples/emps.py FOLDER     # with DATA_EMPS.mat (diagnosed) and DATA_EMPS_PULSES.mat (test)
"""

import sys
from pathlib import Path

import numba
import numpy as np
from scipy.io import loadmat
from scipy.signal import savgol_filter

from lacuna.diagnosis.diagnose import diagnose
from lacuna.system import Effect, Parameter, Record, System

STEP_S, CYCLE_S, WINDOWS, CYCLES = 1e-3, 6.249, 6, 4  # the reference repeats every 6.249 s: windows of it are repeats
ORDER = [
    *("mass_kg", "viscous.damping_Ns_m", "coulomb.force_N", "offset.force_N"),
    *("asymmetric_friction.force_N", "asymmetric_friction.damping_Ns_m", "stribeck.force_N", "stribeck.speed_m_s"),
    *("cogging.force_N", "cogging.phase_rad", "flexibility.compliance_um_N", "delay.delay_s", "pulses.gain"),
]


@numba.njit(nogil=True, cache=True)
def simulate(q, v, motor_N, pulses_N, p):
    """Position, m, from the first state and the motor's force; Coulomb friction is a set, so it sticks exactly."""
    mass, damping, coulomb, offset, d_coulomb, d_damping, dip, v_dip, cog, phase, compliance, delay, gain = p
    out, load, load_v, n = np.empty(len(motor_N)), q, v, len(motor_N)
    for i in range(n):
        out[i] = q
        at = max(i - delay / STEP_S, 0.0)
        k, share = int(at), at % 1.0
        force = (1 - share) * motor_N[k] + share * motor_N[min(k + 1, n - 1)]
        force += gain * pulses_N[i] - offset - cog * np.sin(2 * np.pi * q / 0.01 + phase)
        inertia = mass
        if compliance > 0:  # a fifth of the mass hangs on a spring
            inertia = 0.8 * mass
            spring = (q - load) / (1e-6 * compliance) + 200.0 * (v - load_v)
            load_v += STEP_S * spring / (0.2 * mass)
            load += STEP_S * load_v
            force -= spring
        side = 1.0 if v > 0 else -1.0
        slide = max(coulomb + side * d_coulomb + dip * np.exp(-abs(v) / max(v_dip, 1e-6)), 0.0)
        free = v + STEP_S * (force - (damping + side * d_damping) * v) / inertia
        v = np.sign(free) * max(abs(free) - STEP_S * slide / inertia, 0.0)
        q += STEP_S * v
    return out


def effect(name: str, enters: str, *parameters: tuple, sizes: int = 1) -> Effect:
    return Effect(name, tuple(Parameter(*p) for p in parameters), enters, sizes=sizes)


class Emps(System):
    name = "EMPS"
    parameters = (Parameter("mass_kg", "kg", 95.0, 50.0, 150.0),)
    effects = {  # noqa: RUF012  name, unit, typical value, lower and upper bound of each parameter
        e.name: e
        for e in (
            effect("viscous", "friction", ("damping_Ns_m", "N s/m", 200.0, 0.0, 600.0)),
            effect("coulomb", "friction", ("force_N", "N", 20.0, 0.0, 100.0)),
            effect("offset", "motor", ("force_N", "N", 3.0, -30.0, 30.0)),
            effect(
                "asymmetric_friction",
                "friction",
                ("force_N", "N", 3.0, -30.0, 30.0),
                ("damping_Ns_m", "N s/m", 20.0, -150.0, 150.0),
                sizes=2,
            ),
            effect("stribeck", "friction", ("force_N", "N", 5.0, -30.0, 60.0), ("speed_m_s", "m/s", 0.01, 1e-3, 0.1)),
            effect("cogging", "motor", ("force_N", "N", 3.0, 0.0, 30.0), ("phase_rad", "rad", 0.0, -7.0, 7.0)),
            effect("flexibility", "drive", ("compliance_um_N", "um/N", 3.0, 0.0, 30.0)),
            effect("delay", "input", ("delay_s", "s", 2e-3, 0.0, 0.05)),
            effect("pulses", "input", ("gain", "1", 1.0, -3.0, 3.0)),  # logged, but the motor's force has them: a decoy
        )
    }

    def __init__(self, mat_file: Path, *, whole: bool = False):
        record = {name: column.ravel() for name, column in loadmat(mat_file).items() if name[0] != "_"}
        q, motor_N = record["qm"], record["gtau"][0] * record["vir"]
        v = savgol_filter(q, 31, 3, deriv=1, delta=STEP_S)
        pulses_N = record.get("pulses_N", np.zeros_like(q))
        trials = []
        for k in range(1 if whole else CYCLES * WINDOWS):
            first = round(k * CYCLE_S / WINDOWS / STEP_S)
            at = slice(first, len(q) if whole else first + 1000)
            time_s = STEP_S * np.arange(len(q[at]))
            given = (q[first], v[first], motor_N[at], pulses_N[at])
            measured = {"position_mm": 1e3 * q[at]}
            trials.append(Record(f"window {k}", "free run", k % WINDOWS, time_s, measured, k, given))
        self.trials = tuple(trials)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        p = np.array([theta.get(name, 0.0) for name in ORDER])
        return {"position_mm": 1e3 * simulate(*trial.payload, p)}

    def regressors(self, trial, prediction):
        v = np.gradient(prediction["position_mm"], trial.time_s)
        return {"velocity": v, "direction of motion": np.sign(v), "position": prediction["position_mm"]}

    def rmse_mm(self, theta) -> float:
        """Root mean square error in free-running simulation of all trials."""
        errors = [self.predict(theta, (), t)["position_mm"] - t.channels["position_mm"] for t in self.trials]
        return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def main(folder: Path) -> None:
    fitted, test = folder / "DATA_EMPS.mat", folder / "DATA_EMPS_PULSES.mat"
    records = Emps(fitted), Emps(test), Emps(test, whole=True)
    for name, record in (("the fitted record", records[0]), ("the test record, pulses logged", records[1])):
        found = diagnose(record)
        print(f"{name}: {found.verdict} " + " + ".join(e.name for e in found.effects) + f" in {found.seconds:.0f} s")
        if record is records[0]:
            kept = found
    print("free-running error, mm:              1 s windows: fitted, test    whole test record")
    first = kept.search.with_effects(["viscous", "offset", "coulomb"])
    rows = {"mass alone": kept.base.theta, "first model": first.fitted.theta, "what was found": kept.final.theta}
    for name, theta in rows.items():
        errors = [record.rmse_mm(theta) for record in records]
        print(f"  {name:30} {errors[0]:20.3f} {errors[1]:10.3f} {errors[2]:16.1f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
