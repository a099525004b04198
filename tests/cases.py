"""Recordings as people have them, in closed form: the generator is the truth.

Lengths mm, times s. Each is a table of t, x, y, z and, where the tool is known, qx, qy, qz, qw.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

POSITION = "t,x,y,z"
POSE = f"{POSITION},qx,qy,qz,qw"

T6 = np.arange(0.0, 6.001, 0.01)


def jerk(share):
    """Minimum-jerk time law on 0..1."""
    u = np.clip(share, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


U6 = jerk(T6 / 6.0)


def wave(share, length=300.0, height=50.0, periods=1.0):
    """Points of a sine wave across a line along x, at shares of its length."""
    across = 0.5 * height * np.sin(2.0 * np.pi * periods * share)
    return np.column_stack([length * share, across, 0.0 * share])


def about(axis, degrees):
    """Rotation matrix about a base axis."""
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def held(samples, x=180.0, y=0.0):
    """Quaternions (T, 4) of a tool turned about base x, then leaning about base y, degrees."""
    R = Rotation.from_euler("y", y, degrees=True) * Rotation.from_euler("x", x, degrees=True)
    return np.tile(R.as_quat(), (samples, 1))


def turned_about_y(angle):
    """Quaternions (T, 4) of a tool that points down but for a turn about base y, rad."""
    R = Rotation.from_euler("y", angle[:, None]) * Rotation.from_euler("x", np.pi)
    return R.as_quat()


def recording(t, position, quaternion=None):
    """Table (T, 4 or 8)."""
    return np.column_stack([t, position] if quaternion is None else [t, position, quaternion])


def write(path: Path, table) -> Path:
    """Write a recording as CSV, with the nine digits that loggers print."""
    head = POSE if table.shape[1] == 8 else POSITION
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


def loops():
    """Twenty loops in 60 s, 30 mm high."""
    t = np.arange(0.0, 60.001, 0.02)
    u, a = t / 60.0, 2.0 * np.pi * t / 3.0
    return recording(t, np.column_stack([280 * u + 12 * np.sin(a), 15 * np.cos(a), 0 * t]))


def waves():
    """Two hundred waves of 40 mm in 600 s."""
    t = np.arange(0.0, 600.001, 0.05)
    a = 2.0 * np.pi * t / 3.0
    return recording(t, np.column_stack([2000 * t / 600, 20 * np.sin(a), 0 * t]))


def letters():
    """Thirty cursive letters of 20 mm in 30 s."""
    t = np.arange(0.0, 30.001, 0.01)
    a = 2.0 * np.pi * t
    y = 10 * (1 - np.cos(a)) + 3 * np.sin(0.5 * a)
    return recording(t, np.column_stack([12 * t + 7 * np.sin(a), y, 0 * t]))


CORNERS = np.column_stack([12.0 * np.arange(31), 20.0 * (np.arange(31) % 2), np.zeros(31)])
"""Corners of the zigzag (31, 3)."""


def corners():
    """Zigzag of thirty strokes at 50 mm/s without a stop."""
    s = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(CORNERS, axis=0), axis=1))]
    t = np.arange(0.0, s[-1] / 50.0, 0.01)
    return recording(t, np.column_stack([np.interp(50 * t, s, c) for c in CORNERS.T]))


def wall(lean):
    """One wave of 80 mm on a wall that faces base -y but for a lean about x, degrees."""
    w = np.column_stack([300 * U6, 0 * U6, 40 * np.sin(2 * np.pi * U6)])
    return recording(T6, w @ about("x", -lean).T)


def wall_letter(lean):
    """Return a closed letter of 70 x 100 mm on that wall."""
    c = 2.0 * np.pi * U6
    letter = np.column_stack([35 * (1 - np.cos(c)), 0 * c, 50 * np.sin(c)])
    return recording(T6, letter @ about("x", -lean).T)


T9 = np.arange(0.0, 9.001, 0.01)
_P9 = T9 / 9.0
LIFT = 8.0 * (jerk((_P9 - 0.55) / 0.08) - jerk((_P9 - 0.72) / 0.08))
"""Height (901,) of the lifted pen."""


def pen_lift(oriented=False):
    """Two strokes on z = 0 with the pen lifted by 8 mm in between."""
    go = jerk(_P9)
    y = 18 * np.sin(3 * np.pi * np.minimum(go / 0.5, 1))
    y = y + 34 * jerk((_P9 - 0.58) / 0.14) - 54 * jerk((_P9 - 0.80) / 0.2)
    position = np.column_stack([90 * go, y, LIFT])
    return recording(T9, position, held(len(T9)) if oriented else None)


def seam():
    """Nearly straight over a hump of 1.2 mm, the tool straight down."""
    hump = np.column_stack([300 * U6, 0.2 * np.sin(6 * np.pi * U6), 1.2 * np.sin(np.pi * U6)])
    return recording(T6, hump, held(len(T6)))


_T8 = np.arange(0.0, 8.001, 0.01)
_R8 = _T8 / 8.0
TIMINGS = {
    "even": (T6, U6),
    "slow_start": (T6, jerk((T6 / 6) ** 1.6)),
    "slow_end": (T6, jerk(1 - (1 - T6 / 6) ** 1.6)),
    "hesitation": (
        _T8,
        np.where(_R8 < 0.4, 0.4 * jerk(_R8 / 0.4), 0.4 + 0.6 * jerk((_R8 - 0.65) / 0.35)),
    ),
}
"""Ways through one path: times, and shares of its length."""


def timing(name):
    """One path by one of `TIMINGS`."""
    t, share = TIMINGS[name]
    return recording(t, wave(share))


def idle(deviation, rng):
    """The hand rests for 7 s, draws for 6 s, rests for 7 s, with noise."""
    t = np.arange(0.0, 20.0, 0.01)
    return recording(t, wave(jerk((t - 7) / 6)) + rng.normal(0, deviation, (len(t), 3)))


def noisy(deviation, rng):
    """Wave with white noise."""
    return recording(T6, wave(U6) + rng.normal(0, deviation, (len(T6), 3)))


def uneven(rng):
    """Stamps as logs by events have them: bursts of 1 ms steps among steps of 0.2 s; noise."""
    steps = np.r_[np.full(6, 0.001), np.full(14, 0.2), np.full(6, 0.001), np.full(15, 0.2)]
    t = np.r_[0.0, np.cumsum(steps)]
    return recording(t, wave(jerk(t / t[-1]), 120, 12) + rng.normal(0, 0.15, (len(t), 3)))


def nearly_closed():
    """Return a loop with a gap of an eighth of its extent."""
    c = 2.0 * np.pi * (0.97 * U6)
    return recording(T6, np.column_stack([40 * np.cos(c) + 3 * U6, 55 * np.sin(c), 0 * c]))


def few():
    """Eleven samples of a wave of 100 x 20 mm."""
    return recording(T6[::60], wave(U6[::60], 100, 20))


def pause(rng):
    """Wave with a rest of 5 s in its middle."""
    i = 300
    t = np.r_[T6[:i], T6[i] + np.arange(0, 5, 0.01), T6[i:] + 5]
    P = wave(U6)
    rest = np.tile(P[i], (500, 1)) + rng.normal(0, 0.01, (500, 3))
    return recording(t, np.r_[P[:i], rest, P[i:]])


_DOWN = 60.0 * jerk(1.0 - np.arange(0, 2, 0.01) / 2.0)


def approach():
    """Wave between a descent and an ascent of 60 mm in 2 s each."""
    z = _DOWN[:, None] * [0.0, 0.0, 1.0]
    P = np.r_[z, wave(U6), z[::-1] + [300.0, 0.0, 0.0]]
    return recording(np.arange(len(P)) * 0.01, P)


def retract():
    """Wave with an ascent of 60 mm after it."""
    P = np.r_[wave(U6), _DOWN[::-1, None] * [0.0, 0.0, 1.0] + [300.0, 0.0, 0.0]]
    return recording(np.arange(len(P)) * 0.01, P)


TAUGHT_LENGTH = 109.0


def _flat(turn=0.0):
    """Wave of 109 x 50 mm about the origin, turned about z by degrees."""
    return (wave(U6, TAUGHT_LENGTH, 50) - [TAUGHT_LENGTH / 2, 0, 0]) @ about("z", turn).T


def on_saddle(turn):
    """Wave above a plan on z = (x² - y²)/240."""
    q = _flat(turn)
    q[:, 2] = (q[:, 0] ** 2 - q[:, 1] ** 2) / 240
    return recording(T6, q)


def on_bow(radius=600.0):
    """Wave above a plan on a sheet bent about y: up at its ends, or, of negative radius, down."""
    q = _flat()
    q[:, 2] = radius - np.sign(radius) * np.sqrt(radius**2 - q[:, 0] ** 2)
    return recording(T6, q)


def filtered(deviation, frequency, rng):
    """Wave with noise that a filter of 10 Hz, say, has been over."""
    from scipy.signal import butter, sosfiltfilt

    sos = butter(2, frequency, fs=100.0, output="sos")
    noise = sosfiltfilt(sos, rng.normal(0, deviation, (len(T6), 3)), axis=0)
    return recording(T6, wave(U6) + noise)


def quantised(step):
    """Wave in steps of so many mm."""
    return recording(T6, step * np.round(wave(U6) / step))


def interpolated(deviation, rng):
    """Noisy wave of 30 Hz, linearly interpolated to 100 Hz."""
    t = np.arange(0.0, 6.001, 1 / 30)
    P = wave(jerk(t / 6)) + rng.normal(0, deviation, (len(t), 3))
    return recording(T6, np.column_stack([np.interp(T6, t, c) for c in P.T]))


def aslant(degrees, axis):
    """Wave on z = 0 with the tool held aslant about base x or y, degrees."""
    lean = held(len(T6), x=180.0 + degrees) if axis == "x" else held(len(T6), y=degrees)
    return recording(T6, wave(U6), lean)


def hop():
    """Wave on z = 0 with a hop of 5 mm."""
    P = wave(U6)
    P[:, 2] = 5.0 * (jerk((T6 - 2.4) / 0.4) - jerk((T6 - 3.2) / 0.4))
    return recording(T6, P)


def tool_in_plate():
    """Wave on z = 0 by a TCP whose z lies in the plate, along y."""
    return recording(T6, wave(U6), held(len(T6), x=90.0))


def above(height):
    """Wave taught off the surface z = 0 by so many mm, the tool straight down."""
    return recording(T6, wave(U6) + [0.0, 0.0, height], held(len(T6)))
