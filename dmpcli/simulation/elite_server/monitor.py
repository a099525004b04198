"""The 1024 bytes that the simulated EC66 sends every 8 ms, big-endian."""

import math
import struct

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.simulation.elite_server.controller import SimulatedController
from dmpcli.simulation.elite_server.parameters import pose_numbers

PERIOD = 0.008
"""s between frames."""

MATCHING_WORD = 0xEC8056EC

SIZE = 1024

_FRAME = struct.Struct(
    ">"
    "IQB"  # size, ms since the epoch, cycle mode
    "8d6d6d8d"  # joints, TCP in base and user frame, torque
    "iii8ii"  # state, servo ready, motors may run, motor speeds, mode
    "3d5dQQ"  # analogue and digital in- and outputs
    "B6d6dB"  # collision, flange in base and user frame, emergency stop
    "d8dd8d"  # speed of TCP and joints, their accelerations
    "24d"  # joint temperature, torque, external torque; force on the TCP in tool axes
    "B220xI"  # drag state, reserved, matching word
)


_ZEROS = (0.0,) * 8


def frame(controller: SimulatedController, milliseconds: int) -> bytes:
    """Return one frame.

    The maker does not state its units; these are degrees, mm, rad and s. Accelerations, torques,
    forces, motor speeds, in- and outputs and temperatures are 0.

    Parameters
    ----------
    controller : SimulatedController
    milliseconds : int
        Since the epoch.
    """
    arm, euler = controller.arm, controller.habits.euler
    at = arm.posture
    tip = pose_numbers(at.position, at.rotation, euler)
    flange = pose_numbers(at.flange_position, at.flange_rotation, euler)
    return _FRAME.pack(
        SIZE,
        milliseconds,
        0,
        *_eight(np.degrees(arm.joints)),
        *tip,
        *tip,
        *_ZEROS,
        controller.state,
        controller.servo,
        controller.synced,
        *([0] * 8),
        controller.mode,
        *([0.0] * 8),
        0,
        0,
        controller.collision,
        *flange,
        *flange,
        controller.estop_since is not None,
        math.hypot(*at.velocity[:3].tolist()),
        *_eight(np.degrees(arm.speeds)),
        0.0,
        *_ZEROS,
        *([0.0] * 24),
        0,
        MATCHING_WORD,
    )


def _eight(six: Floats) -> list[float]:
    return [*six.tolist(), 0.0, 0.0]
