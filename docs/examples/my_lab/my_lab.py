"""A lab's own instruments as a rig of bifa: `pip install docs/examples/my_lab`, then `bifa campaign --port my-lab`.

`acme` stands for the vendor's driver: put your camera's and your machine's calls in its place. What they give has to
carry their own times, and the times at which their sync input saw the Uno's strobe (D10) rise; bifa lines them up.
"""

import acme  # your vendor's

from bifa.errors import BifaError
from bifa.rig import SerialRig, find_port

KNOWN = {"head_mass_kg": 0.182, "tail_mass_kg": 0.171}  # what this lab has weighed or gauged
STROKE_MM = {"large": 54.0, "small": 30.0}  # from contracted to extended


class Instruments:
    """The protocol of `bifa.measure.instruments.Instruments`."""

    def __init__(self):
        self.camera, self.machine = acme.Camera(), acme.Machine()
        self._recorder, self._travel_mm, self._back, self._rate_mm_s = self.camera, 0.0, False, 0.0

    def mount(self, experiment, **settings):
        """Vented, contracted, at rest, displacement 0. Here a person does it; a robot arm might as well."""
        if settings.get("inclination_deg"):
            raise BifaError("this lab's pipe is level")
        acme.ask_the_technician(f"mount {experiment}, {settings}")
        self._recorder = self.machine if experiment in ("static_loading", "anchor_pull") else self.camera
        self._rate_mm_s = settings.get("rate_mm_s", 0.0)
        self._back = experiment == "static_loading"
        self._travel_mm = settings.get("travel_mm") or STROKE_MM[settings.get("actuator", "large")]

    def start(self):
        """Begin a record: on return it runs."""
        self._recorder.arm()

    def move(self):
        """The cross-head: there and back for a static loading, the pull for an anchor."""
        self.machine.travel(self._travel_mm, self._rate_mm_s, there_and_back=self._back)

    @property
    def moving(self):
        """Whether the cross-head is under way."""
        return self.machine.busy

    def stop(self):
        """End the record: NumPy arrays by the names of the data set, in mm, N and s."""
        taken = self._recorder.read()
        record = {"time_s": taken.time_s, "sync_time_s": taken.strobes_s}
        if self._recorder is self.machine:
            return record | {"displacement_mm": taken.extension_mm, "force_N": taken.load_N}
        if taken.tail_mm is None:  # a single actuator
            return record | {"displacement_mm": taken.head_mm}
        return record | {"displacement_head_mm": taken.head_mm, "displacement_tail_mm": taken.tail_mm}


class MyLab(SerialRig):
    """The Uno on its serial port, with this lab's instruments."""

    known = KNOWN

    def __init__(self, device):
        super().__init__(device)
        self.instruments = Instruments()


def open_rig(device=None):
    """What the entry point names; `device`: the Uno's port, found by its USB identity if left out."""
    return MyLab(device or find_port())
