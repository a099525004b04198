"""Reference strokes: positions over time, with minimum-jerk timing from rest to rest."""

import numpy as np

from dmpcli.arrays import Floats


def minimum_jerk(t: Floats, duration: float) -> Floats:
    """Share of the way covered, ``s = 10 r³ - 15 r⁴ + 6 r⁵`` with r = t / duration.

    The movement of least jerk from rest to rest (T. Flash, N. Hogan: The coordination of arm
    movements. Journal of Neuroscience 5 (1985) 1688-1703).

    Parameters
    ----------
    t : array, shape (T,)
        s; before 0 the share is 0, after `duration` it is 1.
    duration : float
        s.

    Returns
    -------
    array, shape (T,)
    """
    r = np.clip(np.asarray(t, dtype=float) / duration, 0.0, 1.0)
    return r**3 * (10.0 - 15.0 * r + 6.0 * r**2)


def directions(start: Floats, goal: Floats, normal: Floats) -> tuple[Floats, Floats]:
    """Unit vectors along and across a stroke: u towards the goal, v = n × u.

    Parameters
    ----------
    start, goal : array, shape (3,)
        Apart from each other, mm.
    normal : array, shape (3,)
        On the tool's side of the plate, not along the stroke; only its part square to u matters.

    Returns
    -------
    tuple of array, shape (3,)
    """
    along = np.subtract(goal, start)
    across = np.cross(normal, along)
    return along / np.linalg.norm(along), across / np.linalg.norm(across)


def line(start: Floats, goal: Floats, t: Floats, duration: float) -> Floats:
    """Straight stroke.

    Parameters
    ----------
    start, goal : array, shape (3,)
        mm.
    t : array, shape (T,)
        s.
    duration : float
        s.

    Returns
    -------
    array, shape (T, 3)
        mm.
    """
    s = minimum_jerk(t, duration)[:, None]
    return np.asarray(start + s * np.subtract(goal, start))


def sine(
    start: Floats,
    goal: Floats,
    wave_height: float,
    t: Floats,
    duration: float,
    periods: float = 1.0,
    normal: tuple[float, float, float] | Floats = (0.0, 0.0, 1.0),
) -> Floats:
    """Sine wave across the start-goal line, its first bulge to +v, minimum-jerk along u.

    Parameters
    ----------
    start, goal : array, shape (3,)
        mm.
    wave_height : float
        From peak to trough, mm: twice the amplitude.
    t : array, shape (T,)
        s.
    duration : float
        s.
    periods : float
        From start to goal; a multiple of one half ends on the line.
    normal : array, shape (3,)
        Of the plate, on the tool's side.

    Returns
    -------
    array, shape (T, 3)
        mm.
    """
    s = minimum_jerk(t, duration)[:, None]
    _, v = directions(start, goal, np.asarray(normal, dtype=float))
    swing = 0.5 * wave_height * np.sin(2.0 * np.pi * periods * s)
    return np.asarray(start + s * np.subtract(goal, start) + swing * v)


def circle(
    start: Floats,
    goal: Floats,
    t: Floats,
    duration: float,
    normal: tuple[float, float, float] | Floats = (0.0, 0.0, 1.0),
) -> Floats:
    """Full circle whose diameter is the start-goal line, back to the start, first to +v.

    Parameters
    ----------
    start, goal : array, shape (3,)
        Where it begins and ends, and the opposite point, mm.
    t : array, shape (T,)
        s.
    duration : float
        s.
    normal : array, shape (3,)
        Of the plate, on the tool's side.

    Returns
    -------
    array, shape (T, 3)
        mm.
    """
    angle = 2.0 * np.pi * minimum_jerk(t, duration)[:, None]
    u, v = directions(start, goal, np.asarray(normal, dtype=float))
    radius = 0.5 * np.linalg.norm(np.subtract(goal, start))
    return np.asarray(start + radius * ((1.0 - np.cos(angle)) * u + np.sin(angle) * v))


def polyline(points: Floats, t: Floats, duration: float) -> Floats:
    """Straight from point to point, minimum-jerk along the arc length.

    Parameters
    ----------
    points : array, shape (P, 3)
        mm; not all the same.
    t : array, shape (T,)
        s.
    duration : float
        s.

    Returns
    -------
    array, shape (T, 3)
        mm.
    """
    points = np.asarray(points, dtype=float)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    at = arc[-1] * minimum_jerk(t, duration)
    return np.column_stack([np.interp(at, arc, column) for column in points.T])
