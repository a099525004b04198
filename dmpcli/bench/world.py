"""The bench itself: set-points of the joints go in, poses and wrenches come out; no clock.

The physics goes on by steps of its own, on a grid that begins with the world. Between them nothing
happens: what is asked of a time between two steps is that of the last one.
"""

from collections.abc import Iterator

import numpy as np

from dmpcli import extras
from dmpcli.admittance.compensation import Compensation
from dmpcli.arrays import Floats
from dmpcli.bench import scene
from dmpcli.bench.joint_servos import JointReference
from dmpcli.bench.parameters import FASTEST, BenchParameters
from dmpcli.errors import InputError, RefusedError
from dmpcli.kinematics import chain, inverse
from dmpcli.kinematics.models import model
from dmpcli.spatial.pose import Pose

_EPS = 1e-9
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
        self._tip = self._model.geom("tip").id
        self._tcp = self._model.site("tcp").id
        self._noise = self._drawn()
        self._compensate = Compensation(parameters.tool)
        # A zero of None is a sensor that reads 0 with nothing on it.
        zero = parameters.tool.zero
        self._bias = parameters.sensor.bias + (0.0 if zero is None else zero)
        self._feed_forward, self._force = np.zeros(self._model.nv), np.zeros(6)
        self._lead()

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
        total = np.zeros(3)
        for i in range(self._data.ncon):
            contact = self._data.contact[i]
            self._mujoco.mj_contactForce(self._model, self._data, i, self._force)
            # Rows of the frame are its axes; the force is that on the second geom.
            force = contact.frame.reshape(3, 3).T @ self._force[:3]
            total += force if contact.geom2 == self._tip else -force
        return total

    @property
    def touching(self) -> bool:
        """Whether the pen touches the workpiece."""
        return bool(self._data.ncon)

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

    def stand_still(self) -> None:
        """Hold the joints where they are."""
        self.reference.position = self.joints
        self.reference.stand_still()

    def advance(self, t: float) -> None:
        """Go on to the last step of the physics until `t`, s."""
        while (self._steps + 1) * self._step <= t + _EPS:
            self._go_on()

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

    def _go_on(self) -> None:
        mujoco, data, model = self._mujoco, self._data, self._model
        self.reference.advance(self.t)
        self._lead()
        mujoco.mj_step2(model, data)
        mujoco.mj_step1(model, data)
        # Sensors of the accelerations belong to the step that has been taken.
        self._steps += 1
        if not np.isfinite(data.qpos).all() or data.warning.number.any():
            raise RefusedError(
                f"bench: the physics breaks down at {self.t:.3f} s; take a shorter step"
            )

    def _lead(self) -> None:
        """Set the torques of the servos: what moves the arm as planned, and what holds it there."""
        data, reference = self._data, self.reference
        acceleration = self._feed_forward
        acceleration[:6] = reference.acceleration
        torque = np.zeros(self._model.nv)
        self._mujoco.mj_mulM(self._model, data, torque, acceleration)
        holding = self._stiffness * (reference.position - data.qpos[:6])
        braking = self._damping * (reference.velocity - data.qvel[:6])
        data.qfrc_applied[:6] = torque[:6] + data.qfrc_bias[:6] + holding + braking

    def _drawn(self) -> Iterator[Floats]:
        rng = np.random.default_rng([self.parameters.seed, 0xBE])
        while True:
            yield from self.parameters.sensor.noise * rng.standard_normal((_DRAWN, 6))
