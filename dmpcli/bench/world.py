"""The bench itself: set-points of the joints go in, poses and wrenches come out; no clock.

The physics goes on by steps of its own, on a grid that begins with the world. Between them nothing
happens: what is asked of a time between two steps is that of the last one.
"""

import math
from collections.abc import Iterator

import numpy as np

from dmpcli import extras
from dmpcli.admittance.compensation import Compensation
from dmpcli.arrays import Floats
from dmpcli.bench import scene
from dmpcli.bench.joint_servos import JointReference
from dmpcli.bench.parameters import FASTEST, BenchParameters
from dmpcli.bench.truth import Truth
from dmpcli.bench.workpiece import Traced
from dmpcli.errors import InputError, RefusedError
from dmpcli.kinematics import chain, inverse
from dmpcli.kinematics.models import model
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import to_quaternion

_EPS = 1e-6  # of a step: rounding
# Speed from which a pen rubs in full, m/s; below, in proportion. Where the push is so hard that
# within a step friction would turn the slide of this mass about, the speed is higher.
_SLIDING = 2e-3
_SLIDING_MASS = 1.0  # kg
_AWAY = (0.0, 0.0, -10.0)  # m: beyond a mesh's border there is nothing to touch
# Of the postures that reach the start the one nearest to this, elbow up and tool down, rad.
_READY = {
    "ec66": np.radians([0.0, -110.0, -110.0, -50.0, -90.0, 90.0]),
    "ur5e": np.radians([0.0, -90.0, -90.0, -90.0, 90.0, 0.0]),
}
# Readings whose noise is drawn at once.
_DRAWN = 256


class World:
    """An arm with a compliant pen, and a workpiece.

    Parameters
    ----------
    parameters : BenchParameters, optional

    Attributes
    ----------
    parameters : BenchParameters
    arm : Arm
        Its kinematics.
    t : float
        How far the physics has come, s, from 0.
    reference : JointReference
        Where the servos lead the joints to.
    truth : Truth or None
        What happened, where the parameters ask for it.

    Raises
    ------
    InputError
        MuJoCo is not installed; there is no such arm.
    RefusedError
        The arm does not reach where it shall stand.
    """

    def __init__(self, parameters: BenchParameters | None = None) -> None:
        self.parameters = parameters = parameters or BenchParameters()
        self._step = parameters.grid
        self._setpoints = 0
        self.truth = Truth() if parameters.truth is not None else None
        if parameters.pen.pace * self._step > FASTEST:
            raise InputError(
                f"bench: a step of {self._step:g} s is too long for a pen of "
                f"{parameters.pen.stiffness:g} N/mm and {parameters.pen.mass:g} kg, which would "
                f"rattle by itself; take at most {FASTEST / parameters.pen.pace:.2g} s"
            )
        (self._mujoco,) = extras.load(extras.BENCH, "bench", "mujoco")
        if parameters.arm not in scene.arms():
            raise InputError(f"bench: no arm {parameters.arm!r}; it has {', '.join(scene.arms())}")
        self.arm = model(parameters.arm)
        self._model = scene.build(parameters, self.arm, self._mujoco)
        self._data = self._mujoco.MjData(self._model)
        self._steps = 0
        joints = self.joints_of(Pose(parameters.position, parameters.rotation), self._ready())
        servos = parameters.servos
        self.reference = JointReference(joints, servos.lag, servos.delay, self._step)
        self._data.qpos[:6] = joints
        self._mujoco.mj_forward(self._model, self._data)
        inertia = np.zeros((self._model.nv, self._model.nv))
        self._mujoco.mj_fullM(self._model, self._data, inertia)
        # Critical for each joint by itself.
        self._stiffness = servos.stiffness
        self._damping = 2.0 * np.sqrt(servos.stiffness * np.diag(inertia)[:6])
        self._tip, self._pen = self._model.geom("tip").id, self._model.body("pen").id
        self._tcp = self._model.site("tcp").id
        self._noise = self._drawn()
        self._compensate = Compensation(parameters.tool)
        # A zero of None is a sensor that reads 0 with nothing on it.
        zero = parameters.tool.zero
        self._bias = parameters.sensor.bias + (0.0 if zero is None else zero)
        self._planned, self._torque = np.zeros(self._model.nv), np.zeros(self._model.nv)
        self._force, self._velocity = np.zeros(6), np.zeros(6)
        self._pushing, self._rubbing = np.zeros(3), np.zeros(3)
        self._touching = self._rubs = False
        workpiece = parameters.workpiece
        self._traced = workpiece if isinstance(workpiece, Traced) else None
        if self._traced is not None:
            self._trace(self._traced)
            self._mujoco.mj_forward(self._model, self._data)

    def _ready(self) -> Floats:
        """The usual posture, turned to where the arm shall stand."""
        ready = _READY[self.parameters.arm].copy()
        flange, _ = chain.forward_one(self.arm, ready)
        at = self.parameters.position
        ready[0] += np.arctan2(at[1], at[0]) - np.arctan2(flange[1], flange[0])
        ready[0] = np.remainder(ready[0] + np.pi, 2.0 * np.pi) - np.pi
        return ready

    @property
    def t(self) -> float:
        """How far the physics has come, s."""
        return self._steps * self._step

    @property
    def joints(self) -> Floats:
        """Actual joint angles, shape (6,), rad."""
        angles: Floats = self._data.qpos[:6].copy()
        return angles

    @property
    def speeds(self) -> Floats:
        """Actual speeds of the joints, shape (6,), rad/s."""
        found: Floats = self._data.qvel[:6].copy()
        return found

    @property
    def pose(self) -> Pose:
        """Actual pose of the TCP, by the joints: the end of the pen as if nothing pressed it."""
        data, rotation = self._data, self._data.site_xmat[self._tcp].reshape(3, 3)
        return Pose(1e3 * data.site_xpos[self._tcp], rotation.copy())

    @property
    def tip(self) -> Floats:
        """Where the end of the pen truly is, shape (3,), mm."""
        pose = self.pose
        end: Floats = pose.position - self.compression * pose.rotation[:, 2]
        return end

    @property
    def compression(self) -> float:
        """How far the pen has been pushed in, mm."""
        return 1e3 * float(self._data.qpos[6])

    @property
    def contact_force(self) -> Floats:
        """What the workpiece truly does to the pen, shape (3,), N, base axes."""
        return self._pushing + self._rubbing

    @property
    def touching(self) -> bool:
        """Whether the pen touches the workpiece."""
        return self._touching

    @property
    def compliance(self) -> Floats:
        """By how much the arm alone gives way at the TCP, shape (3, 3), mm/N, base axes."""
        J = np.zeros((3, self._model.nv))
        self._mujoco.mj_jacSite(self._model, self._data, J, None, self._tcp)
        found: Floats = 1e3 * (J[:, :6] / self._stiffness) @ J[:, :6].T
        return found

    def series_stiffness(self, normal: Floats) -> float:
        """Stiffness of pen and arm one after the other along a unit normal, N/mm."""
        arm = float(normal @ self.compliance @ normal)
        along = float(normal @ self.pose.rotation[:, 2]) ** 2
        return 1.0 / (along / self.parameters.pen.stiffness + arm)

    def joints_of(self, pose: Pose, near: Floats) -> Floats:
        """Joint angles of a pose of the TCP, shape (6,), rad; nearest to `near`.

        Raises
        ------
        RefusedError
            Out of reach, or beyond a joint's limit.
        """
        flange, rotation = self.parameters.tool.flange(pose.position, pose.rotation)
        return inverse.nearest(self.arm, flange, rotation, near)

    def start(self, period: float) -> None:
        """Take one set-point every `period` s from now on."""
        self.reference.start(period)

    def send(self, joints: Floats) -> None:
        """Head for joint angles, shape (6,), rad."""
        self.reference.send(self.t, joints)
        self._setpoints += 1

    def stand_still(self) -> None:
        """Hold the joints where they are."""
        self.reference.hold(self.joints)

    def advance(self, t: float) -> None:
        """Go on to the last step of the physics until `t`, s.

        Raises
        ------
        RefusedError
            The physics breaks down.
        """
        left = math.floor(t / self._step + _EPS) - self._steps
        while left > 0:
            motion = self.reference.advance(self.t, left)
            for position, velocity, acceleration in zip(*motion, strict=True):
                self._go_on(position, velocity, acceleration)
            left -= len(motion.position)
            if not np.isfinite(self._data.qpos).all() or self._data.warning.number.any():
                raise RefusedError(
                    f"bench: the physics breaks down at {self.t:.3f} s; take a shorter step"
                )

    def step(self, dt: float, setpoint: Pose | None = None) -> tuple[Pose, Floats]:
        """Lead the TCP towards a set-point for `dt` s, as a loop of that period does.

        Parameters
        ----------
        dt : float
            s; a whole number of the physics' steps.
        setpoint : Pose, optional
            Of the TCP, mm. None: the last one stays.

        Returns
        -------
        Pose
            Of the TCP, by the joints.
        array, shape (6,)
            The wrench on the tool at the TCP as it is measured with the tool known, base axes, N
            and N·m.

        Raises
        ------
        RefusedError
            The set-point is out of reach.
        """
        if setpoint is not None:
            self.start(dt)
            self.send(self.joints_of(setpoint, self.reference.position))
        self.advance(self.t + dt)
        pose = self.pose
        return pose, self._compensate(self.sensed(), pose.rotation)

    def sensed(self) -> Floats:
        """Take one reading of the sensor, shape (6,), N and N·m, in its axes; with its noise."""
        return self.felt() + self._bias + next(self._noise)

    def felt(self) -> Floats:
        """What truly acts on the tool at the sensor, shape (6,), N and N·m, its weight with it."""
        # MuJoCo's is what the tool does to the flange, turned about: the flange's hold on it.
        wrench: Floats = -self._data.sensordata[:6]
        return wrench

    def _go_on(self, position: Floats, velocity: Floats, acceleration: Floats) -> None:
        """Take one step of the physics with the servos' reference at its end."""
        mujoco, data, model = self._mujoco, self._data, self._model
        # What moves the arm as planned and holds its weight is fed forward; a load bends it.
        self._planned[:6] = acceleration
        mujoco.mj_mulM(model, data, self._torque, self._planned)
        data.qfrc_applied[:6] = (
            self._torque[:6]
            + data.qfrc_bias[:6]
            + self._stiffness * (position - data.qpos[:6])
            + self._damping * (velocity - data.qvel[:6])
        )
        mujoco.mj_step2(model, data)
        # Before the next contacts are found, to which these forces would not belong.
        self._feel_contacts()
        if self._traced is not None:
            mujoco.mj_kinematics(model, data)
            self._trace(self._traced)
        mujoco.mj_step1(model, data)
        self._steps += 1
        if self.truth is not None:
            push = float(np.linalg.norm(self._pushing))
            self.truth.add(self.t, self._setpoints, self.tip, self.contact_force, push)

    def _feel_contacts(self) -> None:
        """Add up what the contacts push with, and rub with it during the next step."""
        data = self._data
        self._touching = data.ncon > 0
        if not self._touching:
            if self._rubs:
                self._pushing, self._rubbing, self._rubs = np.zeros(3), np.zeros(3), False
                data.xfrc_applied[self._pen] = 0.0
            return
        mujoco, model = self._mujoco, self._model
        mujoco.mj_objectVelocity(
            model, data, mujoco.mjtObj.mjOBJ_GEOM, self._tip, self._velocity, 0
        )
        spin, speed = self._velocity[:3].tolist(), self._velocity[3:].tolist()
        centre = data.geom_xpos[self._tip].tolist()
        pushing, rubbing, torque = np.zeros(3), np.zeros(3), np.zeros(3)
        for i in range(data.ncon):
            contact = data.contact[i]
            mujoco.mj_contactForce(model, data, i, self._force)
            # The frame's first row is the normal, from the first geom to the second.
            side = 1.0 if contact.geom2 == self._tip else -1.0
            normal = [side * value for value in contact.frame[:3].tolist()]
            lever = [a - b for a, b in zip(contact.pos.tolist(), centre, strict=True)]
            push = float(self._force[0])
            rub = self._rub(push, normal, _sum(speed, _cross(spin, lever)))
            pushing += [push * value for value in normal]
            rubbing += rub
            torque += _cross(lever, rub)
        self._pushing, self._rubbing, self._rubs = pushing, rubbing, True
        # MuJoCo takes it at the body's centre of mass, the middle of the tip.
        data.xfrc_applied[self._pen, :3], data.xfrc_applied[self._pen, 3:] = rubbing, torque

    def _rub(self, push: float, normal: list[float], speed: list[float]) -> list[float]:
        """Coulomb's friction of one contact, N; speed in m/s."""
        away = sum(a * b for a, b in zip(speed, normal, strict=True))
        along = [a - away * b for a, b in zip(speed, normal, strict=True)]
        friction = self.parameters.pen.friction * push
        full = max(_SLIDING, friction * self._step / _SLIDING_MASS)
        share = -friction / max(math.hypot(*along), full)
        return [share * value for value in along]

    def _trace(self, workpiece: Traced) -> None:
        """Lay the plane that stands for the surface under the tip."""
        data = self._data
        below = workpiece.under(1e3 * data.geom_xpos[self._tip])
        if below is None:
            data.mocap_pos[0] = _AWAY
            return
        data.mocap_pos[0] = 1e-3 * below.position
        data.mocap_quat[0] = np.roll(to_quaternion(below.rotation), 1)

    def _drawn(self) -> Iterator[Floats]:
        rng = np.random.default_rng([self.parameters.seed, 0xBE])
        while True:
            yield from self.parameters.sensor.noise * rng.standard_normal((_DRAWN, 6))


def _cross(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _sum(a: list[float], b: list[float]) -> list[float]:
    return [x + y for x, y in zip(a, b, strict=True)]
