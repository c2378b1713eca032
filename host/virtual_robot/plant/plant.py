# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface of the plant: valve commands over time in, a record of every channel out."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from virtual_robot.errors import NotBuiltError
from virtual_robot.plant.curves import Curve, nominal_curves
from virtual_robot.plant.parameters import NOMINAL, PlantParameterError

try:
    from virtual_robot.plant._plant import ffi, lib
except ImportError:
    ffi = lib = None

EXPERIMENTS = ("locomotion", "step_response", "static_loading", "anchor_pull")
CHAMBERS = ("body", "head", "tail")
STATES = ("off", "positive", "vacuum")

# One row of a record; the C struct PlantSample.
SAMPLE = np.dtype(
    [
        ("time_s", "f8"),
        ("head_m", "f8"),
        ("tail_m", "f8"),
        ("crosshead_m", "f8"),
        ("force_N", "f8"),
        ("pressure_psi", "f8", 3),
        ("small_m", "f8", 3),
        ("connected", "i4", 3),
        ("sliding_head", "i4"),
        ("sliding_tail", "i4"),
    ],
    align=True,
)


class Plant:
    """One robot with its air supply and stands. `parameters`: fields of PlantParameters in plant.h; 0 if not given."""

    _plant: Any = None  # until it is created

    def __init__(self, parameters: Mapping[str, float] = NOMINAL, curves: tuple[Curve, Curve] | None = None) -> None:
        if lib is None:
            raise NotBuiltError("plant")
        self.parameters = dict(parameters)
        numbers = ffi.new("PlantParameters *")
        for name, value in parameters.items():
            if not hasattr(numbers, name):
                raise PlantParameterError(f"the plant has no parameter {name!r}")
            setattr(numbers, name, value)
        body, small = curves or nominal_curves()
        self._plant = lib.plant_new(numbers, *_table(body), *_table(small))
        assert ffi.sizeof("PlantSample") == SAMPLE.itemsize

    def close(self) -> None:
        if self._plant is not None:
            lib.plant_free(self._plant)
            self._plant = None

    __del__ = close

    # --- stand ------------------------------------------------------------------------------------------

    def mount(self, experiment: str, chamber: str = "body", start: str = "off") -> None:
        """Put an experiment on the stand, at rest after settling with `start` connected."""
        lib.plant_mount(self._plant, EXPERIMENTS.index(experiment), CHAMBERS.index(chamber), STATES.index(start))

    def set_trial(
        self, friction_factor: float, inclination_deg: float, ripple_phase_rad: float, session_share: float
    ) -> None:
        """Set what differs from trial to trial; takes effect with the next `mount`."""
        lib.plant_set_trial(self._plant, friction_factor, inclination_deg, ripple_phase_rad, session_share)

    def set_step(self, step_s: float) -> None:
        """Set the largest step of the integrator, until the next `mount`."""
        lib.plant_set_step(self._plant, step_s)

    def connect(self, time_s: float, chamber: str, state: str) -> None:
        """Command a chamber's valves from `time_s` on; commands must come in time order."""
        lib.plant_connect(self._plant, time_s, CHAMBERS.index(chamber), STATES.index(state))

    def move(self, start_s: float, travel_m: float, rate_m_s: float, there_and_back: bool) -> None:
        """Move the cross-head or the puller."""
        lib.plant_move(self._plant, start_s, travel_m, rate_m_s, there_and_back)

    @property
    def moving(self) -> bool:
        return bool(lib.plant_moving(self._plant))

    def record(self, times: Iterable[float] | np.ndarray) -> np.ndarray:
        """Samples at equidistant, increasing times [s]; array of dtype SAMPLE."""
        times = np.asarray(times, float)
        rows = np.zeros(len(times), SAMPLE)
        period = times[1] - times[0] if len(times) > 1 else 0.0
        lib.plant_record(self._plant, times[0], period, len(times), ffi.cast("PlantSample *", rows.ctypes.data))
        return rows

    # --- looking inside ---------------------------------------------------------------------------------

    def spring_force(self, small: bool, displacement_m: np.ndarray) -> np.ndarray:
        return np.array([lib.plant_spring(self._plant, small, float(x)) for x in np.ravel(displacement_m)])

    def landmarks_m(self, small: bool) -> tuple[float, float, float]:
        """Displacements of the contracted, unstable and extended equilibria."""
        out = ffi.new("double[3]")
        lib.plant_landmarks(self._plant, small, out, out + 1, out + 2)
        return out[0], out[1], out[2]

    @property
    def energy_joule(self) -> float:
        return lib.plant_energy(self._plant)

    # --- wired to the Uno -------------------------------------------------------------------------------

    def wire(self, uno: Any, clock_hz: float, noise_seed: int, noise_psi: float, noise_memory_s: float = 0.0) -> None:
        """Connect valves, strobe, sensors and DAC to a board; from now on the board's cycles define the time."""
        lib.plant_wire(self._plant, uno.cycle, clock_hz, noise_seed, noise_psi, noise_memory_s)
        callbacks = (lib.plant_pin_changed_address, lib.plant_analog_volts_address, lib.plant_dac_changed_address)
        pointers = (self._plant, *(callback() for callback in callbacks))
        uno.connect(*(int(ffi.cast("uintptr_t", pointer)) for pointer in pointers))

    def remount(self, experiment: str, chamber: str, cycle: int) -> None:
        """Put another experiment on the stand while the board keeps running; time is 0 at `cycle`."""
        lib.plant_remount(self._plant, EXPERIMENTS.index(experiment), CHAMBERS.index(chamber), cycle)

    def advance(self, time_s: float) -> None:
        lib.plant_advance(self._plant, time_s)

    def sample(self, time_s: float) -> np.ndarray:
        """One row of dtype SAMPLE at `time_s`."""
        return self.record([time_s])[0]

    def break_sensor(self, channel: int, volts: float | None) -> None:
        """Fix the output of a sensor (0-2) or of the regulator's monitor (3); None repairs it."""
        lib.plant_break_sensor(self._plant, channel, float("nan") if volts is None else volts)

    @property
    def both_valves(self) -> int:
        """How often both valves of a chamber were energised together (must stay 0)."""
        return lib.plant_both_valves(self._plant)

    def take_strobes(self) -> np.ndarray:
        """Rising edges of the sampling strobe since the last call [s]."""
        return self._taken(lib.plant_strobes, "double *", np.dtype(float))

    def watch(self, period_s: float, offset_s: float) -> None:
        """Have an instrument sample at offset_s + n period_s from now on; period 0 stops."""
        lib.plant_watch(self._plant, period_s, offset_s)

    def take_watched(self) -> np.ndarray:
        """Samples that the instrument has taken since the last call; dtype SAMPLE."""
        return self._taken(lib.plant_watched, "PlantSample *", SAMPLE)

    def _taken(self, take: Any, pointer: str, dtype: np.dtype) -> np.ndarray:
        """Drain `take` block by block."""
        block, parts = np.zeros(4096, dtype), [np.zeros(0, dtype)]
        while count := take(self._plant, ffi.cast(pointer, block.ctypes.data), len(block)):
            parts.append(block[:count].copy())
        return np.concatenate(parts)


def _table(curve: Curve) -> tuple[Any, int, float, float]:
    force = ffi.new("double[]", list(map(float, curve.force_N)))
    return force, len(curve.force_N), curve.first_m, curve.step_m
