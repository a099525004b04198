"""``ur://HOST``: Universal Robots' arms (CB3 and e-Series) by their servoL, through ur-rtde.

The package is an extra: ``pip install dmpcli[ur]``. Poses are in m with a rotation vector, of the
TCP that is set on the robot, in its base frame. Nothing is started on the robot before `UrDriver.
start`, so that a dry run only reads. ur-rtde connects without a time limit and keeps Python's lock
meanwhile; whether there is a robot that answers is therefore found out before it is let in.

It is no force sensor: the force that the robot tells is its own estimate at the TCP in base axes,
without the payload that it was told, and not the reading of a sensor on the flange that the
compensation of a tool expects.
"""

import contextlib
import socket
import struct
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np

from dmpcli import extras
from dmpcli.arrays import Floats
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
from dmpcli.instruments import outputs, sockets
from dmpcli.instruments.address import Address
from dmpcli.instruments.driver_protocol import DriverInfo, DriverState
from dmpcli.instruments.options import Options
from dmpcli.instruments.protocols import Clock, RobotMode

T = TypeVar("T")

RTDE_PORT, DASHBOARD_PORT = 30004, 29999
"""The robot's own; ur-rtde knows no others."""

VARIABLES = (
    "timestamp",
    "actual_q",
    "actual_TCP_pose",
    "robot_mode",
    "safety_mode",
    "robot_status_bits",
    "safety_status_bits",
)
"""What the robot is asked to send, every cycle."""

_MODELS = {"none": None, "ur5e": "ur5e"}
_REMEDY = "; see --tool, the TCP that is set on the robot and, in the URL, model=none, check=MM"
# Of the orientation, per mm of the position's tolerance, rad.
_TURN_PER_MM = 0.01

_PATIENCE = 1.0
# Without a new time stamp from the controller for so long, s, its state is not believed.
_SILENCE = 0.2
_RUNNING = 7  # ROBOT_MODE_RUNNING: power on, brakes released
_SAFETY_NORMAL = 1
_SAFETY: dict[int, tuple[RobotMode, str]] = {
    _SAFETY_NORMAL: ("ready", ""),
    2: ("ready", "reduced mode"),
    3: ("protective stop", ""),
    4: ("not ready", "recovery mode"),
    5: ("stopped", "safeguard stop"),
    6: ("emergency stop", "system"),
    7: ("emergency stop", "robot"),
    8: ("fault", "safety violation"),
    9: ("fault", "safety fault"),
}
# The longest answer of the dashboard that is read.
_LINE = 256
_REQUEST_VERSION = struct.pack(">HBH", 5, ord("V"), 2)


def make(address: Address, clock: Clock) -> "UrDriver":
    """Return the driver of a URL such as ``ur://HOST?lookahead=0.1&gain=300``.

    Raises
    ------
    InputError
        It names a port, or an option that is unknown or out of range.
    """
    if address.port is not None:
        raise InputError(f"{address}: the robot's ports are fixed; leave the port out")
    options = Options(address)
    driver = UrDriver(
        address.host,
        clock,
        lookahead=options.number("lookahead", 0.1, 0.03, 0.2, "s"),
        gain=options.number("gain", 300.0, 100.0, 2000.0, ""),
        deceleration=options.number("deceleration", 10.0, 0.1, 100.0, "m/s²"),
        watchdog=options.number("watchdog", 10.0, 1.0, 100.0, "Hz"),
        model=_MODELS[options.choice("model", "none", *_MODELS)],
        tolerance=options.number("check", 5.0, 0.1, 100.0, "mm"),
    )
    options.done()
    return driver


make.port = RTDE_PORT  # type: ignore[attr-defined]  # see `registry`


class UrDriver:
    """A `ServoDriver` for UR arms.

    Parameters
    ----------
    host : str
    clock : Clock
        Real.
    lookahead : float
        Over which servoL smooths, s.
    gain : float
        Of servoL's position control.
    deceleration : float
        Of the stop, m/s².
    watchdog : float
        The robot stops by itself when set-points come less often, Hz.
    model : str or None
        Name of its kinematics, with which reach, joints and TCP are checked.
    tolerance : float
        By how much the TCP may differ from the model's, mm.
    """

    def __init__(
        self,
        host: str,
        clock: Clock,
        *,
        lookahead: float,
        gain: float,
        deceleration: float,
        watchdog: float,
        model: str | None = None,
        tolerance: float = 5.0,
    ) -> None:
        self._host, self._clock = host, clock
        self._lookahead, self._gain, self._deceleration = lookahead, gain, deceleration
        self._watchdog, self._model, self._tolerance = watchdog, model, tolerance
        self._period = 0.0
        self._receive: Any = None
        self._control: Any = None
        self._servoing = False
        self._stamp: tuple[float, float] | None = None  # the controller's and when it was new
        self._io: Any = None
        self._outputs: list[str] = []  # that will be switched
        self._on: list[str] = []

    def connect(self) -> DriverInfo:
        """Connect for reading; nothing starts on the robot.

        Raises
        ------
        InputError
            ur-rtde is not installed.
        InstrumentError
            There is no robot, or none that speaks RTDE.
        """
        interface = _package("rtde_receive").RTDEReceiveInterface
        self._probe()
        self._receive = self._asked(
            "connecting", lambda: interface(self._host, variables=list(VARIABLES))
        )
        # Longer than a period at which the robot's own watchdog would stop it is never sent.
        return DriverInfo(
            make="Universal Robots",
            space="pose",
            period_range=(0.002, 0.5 / self._watchdog),
            lookahead=self._lookahead,
            length="m",
            angle="rad",
            orientation="rotation vector",
            model=self._model,
            tolerance=(self._tolerance, _TURN_PER_MM * self._tolerance),
            remedy=_REMEDY,
        )

    def state(self) -> DriverState:
        """Return what the robot last reported.

        Raises
        ------
        InstrumentError
            The connection is lost, or nothing new came for 0.2 s.
        """
        receive = self._receive
        if receive is None:
            raise InstrumentError(f"{self._name}: not connected")
        if not self._asked("connection", receive.isConnected):
            raise InstrumentError(f"{self._name}: the connection is lost; check cable and power")
        now = self._clock.now()
        stamp = float(self._asked("time stamp", receive.getTimestamp))
        if self._stamp is None or stamp != self._stamp[0]:
            self._stamp = stamp, now
        silent = now - self._stamp[1]
        if not silent <= _SILENCE:
            raise InstrumentError(
                f"{self._name}: silent for {silent:.2f} s; check cable and controller"
            )
        pose = np.array(self._asked("pose", receive.getActualTCPPose), dtype=float)
        joints = np.array(self._asked("joints", receive.getActualQ), dtype=float)
        mode, detail = self._mode()
        return DriverState(self._stamp[1], mode, joints, pose, detail)

    def start(self, period: float) -> None:
        """Start the control script on the robot, with its watchdog.

        Raises
        ------
        InputError
            ur-rtde is not installed.
        RefusedError
            The robot is not ready.
        InstrumentError
            It does not let itself be controlled: not in remote control, or used by another client.
        """
        interface = _package("rtde_control").RTDEControlInterface
        mode, detail = self._mode()
        if mode != "ready":
            raise RefusedError(
                f"{self._name}: {mode}{f' ({detail})' if detail else ''}; clear it on the pendant"
            )
        if self._control is None:
            self._open(DASHBOARD_PORT).close()
            self._control = self._asked(
                "its control script, which needs remote control,",
                lambda: interface(self._host),
            )
        control = self._control
        if self._outputs and self._io is None:
            outside = _package("rtde_io").RTDEIOInterface
            self._io = self._asked("the connection for its outputs", lambda: outside(self._host))
        self._asked("setWatchdog", lambda: control.setWatchdog(self._watchdog))
        self._period = period

    def send(self, target: Floats) -> bool:
        """Send one set-point by servoL; the first one only if the robot says that it is safe.

        Raises
        ------
        RefusedError
            The first set-point is out of the robot's reach or safety limits.
        InstrumentError
            The connection failed.
        """
        control = self._control
        if control is None or not np.isfinite(target).all():
            return False
        pose = target.tolist()
        if not self._servoing:
            # Later ones are watched by the controller itself, which stops; asking takes a cycle.
            if not self._asked(
                "isPoseWithinSafetyLimits", lambda: control.isPoseWithinSafetyLimits(pose)
            ):
                raise RefusedError(
                    f"{self._name}: the first set-point is out of its reach or safety limits; "
                    "move the stroke, or mend the limits on the pendant"
                )
            self._servoing = True
        self._asked("kickWatchdog", control.kickWatchdog)
        unused = 0.0  # speed and acceleration, which servoL ignores
        return bool(
            self._asked(
                "servoL",
                lambda: control.servoL(
                    pose, unused, unused, self._period, self._lookahead, self._gain
                ),
            )
        )

    def output(self, name: str) -> None:
        """Take note that an output will be switched: DO0 to DO7, CO0 to CO7 or TO0, TO1.

        The control box's standard and configurable outputs, and the tool's.

        Raises
        ------
        InputError
        """
        _output(name, self._name)
        if name not in self._outputs:
            self._outputs.append(name)

    def switch(self, name: str, on: bool) -> None:
        """Switch an output by RTDE, on a connection of its own.

        Raises
        ------
        InstrumentError
            The robot does not do it.
        """
        method, number = _output(name, self._name)
        if self._io is None:
            raise InstrumentError(f"{self._name}: {name}: its outputs are not connected")
        if on and name not in self._on:
            self._on.append(name)
        if not self._asked(name, lambda: getattr(self._io, method)(number, on)):
            word = "on" if on else "off"
            raise InstrumentError(f"{self._name}: did not switch {name} {word}")
        if not on and name in self._on:
            self._on.remove(name)

    def stop(self) -> None:
        """Decelerate and end servo mode; the script on the robot stays until `close`."""
        control = self._control
        if not self._servoing or control is None:
            return
        try:
            if not self._asked("servoStop", lambda: control.servoStop(self._deceleration)):
                raise InstrumentError(f"{self._name}: did not do servoStop")
        except InstrumentError as failure:
            self._stop_otherwise(failure)
        self._servoing = False  # only now: what failed is tried again

    def halt(self) -> None:
        """Stop the program on the robot by its dashboard, beside whatever else hangs.

        Raises
        ------
        InstrumentError
            The dashboard cannot be reached, or does not do it.
        """
        with self._open(DASHBOARD_PORT) as link, _failing(f"{self._name}: dashboard"):
            link.settimeout(_PATIENCE)
            with link.makefile("rw", encoding="utf-8", errors="replace", newline="\n") as lines:
                lines.readline(_LINE)  # it greets first
                lines.write("stop\n")
                lines.flush()
                answer = lines.readline(_LINE).strip()
        if not answer.startswith("Stopped"):
            raise InstrumentError(f"{self._name}: dashboard: stop: answers {answer[:60]!r}")
        for name in list(self._on):
            self.switch(name, on=False)

    def _stop_otherwise(self, failure: InstrumentError) -> None:
        """Stop what did not do servoStop, unless nothing moves it any more."""
        with contextlib.suppress(InstrumentError):
            if not self._asked("program", self._control.isProgramRunning):
                return
        try:
            self.halt()
        except InstrumentError as beside:
            raise InstrumentError(
                f"{failure}; {beside}; it may still be moving: press its emergency stop"
            ) from None

    def close(self) -> None:
        """Stop, end the script and disconnect, whatever fails on the way."""
        failed: DmpError | None = None
        deeds: list[Callable[[], object]] = [self.stop]
        if self._control is not None:
            deeds += [self._control.stopScript, self._control.disconnect]
        deeds += [link.disconnect for link in (self._io, self._receive) if link is not None]
        for deed in deeds:
            try:
                self._asked("disconnecting", deed)
            except InstrumentError as error:
                failed = failed or error
        self._control = self._receive = self._io = None
        self._stamp, self._servoing = None, False
        if failed is not None:
            raise failed

    @property
    def _name(self) -> str:
        return f"robot ur://{self._host}"

    def _mode(self) -> tuple[RobotMode, str]:
        receive = self._receive
        if receive is None:
            raise InstrumentError(f"{self._name}: not connected")
        safety = int(self._asked("safety mode", receive.getSafetyMode))
        mode, detail = _SAFETY.get(safety, ("fault", f"safety mode {safety}"))
        if self._asked("emergency stop", receive.isEmergencyStopped):
            return "emergency stop", detail
        if self._asked("protective stop", receive.isProtectiveStopped):
            return "protective stop", detail
        if mode != "ready":
            return mode, detail
        running = int(self._asked("robot mode", receive.getRobotMode))
        if running != _RUNNING:
            return "not ready", f"robot mode {running}: power on and release the brakes"
        if self._servoing and not self._asked("program", self._control.isProgramRunning):
            return "stopped", "the program on the robot was stopped"
        return mode, detail

    def _probe(self) -> None:
        """Make sure that a robot answers on RTDE: ask for version 2 of the protocol.

        Raises
        ------
        InstrumentError
        """
        with self._open(RTDE_PORT) as link:
            link.settimeout(_PATIENCE)
            answer = b""
            with contextlib.suppress(OSError):
                link.sendall(_REQUEST_VERSION)
                while len(answer) < 4 and (more := link.recv(4 - len(answer))):
                    answer += more
        if answer != struct.pack(">HBB", 4, ord("V"), 1):
            raise InstrumentError(
                f"{self._name}: port {RTDE_PORT} answers, but not as a UR robot does; "
                "check the address, and that the robot has RTDE (CB3.1 from 3.4, e-Series)"
            )

    def _open(self, port: int) -> socket.socket:
        return sockets.connect(self._host, port, _PATIENCE, f"{self._name}, port {port}")

    def _asked(self, what: str, call: Callable[[], T]) -> T:
        """Call ur-rtde, which raises RuntimeError for whatever fails."""
        try:
            return call()
        except (RuntimeError, OSError, ValueError) as error:
            said = " ".join(str(error).split()) or type(error).__name__
            raise InstrumentError(f"{self._name}: {what} failed: {said}") from None


_OUTPUTS = {
    "DO": ("setStandardDigitalOut", 7),
    "CO": ("setConfigurableDigitalOut", 7),
    "TO": ("setToolDigitalOut", 1),
}
"""Calls of ur-rtde and last numbers, by the letters that a name begins with."""


def _output(name: str, robot: str) -> tuple[str, int]:
    """Return ur-rtde's call that switches an output, and its number."""
    method, last = _OUTPUTS.get(name[:2], _OUTPUTS["DO"])
    letters = name[:2] if name[:2] in _OUTPUTS else "DO"
    return method, outputs.number(name, robot, 0, last, letters)


@contextlib.contextmanager
def _failing(what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InstrumentError(f"{what}: {sockets.words(error)}") from None


def _package(name: str) -> Any:
    """Import one of ur-rtde's modules.

    Raises
    ------
    InputError
    """
    return extras.load(extras.UR, "--robot ur", name)[0]
