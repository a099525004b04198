"""Strokes in closed form that the tests write and read."""

import numpy as np
from scipy.spatial.transform import Rotation

from dmpcli.formats.motion import Motion, MotionStroke


def wave(samples=201, seconds=4.0, offset=0.0, name="1", turning=True):
    """A wave of 110 x 48 mm whose tool leans and turns on the way."""
    s = np.linspace(0.0, 1.0, samples)
    position = np.column_stack(
        [500.0 + 110.0 * s + offset, 24.0 * np.sin(2 * np.pi * s), 30.0 + 3.0 * np.cos(5 * s)]
    )
    lean = 0.3 * np.sin(4 * s) if turning else np.zeros(samples)
    R = Rotation.from_euler("XYZ", np.column_stack([np.pi - lean, 0.5 * lean, lean + 0.4 * s]))
    if not turning:
        R = Rotation.from_euler("XYZ", np.tile([np.pi, 0.0, 0.3], (samples, 1)))
    return MotionStroke(seconds * s**1.2, position, R.as_matrix(), id=name)


def motion(*strokes):
    return Motion("wave.parquet", "trajectory", list(strokes) or [wave()])


def angle_between(A, B):
    """Angles between two stacks of rotations, rad, by scipy."""
    return (Rotation.from_matrix(A).inv() * Rotation.from_matrix(B)).magnitude()


def along(t, stroke):
    """Position and rotation of a stroke at other times, by scipy's Slerp."""
    from scipy.spatial.transform import Slerp

    t = np.clip(t, stroke.t[0], stroke.t[-1])
    position = np.column_stack([np.interp(t, stroke.t, axis) for axis in stroke.position.T])
    if stroke.rotation is None:
        return position, None
    return position, Slerp(stroke.t, Rotation.from_matrix(stroke.rotation))(t).as_matrix()
