"""The virtual lab on its ports: the sensor's box and the arm's controller, both on one physics."""

import contextlib
import ipaddress
from dataclasses import dataclass

from dmpcli.arrays import Floats
from dmpcli.instruments.protocols import VIRTUAL
from dmpcli.simulation.elite_server.faults import LabFaults
from dmpcli.simulation.elite_server.lab import VirtualLab
from dmpcli.simulation.elite_server.service import ControllerService, unbound
from dmpcli.simulation.netft_server.box import RdtBox
from dmpcli.simulation.netft_server.faults import BoxFaults
from dmpcli.simulation.netft_server.settings import BoxSettings

LOOPBACK = "127.0.0.1"


def loopback(host: str) -> bool:
    """Tell whether only this computer itself can reach what is bound to a host."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Ports:
    """Where the lab listens; 0 asks for a free port.

    Attributes
    ----------
    sensor, http, tcp : int
        The box: RDT over UDP, its pages, its TCP interface.
    robot, monitor : int
        The controller: JSON-RPC and monitor frames.
    """

    sensor: int = 0
    http: int = 0
    tcp: int = 0
    robot: int = 0
    monitor: int = 0


class LabServer:
    """A lab that is served, until it is closed; a context manager.

    Parameters
    ----------
    lab : VirtualLab
    faults : LabFaults
        Those of the sensor; the lab itself knows the controller's.
    host : str
    ports : Ports
    seed : int
        Of the sensor's faults.

    Attributes
    ----------
    lab : VirtualLab
    box : RdtBox
    controller : ControllerService

    Raises
    ------
    InputError, InstrumentError
        The host is not this computer's; a port cannot be had.
    """

    def __init__(
        self,
        lab: VirtualLab,
        faults: LabFaults | None = None,
        host: str = LOOPBACK,
        ports: Ports | None = None,
        seed: int = 0,
    ) -> None:
        faults, ports = faults or LabFaults(), ports or Ports()
        self.lab, self._host = lab, host
        self.controller = ControllerService(lab, host, ports.robot, ports.monitor)
        self._saturates, self._falls_silent = faults.saturation, faults.silence
        self._streams_since: float | None = None
        self.box = RdtBox(
            self._read,
            BoxSettings(
                serial=VIRTUAL,
                host=host,
                rdt_port=ports.sensor,
                http_port=ports.http,
                tcp_port=ports.tcp,
            ),
            BoxFaults(
                loss=faults.shares.get("loss", 0.0),
                duplication=faults.shares.get("duplicate", 0.0),
                reordering=faults.shares.get("reorder", 0.0),
                malformed=faults.shares.get("malformed", 0.0),
                seed=seed,
            ),
        )
        try:
            self.box.start()
        except (OSError, UnicodeError) as error:
            self.controller.close()
            # It binds them in this order, and knows the numbers of those that it has.
            name, port = next(
                (name, port)
                for name, port, bound in (
                    ("sensor", ports.sensor, self.box.rdt_port),
                    ("http", ports.http, self.box.http_port),
                    ("tcp", ports.tcp, self.box.tcp_port),
                )
                if not bound
            )
            raise unbound(name, host, port, error) from None

    def __enter__(self) -> "LabServer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def sensor_url(self) -> str:
        """What ``--sensor`` takes."""
        box = self.box
        return f"netft://{self._host}:{box.rdt_port}?http={box.http_port}&tcp={box.tcp_port}"

    @property
    def robot_url(self) -> str:
        """What ``--robot`` takes."""
        robot = self.controller
        return f"elite://{self._host}:{robot.robot_port}?monitor_port={robot.monitor_port}"

    def close(self) -> None:
        """Serve no longer; may be called twice."""
        with contextlib.closing(self.controller):
            self.box.close()

    def _read(self, t: float) -> Floats:
        """What the sensor feels; the box asks for every record that it streams."""
        if self._streams_since is None:
            self._streams_since = t
        age = t - self._streams_since
        if age >= self._saturates:
            self.box.faults.saturated = True
        if age >= self._falls_silent:
            self.box.faults.silent_at = 0.0
        return self.lab.wrench(t)
