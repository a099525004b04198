"""The mock experiment: plate, pen and practised hand around one reference stroke."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.settings.record import RecordSettings
from dmpcli.simulation.hand import HandParameters, SimulatedHand, stroke_time
from dmpcli.simulation.mock import Lab, Plate, Scene
from dmpcli.simulation.reference_strokes import DURATION, Reference

DELAY = 0.05
"""Of the mock's arm: one servo period and its lag, s."""

# The hand takes hold where the pen stands; further away it would tug the pen over the plate.
_REACH = 10.0
# A hand comes to rest in less than this after its stroke, s.
_SETTLING = 5.0


@dataclass(frozen=True)
class Rehearsal:
    """Who draws, and for how long at most.

    Attributes
    ----------
    begin : callable
        Tells the tutor the time at which the tool may be dragged, s.
    lead_in : float
        How long the tutor then takes to set the pen down, s.
    longest : float
        How long the recording may take, s; infinite where a person ends it.
    """

    begin: Callable[[float], None]
    lead_in: float
    longest: float


def scene(reference: Reference, settings: RecordSettings) -> Scene:
    """Lay a plate under the stroke and set the pen down on it without pressing.

    The stroke is where the pressed pen runs, so the plate's surface lies higher by as much as the
    hand presses the pen in.

    Parameters
    ----------
    reference : Reference
    settings : RecordSettings

    Returns
    -------
    Scene
    """
    plate = Plate(point=reference.start, normal=reference.normal)
    surface = reference.start + HandParameters().press / plate.stiffness * reference.normal
    return Scene(
        position=surface,
        plate=Plate(point=surface, normal=reference.normal),
        seed=settings.seed,
    )


def rehearse(lab: Lab | None, reference: Reference, settings: RecordSettings) -> Rehearsal:
    """Put the tutor's hand on the lab's tool; without a lab a person draws.

    The stroke and the rests around it fill `duration`; without one the stroke takes 10 s.

    Parameters
    ----------
    lab : Lab or None
    reference : Reference
    settings : RecordSettings

    Raises
    ------
    InputError
        The tool does not stand where the stroke begins, or the stroke needs more speed than the
        reference may have.
    """
    if lab is None:
        return Rehearsal(lambda _: None, 0.0, settings.duration or np.inf)
    away = float(np.linalg.norm(lab.arm.position - reference.start))
    if away > _REACH:
        raise InputError(
            f"--robot: the mock's pen stands {away:.1f} mm from the start of the stroke; "
            "leave x, y, z out of the URL, or give --start"
        )
    tutor, lead_in = practised(reference, lab.arm.rotation, settings)
    lab.hand = tutor
    longest = tutor.duration
    if settings.duration is None and settings.until_rest is not None:
        longest += settings.until_rest + _SETTLING
    return Rehearsal(tutor.begin, lead_in, longest)


def practised(
    reference: Reference, rotation: Floats, settings: RecordSettings, delay: float = DELAY
) -> tuple[SimulatedHand, float]:
    """Return a hand that has practised the stroke, and how long it takes to set the pen down, s.

    Parameters
    ----------
    reference : Reference
    rotation : array, shape (3, 3)
        Attitude that the hand keeps.
    settings : RecordSettings
    delay : float
        Of the arm behind its set-points, which the hand has learnt, s.

    Raises
    ------
    InputError
        The stroke needs more speed than the reference may have.
    """
    hand = HandParameters()
    hand = replace(hand, preview=hand.preview + delay - DELAY)
    _check_speed(reference, settings, hand)
    duration = settings.duration or DURATION + 2.0 * hand.rest
    return SimulatedHand(reference, rotation, duration, settings, hand), hand.lead_in


def _check_speed(reference: Reference, settings: RecordSettings, hand: HandParameters) -> None:
    duration = DURATION if settings.duration is None else stroke_time(settings.duration, hand)[1]
    t = np.linspace(0.0, duration, 1001)
    step = np.linalg.norm(np.diff(reference.at(t, duration), axis=0), axis=1)
    needed = float(step.max()) / t[1]
    if needed > settings.speed:
        raise InputError(
            f"--duration: a stroke in {duration:g} s would need {needed:.0f} mm/s, and [record] "
            f"speed is {settings.speed:g}; give it more time"
        )
