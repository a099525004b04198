"""The mock tutor: a practised hand that draws a reference stroke with the tool.

A spring and a damper pull the pen towards a point a little ahead on the stroke, a turning spring
keeps its attitude, and the hand presses the pen into the plate. What makes it a hand: it looks
ahead, it pushes with what the tool is known to take (practice with this admittance model: its mass,
drag and spring, the dead-band and the pen's friction), it pushes harder while the pen stays off its
aim, its aim wanders slowly, and it trembles at 8-12 Hz.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation.reference_strokes import Reference

_TABLE_RATE = 200.0
_HOLD = 3.0
# mm/s: the hand pushes against the full friction from this speed on.
_SLIDING = 2.0


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
    correction : float
        How fast the hand pushes harder while the eye sees the pen off its aim, N/s per mm; slower
        with a tool so heavy that this would swing.
    pen_friction : float
        What the pen is known to rub on the plate with, N.
    press : float
        Into the plate, N.
    wander, turning_wander : float
        RMS of the aim's slow wandering (0.1-1 Hz) per axis, mm and rad.
    tremor, turning_tremor : float
        RMS at 8-12 Hz per axis, N and N·m.
    rest : float
        How long the hand rests before and after the stroke, s.
    lead_in : float
        How long the hand takes to set the pen down before the recording begins, s.
    grip : float
        How much of that it takes to take hold, s.
    """

    stiffness: float = 0.6
    damping: float = 0.03
    turning_stiffness: float = 10.0
    turning_damping: float = 0.2
    preview: float = 0.09
    correction: float = 0.6
    pen_friction: float = 0.4
    press: float = 2.0
    wander: float = 0.05
    turning_wander: float = 0.01
    tremor: float = 0.1
    turning_tremor: float = 0.01
    rest: float = 0.4
    lead_in: float = 1.0
    grip: float = 0.3


class SimulatedHand:
    """A hand on the mock lab's tool.

    Parameters
    ----------
    reference : Reference
    rotation : array, shape (3, 3)
        Attitude that the hand keeps.
    duration : float
        Of the recording, from rest to rest, s.
    settings : RecordSettings
        What the hand has practised with, and the seed.
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
        settings: RecordSettings,
        hand: HandParameters | None = None,
    ) -> None:
        self._hand = hand = HandParameters() if hand is None else hand
        self.duration = duration
        self._push_rate = _push_rate(hand, settings)
        self._rotation = rotation
        self._began = self._seen = np.inf
        self._correction = np.zeros(3)
        self._table = _table(reference, duration, settings, hand)

    def begin(self, t: float) -> None:
        """Take hold of the tool at time `t`, s; the recording begins `lead_in` later."""
        self._began = self._seen = t
        self._correction = np.zeros(3)

    def wrench(self, t: float, position: Floats, rotation: Floats, velocity: Floats) -> Floats:
        """Return the hand's wrench on the tool at the TCP; see `dmpcli.simulation.mock.Hand`."""
        since = t - self._began
        if since <= 0.0:
            return np.zeros(6)
        hand = self._hand
        at = min(since * _TABLE_RATE, len(self._table) - 1.001)
        i = int(at)
        row = self._table[i] + (at - i) * (self._table[i + 1] - self._table[i])
        aim, push = row[:3], row[3:]
        self._correction += self._push_rate * (t - self._seen) * (aim - position)
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


def _push_rate(hand: HandParameters, settings: RecordSettings) -> Floats:
    """N/s per mm on each axis: at most 0.3 of where mass, drag and hand would begin to swing."""
    law = settings.law
    steady = (law.damping[:3] + hand.damping) * hand.stiffness / law.mass[:3]
    return np.minimum(hand.correction, 0.3 * steady)


def _table(
    reference: Reference, duration: float, settings: RecordSettings, hand: HandParameters
) -> Floats:
    """Aim point (3) and the wrench pushed in advance (6), every 1/200 s; shape (rows, 9)."""
    law, rng = settings.law, np.random.default_rng([settings.seed, 0x4A])
    rest, stroke = stroke_time(duration, hand)
    # The hand goes on holding after the stroke; once the table ends, without a tremble.
    t = np.arange(round((hand.lead_in + duration + _HOLD) * _TABLE_RATE) + 1) / _TABLE_RATE
    drawing = t - hand.lead_in - rest
    ahead = drawing + hand.preview
    point = reference.at(ahead, stroke)
    velocity = _rounded(np.gradient(point, 1.0 / _TABLE_RATE, axis=0))
    acceleration = np.gradient(velocity, 1.0 / _TABLE_RATE, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    # Until it draws, the hand presses harder by the dead-band, which would hold the pen back.
    press = hand.press + settings.dead_band_force * np.clip(-drawing / 0.2, 0.0, 1.0)
    table = np.zeros((len(t), 9))
    table[:, :3] = point + hand.wander * _unsteady(rng, t, 0.1, 1.0)
    table[:, 3:6] = (
        (hand.damping + law.damping[:3]) * velocity
        # Behind a delay, drag feels like more mass.
        + (law.mass[:3] + hand.preview * law.damping[:3]) * acceleration
        + law.stiffness[:3] * (point - reference.start)
        + (hand.pen_friction + settings.dead_band_force) * velocity / np.maximum(speed, _SLIDING)
        - press[:, None] * reference.normal
        + hand.tremor * _unsteady(rng, t, 8.0, 12.0)
    )
    wander = hand.turning_stiffness * hand.turning_wander * _unsteady(rng, t, 0.1, 1.0)
    table[:, 6:9] = wander + hand.turning_tremor * _unsteady(rng, t, 8.0, 12.0)
    return table


def _rounded(velocity: Floats) -> Floats:
    """Smooth over 0.2 s, shape (rows, 3): a hand takes a corner in that time, not at once."""
    window = np.hanning(round(0.2 * _TABLE_RATE) + 1)
    window /= window.sum()
    return np.column_stack([np.convolve(column, window, "same") for column in velocity.T])


def _unsteady(rng: np.random.Generator, t: Floats, low: float, high: float) -> Floats:
    """Three signals of RMS 1 between two frequencies, Hz: sums of sines; shape (len(t), 3)."""
    count = 12
    frequency = rng.uniform(low, high, (count, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (count, 3))
    waves = np.sin(2.0 * np.pi * frequency * t[:, None, None] + phase)
    return np.asarray(np.sqrt(2.0 / count) * waves.sum(axis=1))
