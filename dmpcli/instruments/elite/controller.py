"""One EC controller: what both ways of motion need of it, and what it may be believed.

Connecting only reads, and clears an alarm where that was asked for. The motors are switched on
when a motion begins, not before.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments.driver_protocol import DriverInfo, DriverState
from dmpcli.instruments.elite.frames import MonitorReport
from dmpcli.instruments.elite.jsonrpc import Client
from dmpcli.instruments.elite.monitor import Monitor
from dmpcli.instruments.elite.requests import Params, Requests
from dmpcli.instruments.elite.settings import RPC_PORT, EliteSettings
from dmpcli.instruments.protocols import Clock, RobotMode
from dmpcli.messages import warn

MAKE, MODEL = "Elite EC66", "ec66"

PERIODS = (0.002, 0.1)
"""Shortest and longest period of the transparent transmission, s."""

_REMEDY = (
    "; see --tool and, in the URL, tool=N, euler=zyx, base_turn=180, flange_turn=180, check=MM"
)

_MODES = ("teach", "play", "remote")
_REMOTE = 2
_STOP, _PAUSE, _ESTOP, _PLAY, _ERROR, _COLLISION = range(6)
_STATES = ("stopped", "paused", "emergency stop", "playing", "alarm", "collision")

# The monitor and the JSON-RPC tell the same joint angle, degrees.
_SAME = 0.5
# Of the orientation, per mm of the position's tolerance, rad.
_TURN_PER_MM = 0.01
# How long servos may take to come on, s, and how often they are asked meanwhile.
_POWER_TIME, _POWER_STEP = 5.0, 0.02
# How long an arm whose transmission was ended may take to stand still, s; it does where no joint
# turns by more than this, degrees, in this time, s.
_STOP_TIME = 1.0
_STILL, _STILL_TIME = 0.01, 0.3


class Controller:
    """A connection to an EC controller: JSON-RPC and monitor.

    Parameters
    ----------
    settings : EliteSettings
    clock : Clock

    Attributes
    ----------
    name : str
        For messages.
    requests : Requests
    """

    def __init__(self, settings: EliteSettings, clock: Clock) -> None:
        s = self._settings = settings
        self._clock = clock
        self.name = f"robot {s.host}"
        self._client = Client(s.host, s.port, s.patience)
        self._monitor = Monitor(s.host, s.monitor_port, s.patience, clock, s.word, s.oldest)
        self._reported: Floats | None = None
        self.requests = Requests(self._client, self.name)

    def declaration(self, lookahead: float) -> DriverInfo:
        """Return what the controller declares.

        Parameters
        ----------
        lookahead : float
            s.
        """
        s = self._settings
        return DriverInfo(
            make=MAKE,
            space="joint",
            period_range=PERIODS,
            lookahead=lookahead,
            length="mm",
            angle="deg",
            orientation=s.orientation,
            model=MODEL,
            base_turn=s.base_turn,
            flange_turn=s.flange_turn,
            tolerance=(s.tolerance, _TURN_PER_MM * s.tolerance),
            remedy=_REMEDY,
        )

    def connect(self) -> None:
        """Connect to both ports, and check that they tell the same of one robot.

        Raises
        ------
        InstrumentError
            A port cannot be reached, or what it sends cannot be believed.
        """
        s = self._settings
        self._client.connect()
        # The state first: a port that is something else shows at once.
        try:
            state = self.requests.whole("getRobotState", _STOP, _COLLISION)
        except InstrumentError as error:
            raise InstrumentError(
                f"{error}; is {s.port} the controller's JSON-RPC port, as a rule {RPC_PORT}?"
            ) from None
        self._monitor.open()
        if s.clear_alarm and state in (_ERROR, _COLLISION):
            self.requests.deed("clearAlarm")
            self._await_cleared()
        told, heard = self.requests.joints("get_joint_pos"), self.fresh_joints()
        away = np.abs(told - heard)
        if not (away <= _SAME).all():
            joint = int(np.argmax(away))
            raise InstrumentError(
                f"{self.name}: joint {joint + 1} is at {told[joint]:.2f}° by JSON-RPC and at "
                f"{heard[joint]:.2f}° by the monitor; hold the arm still, or see monitor_angle"
            )
        if s.tolerance > 0.0:
            self._reported = self.requests.pose(
                "get_tcp_pose",
                {"coordinate_num": s.coordinate, "tool_num": s.tool, "unit_type": 0},
            )

    def state(self, powered: bool) -> DriverState:
        """Return what the monitor last told.

        Parameters
        ----------
        powered : bool
            Whether servos that are off forbid motion; before a start they may be switched on yet.
        """
        report, latched = self._monitor.newest(), self._monitor.latched
        mode, detail = self._mode(latched or report, powered or self._settings.servo == "manual")
        if latched is not None and not report.alarming:
            detail = f"{detail + ', ' if detail else ''}shown for a moment, and gone again"
        # Once, for the check against the joints; later it would be older than they are.
        reported, self._reported = self._reported, None
        busy = report.state == _PLAY
        return DriverState(report.t, mode, self._degrees(report), reported, detail, busy)

    def fresh_joints(self, patience: float | None = None) -> Floats:
        """Actual joint angles of a frame that comes from now on, degrees.

        Parameters
        ----------
        patience : float, optional
            For the frame, s.
        """
        return self._degrees(self._monitor.newest(after=self._clock.now(), patience=patience))

    def inverse(self, pose: Floats, near: Floats) -> Floats | None:
        """Joint angles of a TCP pose by the controller; None where it is not to be checked.

        Parameters
        ----------
        pose : array, shape (6,)
            mm, degrees.
        near : array, shape (6,)
            degrees.
        """
        if self._settings.tolerance == 0.0:
            return None
        params = {"targetPose": pose.tolist(), "referencePos": near.tolist(), "unit_type": 0}
        return self.requests.joints("inverseKinematic", params)

    def make_ready(self) -> None:
        """Make the controller ready for motion: remote mode, no stop, servos on, no motion left.

        Raises
        ------
        RefusedError
            It must not move: another mode, emergency stop, alarm, a program that runs, or servos
            that may not be switched on.
        InstrumentError
            It does not do what is asked.
        """
        ask, latched = self.requests, self._monitor.latched
        if latched is not None:
            shown, detail = self._mode(latched, powered=False)
            raise RefusedError(
                f"{self.name}: {shown}{f' ({detail})' if detail else ''} since it was connected; "
                "make sure that its cause is gone, and start again"
            )
        mode = ask.whole("getRobotMode", 0, _REMOTE)
        if mode != _REMOTE:
            raise RefusedError(f"{self.name}: in {_MODES[mode]} mode; turn the key to remote")
        if ask.whole("get_estop_status", 0, 1):
            raise RefusedError(f"{self.name}: emergency stop; release it and clear the alarm")
        state = ask.whole("getRobotState", _STOP, _COLLISION)
        if state not in (_STOP, _PLAY) and not (state == _PAUSE and self._settings.take_over):
            raise RefusedError(
                f"{self.name}: {_STATES[state]}; clear it on the pendant or, once its cause is "
                "gone, with clear_alarm=yes in the URL"
            )
        self._power()
        self.take_over()
        self._await_stop()

    def take_over(self) -> None:
        """End what a crash has left: a transmission, or where that is asked for another motion.

        Raises
        ------
        RefusedError
            The arm moves in it, so that it is somebody's.
        InstrumentError
            The controller does not end it.
        """
        ask = self.requests
        if ask.whole("get_transparent_transmission_state", 0, 1):
            self._refuse_moving("in a transmission of another program")
            ask.deed("tt_clear_servo_joint_buf", {"clear": 0})
            if ask.whole("get_transparent_transmission_state", 0, 1):
                raise InstrumentError(f"{self.name}: does not leave an older transmission")
            warn(f"{self.name}: took over a transmission that was left open, and emptied it")
        elif self._settings.take_over and ask.whole("getRobotState", _STOP, _COLLISION) in (
            _PLAY,
            _PAUSE,
        ):
            self._refuse_moving("by another program")
            for method in ("stop_trajectory", "stop"):
                ask.deed(method)
            warn(f"{self.name}: ended a motion that was left under way, as take_over=yes asks")

    def halt(self, *stops: tuple[str, Params]) -> None:
        """Ask for a stop in every way given, in order, on a new connection where the old is gone.

        Parameters
        ----------
        *stops : tuple of str and dict
            Methods and their parameters.

        Raises
        ------
        InstrumentError
            Not all was done, and the robot may still move.
        """
        failures = []
        for method, params in stops:
            try:
                self._over_any(method, params)
            except (InstrumentError, RefusedError) as failure:
                failures.append(failure)
        if failures and self._may_move():
            raise InstrumentError(
                f"{failures[0]}; it may still be moving: press its emergency stop"
            )

    def insist(self, method: str, params: Params) -> None:
        """Have something done that must be: on a new connection where the old one is gone.

        Raises
        ------
        InstrumentError, RefusedError
            The controller does not do it.
        """
        self._over_any(method, params)

    def poll(self) -> None:
        """Make sure that the controller could be told to stop; asks it nothing.

        Raises
        ------
        InstrumentError
            It has closed the connection.
        """
        self._client.poll()

    def halt_beside(self, *stops: tuple[str, Params]) -> None:
        """Ask for a stop on a connection of its own, while a request on the other one hangs.

        Parameters
        ----------
        *stops : tuple of str and dict
            As in `halt`.

        Raises
        ------
        InstrumentError, RefusedError
            The controller does not do it.
        """
        client = Client(self._settings.host, self._settings.port, self._settings.patience)
        try:
            client.connect()
            for method, params in stops:
                Requests(client, self.name).deed(method, params)
        finally:
            client.close()

    def close(self) -> None:
        """Disconnect; may be called twice."""
        self._client.close()
        self._monitor.close()

    def _power(self) -> None:
        """Synchronise the motors and switch the servos on, where they are not."""
        ask = self.requests
        synchronised, on = ask.yes("getMotorStatus"), ask.yes("getServoStatus")
        if synchronised and on:
            return
        if self._settings.servo == "manual":
            raise RefusedError(
                f"{self.name}: its servos are off; switch them on, or give servo=auto in the URL"
            )
        if not synchronised:
            ask.deed("syncMotorStatus")
        ask.deed("set_servo_status", {"status": 1})
        latest = self._clock.now() + _POWER_TIME
        while not (ask.yes("getServoStatus") and self._powered(self._monitor.newest())):
            if self._clock.now() > latest:
                raise InstrumentError(f"{self.name}: its servos do not come on; see its pendant")
            self._clock.sleep_until(self._clock.now() + _POWER_STEP)

    def _await_cleared(self) -> None:
        """Wait for a frame without the alarm that was cleared; what shows one later latches."""
        latest = self._clock.now() + self._settings.patience
        while self._monitor.newest(after=self._clock.now()).alarming:
            if self._clock.now() > latest:
                return  # the state says it from now on
        self._monitor.forget()

    def _await_stop(self) -> None:
        """Refuse to cut into the controller's own motion; what stops just now is waited for."""
        latest = self._clock.now() + _STOP_TIME
        while (state := self.requests.whole("getRobotState", _STOP, _COLLISION)) == _PLAY:
            if self._clock.now() > latest:
                raise RefusedError(
                    f"{self.name}: a program is running; stop it on the pendant, or, where it was "
                    "left by a crash and the arm stands, with take_over=yes in the URL"
                )
            self._clock.sleep_until(self._clock.now() + _POWER_STEP)
        if state != _STOP:
            raise RefusedError(f"{self.name}: {_STATES[state]}; clear it on the pendant")

    def _refuse_moving(self, how: str) -> None:
        """Refuse to cut into a motion: whoever left one has an arm that stands."""
        before = self.fresh_joints()
        self._clock.sleep_until(self._clock.now() + _STILL_TIME)
        turned = float(np.abs(self.fresh_joints() - before).max())
        if not turned <= _STILL:
            raise RefusedError(f"{self.name}: moves {how}; stop that, or wait for its end")

    def _powered(self, report: MonitorReport) -> bool:
        return report.servo_ready and report.motors_synchronised

    def _over_any(self, method: str, params: Params) -> None:
        """Have something done; once more on a new connection if this one is gone, or goes."""
        if self._client.connected:
            try:
                self.requests.deed(method, params)
            except InstrumentError:
                if self._client.connected:
                    raise
            else:
                return
        self._client.connect()
        self.requests.deed(method, params)

    def _may_move(self) -> bool:
        """Whether a robot that was told to stop has not, after the time that braking takes."""
        latest = self._clock.now() + _STOP_TIME
        try:
            before = self._monitor.newest()
            while True:
                self._clock.sleep_until(self._clock.now() + _STILL_TIME)
                report = self._monitor.newest()
                if self._mode(report, powered=True)[0] != "ready":
                    return False
                turned = np.abs(self._degrees(report) - self._degrees(before)).max()
                if report.state == _STOP and report.t > before.t and turned <= _STILL:
                    return False
                if self._clock.now() > latest:
                    return True
                before = report
        except InstrumentError:
            return True

    def _mode(self, report: MonitorReport, powered: bool) -> tuple[RobotMode, str]:
        """Whether the robot may move, and what there is to say of it."""
        if report.estop or report.state == _ESTOP:
            return "emergency stop", ""
        if report.collision or report.state == _COLLISION:
            return "protective stop", "it has detected a collision"
        if report.state == _ERROR:
            return "fault", "it has an alarm"
        if report.mode != _REMOTE:
            return "not ready", f"it is in {_MODES[report.mode]} mode, not in remote"
        if report.state == _PAUSE:
            return "stopped", "it is paused"
        if powered and not self._powered(report):
            return "not ready", "its servos are off"
        return "ready", ""

    def _degrees(self, report: MonitorReport) -> Floats:
        return np.degrees(report.joints) if self._settings.radians else report.joints
