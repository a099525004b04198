"""The bench behind the virtual lab's controller: ``simulate --physics mujoco``."""

from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.bench.parameters import BenchParameters, JointServos, Pen, WristSensor
from dmpcli.bench.workpiece import Flat, Nothing, Traced, placed
from dmpcli.bench.world import World
from dmpcli.errors import InputError
from dmpcli.kinematics.models import model
from dmpcli.simulation.elite_server.joint_arm import FeelingArm
from dmpcli.simulation.elite_server.lab import ROBOT_MODEL, LabParameters
from dmpcli.simulation.elite_server.workpiece import SpringWorkpiece
from dmpcli.simulation.mock.contact import Solid
from dmpcli.simulation.mock.parameters import Plate
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane

# The controller takes a joint for arrived within 1e-4 rad: a pressed pen must not hold it off.
_STIFFER = 5.0


class BenchArm(FeelingArm):
    """Six joints that are led like those of a `JointArm`, and bend under what the pen meets.

    Parameters
    ----------
    setting : LabParameters
        The part's stiffness is that of the pen here, its friction the pen's; its damping is the
        bench's own.
    joints : array, shape (6,)
        Where it stands at first, rad.

    Raises
    ------
    InputError
        MuJoCo is not installed; or the part is touched from inside.
    """

    def __init__(self, setting: LabParameters, joints: Floats) -> None:
        servos = JointServos()
        ground = setting.ground
        pen = Pen() if ground is None else Pen(ground.stiffness, friction=ground.friction)
        self._world = World(
            BenchParameters(
                arm=ROBOT_MODEL,
                position=setting.position,
                rotation=setting.rotation,
                # Zero, noise and drift are the lab's sensor's.
                tool=setting.tool.with_zero(None),
                pen=pen,
                servos=replace(servos, lag=setting.lag, stiffness=_STIFFER * servos.stiffness),
                sensor=WristSensor(noise=np.zeros(6)),
                workpiece=_solid(ground),
            )
        )
        self._t = 0.0
        super().__init__(model(ROBOT_MODEL), setting.tool, joints, setting.lag)

    def felt(self) -> Floats:
        """What acts on the tool at the sensor; see `FeelingArm`."""
        return self._world.felt()

    def stand_still(self) -> None:
        """Hold the actual joints from now on."""
        self._world.stand_still()
        super().stand_still()

    def _follow(self, dt: float, rate: Floats) -> None:  # noqa: ARG002
        self._t += dt
        self._world.reference.lead(self.command, dt)
        self._world.advance(self._t)
        self.joints = self._world.joints
        self._moved(self._world.speeds)


def _solid(ground: Solid | None) -> Nothing:
    """The part as the bench collides it."""
    if isinstance(ground, Plate):
        across = np.eye(3)[0] if abs(ground.normal[0]) < 0.9 else np.eye(3)[1]
        return Flat(placed(ground.point, ground.normal, across))
    if not isinstance(ground, SpringWorkpiece):
        return Nothing()
    shape = ground.surface
    if ground.sign < 0.0:
        if isinstance(shape, Plane):
            shape = Plane(shape.point, -shape.normal)
        elif isinstance(shape, Mesh):
            shape = Mesh(shape.V, shape.F[:, ::-1])
        else:
            raise InputError("--physics mujoco: the part is touched from inside; give it as a mesh")
    return Traced(shape=shape)
