"""The simulated EC66 controller: its state, and what it does when a method is called."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError
from dmpcli.kinematics import chain, inverse
from dmpcli.simulation.elite_server.behaviour import Behaviour
from dmpcli.simulation.elite_server.joint_arm import JointArm
from dmpcli.simulation.elite_server.motions import JointPath, Transmission, joint_move, line_move
from dmpcli.simulation.elite_server.parameters import (
    BAD_PARAMS,
    FAILED,
    NO_METHOD,
    NOT_REMOTE,
    Params,
    RpcError,
    pose_row,
)
from dmpcli.simulation.elite_server.trajectory_file import TrajectoryFile
from dmpcli.spatial.pose import Pose

STOP, PAUSE, ESTOP, PLAY, ERROR, COLLISION = range(6)
"""What getRobotState answers."""

TEACH, AUTO, REMOTE = range(3)
"""What getRobotMode answers; ``AUTO`` is the mode that the maker calls play."""

# What the maker's clients ask before all else: a collaborative arm (62), an EC66 (6), joint
# coordinates (0), teaching by single steps (0), its own tool and frame, half the speed.
_IDENTITY: dict[str, Callable[[Params], Any]] = {
    "getRobotType": lambda _: 62,
    "getRobotSubtype": lambda _: 6,
    "getCurrentCoord": lambda _: 0,
    "getCycleMode": lambda _: 0,
    "getToolNumber": lambda _: 1,
    "getAutoRunToolNumber": lambda _: 1,
    "getUserNumber": lambda _: 0,
    "getSpeed": lambda _: 50.0,
}

_OUTPUTS = tuple(range(20))
"""Numbers of the digital outputs, Y0 to Y19."""

# s: the state says emergency stop only so long; get_estop_status says it for as long as it lasts.
_BRIEF = 0.5
# rad/s²: of moves at 100 % acceleration, full speed within about half a second.
_ACCELERATION = math.radians(360.0)
# mm/s² and rad/s² of straight moves.
_LINEAR, _TURNING = 1000.0, 4.0
# A servo that is nearer to its command than this has arrived, rad.
_ARRIVED = 1e-4


class SimulatedController:
    """An EC66's controller; the lab calls it with its lock held and the arm brought up to now.

    Parameters
    ----------
    arm : JointArm
    habits : Behaviour

    Attributes
    ----------
    arm : JointArm
    habits : Behaviour
    now : float
        s; the lab sets it before it calls.
    mode : int
        `REMOTE` at first.
    servo, synced : bool
        Servos on; encoders synchronised. Neither is so at first.
    collision : bool
    estop_since : float or None
        When the emergency stop was pressed; it stays so.
    alarm : str
        Why there is one; empty where there is none.
    entered : float or None
        When servo mode was first entered, s.
    refuses : bool
        Whether it takes no set-points.
    outputs : dict of int
        State of the digital outputs that were ever switched, by number.
    """

    def __init__(self, arm: JointArm, habits: Behaviour) -> None:
        self.arm, self.habits = arm, habits
        self.now = 0.0
        self.mode = REMOTE
        self.servo = self.synced = self.collision = self.refuses = self._paused = False
        self.estop_since: float | None = None
        self.entered: float | None = None
        self.alarm = ""
        self.outputs: dict[int, int] = {}
        self._transmission: Transmission | None = None
        self._acknowledges = True
        self._path: JointPath | None = None
        self._file = TrajectoryFile()
        reads: dict[str, Callable[[Params], Any]] = {
            "getRobotState": lambda _: self.state,
            "getRobotMode": lambda _: self.mode,
            "getServoStatus": lambda _: self.servo,
            "getMotorStatus": lambda _: self.synced,
            "get_estop_status": lambda _: int(self.estop_since is not None),
            "get_joint_pos": lambda _: _degrees(self.arm.joints),
            "getRobotPos": lambda _: [*_degrees(self.arm.joints), 0.0, 0.0],
            "get_tcp_pose": self._tcp_pose,
            "getRobotPose": self._tcp_pose,
            "inverseKinematic": self._inverse,
            "positiveKinematic": self._forward,
            "get_transparent_transmission_state": lambda _: int(self._transmission is not None),
            "getSoftVersion": lambda _: "virtual",
            "getOutput": lambda params: self.outputs.get(params.choice("addr", _OUTPUTS), 0),
        } | _IDENTITY
        deeds: dict[str, Callable[[Params], Any]] = {
            "set_servo_status": self._set_servo,
            "syncMotorStatus": self._synchronise,
            "clearAlarm": self._clear_alarm,
            "stop": lambda _: self.stop(),
            "pause": self._pause,
            "run": self._run,
            "setOutput": self._set_output,
            "moveByJoint": self._move_joint,
            "moveByLine": self._move_line,
            "transparent_transmission_init": self._begin_transmission,
            "tt_put_servo_joint_to_buf": self._put,
            "tt_set_current_servo_joint": self._put,
            "tt_clear_servo_joint_buf": self._clear_transmission,
            "start_push_pos": self._file.begin,
            "push_pos": self._push,
            "stop_push_pos": self._file.end,
            "check_trajectory": self._file.check,
            "start_trajectory": self._start_file,
            "pause_trajectory": self._pause,
            "stop_trajectory": lambda _: self.stop(),
            "flush_trajectory": self._file.flush,
        }
        self._methods = reads | deeds
        self._deeds = frozenset(deeds)

    def call(self, method: str, given: dict[str, Any]) -> Any:
        """Carry a method out.

        Returns
        -------
        object
            What its result is, before it is encoded; None for no answer at all.

        Raises
        ------
        RpcError
        """
        deed = self._methods.get(method)
        if deed is None:
            raise RpcError(NO_METHOD, f"Method not found: {method}")
        if method in self._deeds and self.mode != REMOTE:
            raise RpcError(NOT_REMOTE, "Can't operate, robot must be in remote mode.")
        return deed(Params(given))

    @property
    def state(self) -> int:
        """What getRobotState answers."""
        if self.estop_since is not None and self.now < self.estop_since + _BRIEF:
            return ESTOP
        if self.collision:
            return COLLISION
        if self.alarm:
            return ERROR
        if self._paused:
            return PAUSE
        return PLAY if self._transmission is not None or self._moving else STOP

    @property
    def may_move(self) -> bool:
        """Whether nothing forbids motion."""
        free = not (self.collision or self.alarm or self._paused) and self.estop_since is None
        return free and self.servo and self.mode == REMOTE

    @property
    def transmission(self) -> Transmission | None:
        """What is fed with set-points, while servo mode lasts."""
        return self._transmission

    @property
    def _moving(self) -> bool:
        """Whether a path is under way."""
        if self._path is None:
            return False
        behind = float(np.abs(self.arm.command - self.arm.joints).max())
        if self._path.finished and self.arm.idle and behind < _ARRIVED:
            self._path = None
        return self._path is not None

    def press_estop(self) -> None:
        """Press the emergency stop; the servos go off."""
        if self.estop_since is None:
            self.estop_since = self.now
            self.stop()
            self.servo = False

    def collide(self) -> None:
        """Detect a collision: the arm stands until the alarm is cleared."""
        self.collision = True
        self.stop()

    def switch(self, mode: int) -> None:
        """Turn the key; out of remote mode the arm stands."""
        self.mode = mode
        if mode != REMOTE:
            self.stop()

    def raise_alarm(self, text: str) -> None:
        """Stop with an error; the servos go off."""
        self.alarm = text
        self.stop()
        self.servo = False

    def stop(self) -> bool:
        """Stand still at once and leave every motion."""
        self.arm.stand_still()
        self._transmission = self._path = None
        self._paused = False
        return True

    def _set_servo(self, params: Params) -> bool:
        wanted = bool(params.choice("status", (0, 1)))
        if wanted and not (self.synced and self.estop_since is None and not self.alarm):
            return False
        if not wanted:
            self.stop()
        self.servo = wanted
        return True

    def _set_output(self, params: Params) -> bool:
        self.outputs[params.choice("addr", _OUTPUTS)] = params.choice("status", (0, 1))
        return True

    def _synchronise(self, _: Params) -> bool:
        if self.alarm or self.collision or self.estop_since is not None:
            return False
        self.synced = True
        return True

    def _clear_alarm(self, _: Params) -> bool:
        if self.estop_since is not None:
            return False
        self.alarm, self.collision = "", False
        return True

    def _pause(self, _: Params) -> bool:
        if not self._moving:
            return False
        self.arm.feed = None
        self.arm.end_leg()
        self._paused = True
        return True

    def _run(self, _: Params) -> bool:
        if not (self._paused and self._path is not None):
            return False
        self._paused = False
        self.arm.feed = self._path.feed
        return True

    def _tcp_pose(self, params: Params) -> list[float]:
        params.number("coordinate_num", -1, 7, -1)
        # Tool 0 is the bare flange; every other number is the tool that the arm carries.
        flange = params.number("tool_num", -1, 7, -1) == 0
        degrees = params.choice("unit_type", (0, 1), 1) == 0
        at = self.arm.posture
        place = (at.flange_position, at.flange_rotation) if flange else (at.position, at.rotation)
        return _plain(pose_row(*place, self.habits.euler, degrees))

    def _inverse(self, params: Params) -> list[float]:
        degrees = params.choice("unit_type", (0, 1), 1) == 0
        near = params.joints("referencePos") if params.has("referencePos") else self.arm.joints
        return _degrees(self._joints_of_pose(params, "targetPose", near, degrees))

    def _forward(self, params: Params) -> list[float]:
        degrees = params.choice("unit_type", (0, 1), 1) == 0
        flange = chain.forward(self.arm.model, params.joints("targetPos"))
        tcp = flange @ Pose(self.arm.tool.tcp_position, self.arm.tool.tcp_rotation)
        return _plain(pose_row(tcp.position, tcp.rotation, self.habits.euler, degrees))

    def _joints_of_pose(
        self, params: Params, name: str, near: Floats, degrees: bool = False
    ) -> Floats:
        flange = self.arm.tool.flange(params.pose(name, degrees, self.habits.euler))
        try:
            return inverse.nearest(self.arm.model, flange, near)
        except RefusedError as error:
            raise RpcError(FAILED, str(error)) from None

    def _allowed(self, joints: Floats) -> bool:
        low, high = self.arm.model.limits.T
        return bool(np.all((low <= joints) & (joints <= high)))

    def _move_joint(self, params: Params) -> bool:
        goal = params.joints("targetPos")
        speed = params.number("speed", 0.01, 100.0) / 100.0 * self.arm.model.speeds
        # The maker's two percentages; a trapezoid with even sides takes the smaller.
        gain = min(params.number("acc", 1, 100, 50), params.number("dec", 1, 100, 50)) / 100.0
        if not (self._ready_for_motion and self._allowed(goal)):
            return False
        self._go(joint_move(self.arm.command, goal, speed, np.full(6, gain * _ACCELERATION)))
        return True

    def _move_line(self, params: Params) -> bool:
        goal = params.joints("targetPos")
        turning = params.choice("speed_type", (0, 1, 2, 3), 0) in (1, 3)
        speed = params.number("speed", 1, 300 if turning else 3000)
        if not (self._ready_for_motion and self._allowed(goal)):
            return False
        bounds = (math.radians(speed), _TURNING) if turning else (speed, _LINEAR)
        try:
            self._go(line_move(self.arm.model, self.arm.command, goal, *bounds, turning))
        except RefusedError as error:
            raise RpcError(FAILED, str(error)) from None
        return True

    @property
    def _ready_for_motion(self) -> bool:
        return self.may_move and self._transmission is None and not self._moving

    def _go(self, path: JointPath) -> None:
        self._path = path
        self.arm.feed = path.feed

    def _begin_transmission(self, params: Params) -> bool:
        lookahead = 1e-3 * params.number("lookahead", 10, 1000)
        period = 1e-3 * params.number("t", 2, 100)
        params.number("smoothness", 0, 1, 0)
        self._acknowledges = bool(params.choice("response_enable", (0, 1), 1))
        if lookahead < period:
            raise RpcError(BAD_PARAMS, "lookahead: must not be shorter than t")
        if not self._ready_for_motion:
            return False
        self._transmission = Transmission(
            lookahead, period, self.arm.model.speeds, self.habits.policies, self.raise_alarm
        )
        self.arm.feed = self._transmission.feed
        self._enter()
        return True

    def _put(self, params: Params) -> bool | None:
        taken = self._take(params)
        return taken if self._acknowledges else None

    def _take(self, params: Params) -> bool:
        buffer = self._transmission
        if buffer is None or self.refuses:
            return False
        if params.has("targetPose"):
            joints = self._joints_of_pose(params, "targetPose", self.arm.command)
        else:
            joints = params.joints("targetPos")
        if not self._allowed(joints):
            self.raise_alarm("a point of transparent transmission is beyond a joint's limit")
            return False
        return buffer.put(joints, self.arm.command)

    def _clear_transmission(self, _: Params) -> bool:
        if self._transmission is not None:
            self.stop()
        return True

    def _enter(self) -> None:
        self.entered = self.now if self.entered is None else self.entered

    def _push(self, params: Params) -> bool:
        near = self._file.last if self._file.last is not None else self.arm.joints
        return self._file.push(params, lambda name: self._joints_of_pose(params, name, near))

    def _start_file(self, params: Params) -> bool:
        share = params.number("speed_percent", 0.1, 100.0, 100.0) / 100.0
        if not self._ready_for_motion or self._file.verdict() != 0:
            return False
        times, joints = self._file.times / share, self._file.joints
        if not all(map(self._allowed, joints)):
            self.raise_alarm("a point of the trajectory is beyond a joint's limit")
            return False
        if self.habits.policies.jump != "clamp" and self._jumps(times, joints):
            if self.habits.policies.jump == "alarm":
                self.raise_alarm("the trajectory jumps")
            return False
        self._go(JointPath(times, joints, self.arm.model.speeds))
        self._enter()
        return True

    def _jumps(self, times: Floats, joints: Floats) -> bool:
        """Whether the arm stands elsewhere than the file begins, or a step is too fast."""
        away = float(np.abs(joints[0] - self.arm.joints).max())
        speeds = np.abs(np.diff(joints, axis=0)) / np.diff(times)[:, None]
        return away > math.radians(1.0) or bool(np.any(speeds > self.arm.model.speeds * (1 + 1e-9)))


def _degrees(joints: Floats) -> list[float]:
    return _plain(np.degrees(joints))


def _plain(row: Floats) -> list[float]:
    """Numbers to 1e-6: a reply must stay below the 1024 bytes that its clients read."""
    return [round(float(value), 6) for value in row]
