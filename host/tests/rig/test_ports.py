"""`--port`: wrong ports are reported, and a serial port is opened exclusively."""

from importlib.metadata import EntryPoints

import pytest

from bifa.link import PortGoneError, Uno
from bifa.rig import Rig, RigError, SerialRig, open_rig
from harness.pty_uno import PtyUno


def test_wrong_ports_are_named():
    with pytest.raises(RigError, match="virtuall"):
        open_rig("virtuall")
    with pytest.raises(PortGoneError, match="/dev/does-not-exist"):
        open_rig("/dev/does-not-exist")


def test_the_virtual_robot_that_is_not_installed_is_said_how_to_get(monkeypatch):
    monkeypatch.setattr("bifa.rig.rig.entry_points", lambda group: EntryPoints(()))
    with pytest.raises(RigError, match=r"not installed; .*`pip install -e host/virtual_robot`"):
        open_rig("virtual", seed=1)


def test_an_open_port_is_not_configured_again(uno, monkeypatch):
    """The Uno's USB bridge may drop what it is still sending, a stop included, when its port is configured."""
    with SerialRig(uno.device) as rig:
        monkeypatch.setattr("serial.Serial._reconfigure_port", None)
        connected = Uno(rig.transport, rig.clock)
        connected.connect()
        connected.set("period_s", 3.0)
        connected.stream(True)
        assert connected.samples(0.1)
        connected.stop()


def test_a_serial_port_exclusive_and_unplugged():
    plugged = PtyUno()
    with SerialRig(plugged.device) as rig:
        assert isinstance(rig, Rig), "it has whatever a session asks of a rig"
        uno = Uno(rig.transport, rig.clock)
        uno.connect()
        uno.set("period_s", 3.0)
        assert uno.get("period_s") == 3.0
        with pytest.raises(PortGoneError, match="is in use by"):
            SerialRig(plugged.device)
        uno.stream(True)
        began_s = rig.clock.now()
        samples = uno.samples(1.5)
        assert rig.clock.now() - began_s >= 1.5
        assert len(samples) > 20, "all samples of that time, not only the first"
        plugged.unplug()
        with pytest.raises(PortGoneError, match="gone"):
            uno.set("period_s", 4.0)
