"""The bench itself: set-points of the joints go in, poses and wrenches come out; no clock.

The physics goes on by steps of its own, on a grid that begins with the world. Between them nothing
happens: what is asked of a time between two steps is that of the last one.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np

from dmpcli import extras
from dmpcli.admittance.compensation import Compensation
from dmpcli.arrays import Floats
from dmpcli.bench import scene
from dmpcli.bench.joint_servos import JointReference
from dmpcli.bench.links import arms, published
from dmpcli.bench.parameters import FASTEST, BenchParameters
from dmpcli.bench.truth import Truth
from dmpcli.bench.workpiece import Traced
from dmpcli.errors import InputError, RefusedError
from dmpcli.kinematics import chain, inverse
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

Vector: TypeAlias = tuple[float, float, float]
"""What a step works with: arrays of three cost ten times as much."""
_NONE: Vector = (0.0, 0.0, 0.0)


class World:
    """An arm with a compliant pen, and a workpiece.

    Parameters
    ----------
    parameters : BenchParameters, optional

    Attributes
    ----------
    parameters : BenchParameters
    links : Links
        What the arm weighs.
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
        if parameters.arm not in arms():
            raise InputError(f"bench: no arm {parameters.arm!r}; it has {', '.join(arms())}")
        self.links = parameters.links or published(parameters.arm)
        self.arm = self.links.arm
        self._model = scene.build(parameters, self.links, self._mujoco)
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
        self._drift = parameters.sensor.drift
        self._drifts = bool(self._drift.any())
        self._planned, self._torque = np.zeros(self._model.nv), np.zeros(self._model.nv)
        self._velocity = np.zeros(6)
        self._pushing = self._rubbing = _NONE
        self._touching = self._rubs = False
        self._look_at(self._data)
        workpiece = parameters.workpiece
        self._traced = workpiece if isinstance(workpiece, Traced) else None
        if self._traced is not None:
            self._trace(self._traced)
            self._mujoco.mj_forward(self._model, self._data)

    def _look_at(self, data: Any) -> None:
        """Keep MuJoCo's arrays themselves at hand: in each step they would be wrapped anew."""
        self._angles, self._rates = data.qpos[:6], data.qvel[:6]
        self._biases, self._applied = data.qfrc_bias[:6], data.qfrc_applied[:6]
        self._slid = data.qpos[6:7]
        self._site, self._axes = data.site_xpos[self._tcp], data.site_xmat[self._tcp]
        self._centre, self._extra = data.geom_xpos[self._tip], data.xfrc_applied[self._pen]
        self._pull, self._drag = np.empty(6), np.empty(6)

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
        return np.array(self._end())

    @property
    def compression(self) -> float:
        """How far the pen has been pushed in, mm."""
        return 1e3 * float(self._data.qpos[6])

    @property
    def contact_force(self) -> Floats:
        """What the workpiece truly does to the pen, shape (3,), N, base axes."""
        return np.array(_sum(self._pushing, self._rubbing))

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
        zero = self._bias + self.t * self._drift if self._drifts else self._bias
        return self.felt() + zero + next(self._noise)

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
        pull, drag = self._pull, self._drag
        np.subtract(position, self._angles, out=pull)
        pull *= self._stiffness
        np.subtract(velocity, self._rates, out=drag)
        drag *= self._damping
        pull += drag
        pull += self._torque[:6]
        np.add(pull, self._biases, out=self._applied)
        mujoco.mj_step2(model, data)
        # Before the next contacts are found, to which these forces would not belong.
        self._feel_contacts()
        if self._traced is not None:
            mujoco.mj_kinematics(model, data)
            self._trace(self._traced)
        mujoco.mj_step1(model, data)
        self._steps += 1
        if self.truth is not None:
            push = math.hypot(*self._pushing)
            force = _sum(self._pushing, self._rubbing)
            self.truth.add(self.t, self._setpoints, self._end(), force, push)

    def _end(self) -> Vector:
        """Where the end of the pen truly is, mm."""
        slid = 1e3 * self._slid.item()
        axes, site = self._axes.tolist(), self._site.tolist()
        return (
            1e3 * site[0] - slid * axes[2],
            1e3 * site[1] - slid * axes[5],
            1e3 * site[2] - slid * axes[8],
        )

    def _feel_contacts(self) -> None:
        """Add up what the contacts push with, and rub with it during the next step."""
        data = self._data
        count = data.ncon
        self._touching = count > 0
        if not count:
            if self._rubs:
                self._pushing, self._rubbing, self._rubs = _NONE, _NONE, False
                self._extra[:] = 0.0
            return
        mujoco, model = self._mujoco, self._model
        mujoco.mj_objectVelocity(
            model, data, mujoco.mjtObj.mjOBJ_GEOM, self._tip, self._velocity, 0
        )
        motion = self._velocity.tolist()
        spin, speed = motion[:3], motion[3:]
        centre = self._centre.tolist()
        pushing = rubbing = torque = _NONE
        # Of a contact without MuJoCo's friction the one force is the push.
        forces = data.efc_force
        for i in range(count):
            contact = data.contact[i]
            at = contact.efc_address
            if at < 0:
                continue
            # The frame's first row is the normal, from the first geom to the second.
            push = forces[at].item()
            side = 1.0 if contact.geom2 == self._tip else -1.0
            x, y, z = contact.frame[:3].tolist()
            normal = (side * x, side * y, side * z)
            px, py, pz = contact.pos.tolist()
            lever = (px - centre[0], py - centre[1], pz - centre[2])
            rub = self._rub(push, normal, _sum(speed, _cross(spin, lever)))
            pushing = _sum(pushing, (push * normal[0], push * normal[1], push * normal[2]))
            rubbing = _sum(rubbing, rub)
            torque = _sum(torque, _cross(lever, rub))
        self._pushing, self._rubbing, self._rubs = pushing, rubbing, True
        # MuJoCo takes it at the body's centre of mass, the middle of the tip.
        self._extra[:] = (*rubbing, *torque)

    def _rub(self, push: float, normal: Vector, speed: Vector) -> Vector:
        """Coulomb's friction of one contact, N; speed in m/s."""
        away = speed[0] * normal[0] + speed[1] * normal[1] + speed[2] * normal[2]
        x, y, z = (a - away * b for a, b in zip(speed, normal, strict=True))
        friction = self.parameters.pen.friction * push
        full = max(_SLIDING, friction * self._step / _SLIDING_MASS)
        share = -friction / max(math.hypot(x, y, z), full)
        return (share * x, share * y, share * z)

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


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _sum(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
