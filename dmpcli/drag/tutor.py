"""The mock tutor: a practised hand that draws a reference stroke with the tool.

A spring and a damper pull the pen towards a point a little ahead on the stroke, a turning spring
keeps its attitude, and the hand presses the pen into the plate. What makes it a hand: it looks
ahead, it pushes with what the tool is known to take (practice: viscous drag, friction and the
dead-band), its aim wanders slowly, and it trembles at 8-12 Hz.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.drag.references import Reference

_TABLE_RATE = 200.0
_HOLD = 3.0


@dataclass(frozen=True)
class HandParameters:
    """What the hand is like.

    Attributes
    ----------
    stiffness, damping : float
        Towards the previewed point, N/mm and N·s/mm.
    turning_stiffness, turning_damping : float
        About the attitude held, N·m/rad and N·m·s/rad.
    preview : float
        How far ahead the hand aims, s: it has learnt the delay of arm, filter and loop.
    viscous_feel : float
        Drag of the tool that practice has taught, N·s/mm; pushed against in advance.
    inertial_feel : float
        Mass of the tool that practice has taught, N·s²/mm: the model's 5 kg, and the delay of arm,
        filter and loop (some 0.09 s), which feels like more.
    correction : float
        How fast the hand pushes harder while the eye sees the pen off its aim, N/s per mm.
    friction_feel : float
        Dry friction that practice has taught, N: the pen's on the plate and the dead-band.
    press : float
        Into the plate, N.
    wander, turning_wander : float
        RMS of the aim's slow wandering (0.1-1 Hz) per axis, mm and rad.
    tremor, turning_tremor : float
        RMS at 8-12 Hz per axis, N and N·m.
    rest : float
        How long the hand rests before and after the stroke, s.
    grip : float
        How long it takes to take hold, s.
    """

    stiffness: float = 0.6
    damping: float = 0.03
    turning_stiffness: float = 10.0
    turning_damping: float = 0.2
    preview: float = 0.09
    viscous_feel: float = 0.08
    inertial_feel: float = 0.0125
    friction_feel: float = 1.4
    correction: float = 0.6
    press: float = 2.0
    wander: float = 0.05
    turning_wander: float = 0.01
    tremor: float = 0.1
    turning_tremor: float = 0.01
    rest: float = 0.4
    grip: float = 0.2


class Tutor:
    """A hand on the mock lab's tool.

    Parameters
    ----------
    reference : Reference
    rotation : array, shape (3, 3)
        Attitude that the hand keeps.
    duration : float
        Of the whole demonstration with both rests, s.
    seed : int
    hand : HandParameters, optional

    Attributes
    ----------
    duration : float
        s.
    """

    def __init__(
        self,
        reference: Reference,
        rotation: Floats,
        duration: float,
        seed: int,
        hand: HandParameters | None = None,
    ) -> None:
        self._hand = hand = HandParameters() if hand is None else hand
        self.duration = duration
        self._rotation = rotation
        self._began = self._seen = np.inf
        self._correction = np.zeros(3)
        self._table = _table(reference, duration, np.random.default_rng([seed, 0x4A]), hand)

    def begin(self, t: float) -> None:
        """Take hold of the tool at time `t`, s."""
        self._began = self._seen = t
        self._correction = np.zeros(3)

    def wrench(self, t: float, position: Floats, rotation: Floats, velocity: Floats) -> Floats:
        """Return the hand's wrench on the tool at the TCP; see `dmpcli.instruments.mock.Hand`."""
        since = t - self._began
        if since <= 0.0:
            return np.zeros(6)
        hand = self._hand
        at = min(since * _TABLE_RATE, len(self._table) - 1.001)
        i = int(at)
        row = self._table[i] + (at - i) * (self._table[i + 1] - self._table[i])
        aim, push = row[:3], row[3:]
        self._correction += hand.correction * (t - self._seen) * (aim - position)
        self._seen = t
        E = self._rotation @ rotation.T
        # sin(angle) times axis: a turning spring that needs no logarithm.
        turn = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
        push[:3] += hand.stiffness * (aim - position) - hand.damping * velocity[:3]
        push[:3] += self._correction
        push[3:] += hand.turning_stiffness * turn - hand.turning_damping * velocity[3:]
        hold = min(since / hand.grip, 1.0)
        return np.asarray(hold * hold * (3.0 - 2.0 * hold) * push)


def stroke_time(duration: float, hand: HandParameters) -> tuple[float, float]:
    """Divide a demonstration into its rests and its stroke.

    Parameters
    ----------
    duration : float
        Of the whole, s.
    hand : HandParameters

    Returns
    -------
    tuple of float
        Length of each rest, at most a tenth of the whole, and of the stroke, s.
    """
    rest = min(hand.rest, 0.1 * duration)
    return rest, duration - 2.0 * rest


def _table(
    reference: Reference, duration: float, rng: np.random.Generator, hand: HandParameters
) -> Floats:
    """Aim point (3) and the wrench pushed in advance (6), every 1/200 s; shape (rows, 9)."""
    rest, stroke = stroke_time(duration, hand)
    # The hand goes on holding after the stroke; once the table ends, without a tremble.
    t = np.arange(round((duration + _HOLD) * _TABLE_RATE) + 1) / _TABLE_RATE
    ahead = t - rest + hand.preview
    point = reference.at(ahead, stroke)
    velocity = np.gradient(point, 1.0 / _TABLE_RATE, axis=0)
    acceleration = np.gradient(velocity, 1.0 / _TABLE_RATE, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    table = np.zeros((len(t), 9))
    table[:, :3] = point + hand.wander * _unsteady(rng, t, 0.1, 1.0)
    table[:, 3:6] = (
        (hand.damping + hand.viscous_feel) * velocity
        + hand.inertial_feel * acceleration
        + hand.friction_feel * velocity / np.maximum(speed, 1.0)
        - hand.press * reference.normal
        + hand.tremor * _unsteady(rng, t, 8.0, 12.0)
    )
    wander = hand.turning_stiffness * hand.turning_wander * _unsteady(rng, t, 0.1, 1.0)
    table[:, 6:9] = wander + hand.turning_tremor * _unsteady(rng, t, 8.0, 12.0)
    return table


def _unsteady(rng: np.random.Generator, t: Floats, low: float, high: float) -> Floats:
    """Three signals of RMS 1 between two frequencies, Hz: sums of sines; shape (len(t), 3)."""
    count = 12
    frequency = rng.uniform(low, high, (count, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (count, 3))
    waves = np.sin(2.0 * np.pi * frequency * t[:, None, None] + phase)
    return np.asarray(np.sqrt(2.0 / count) * waves.sum(axis=1))
