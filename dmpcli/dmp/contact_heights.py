"""How high over a named surface a stroke is drawn: in contact, lifted, and never unasked inside.

Recordings are calibrated to a millimetre, not better, and a part is never just where it is said to
be. So a pen within `contact` of the surface was on it, and is drawn on it; a lifted pen is drawn
lifted; and a stroke that would go deeper is refused, since it was taught on something else.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.skill import Skill

CONTACT = 1.0
"""A pen this near to the surface touches it, mm; with more noise, within `NOISE` deviations."""

NOISE = 5.0
# Touching parts of less than this share of the path tell no offset.
_TELLING = 0.05
# An offset is constant where this part of what touches is within a share of the band of it, or of
# itself: heights that an arch goes through have a median too.
_ALIKE, _OF_BAND, _OF_ITSELF = 0.9, 0.1, 0.25
# Samples of the stroke that are judged.
_SAMPLES = 2001


@dataclass(frozen=True)
class ContactHeights:
    """What is drawn of a skill's heights w over a surface.

    Attributes
    ----------
    band : float
        Within it the pen touches, mm; 0 draws every w as it is.
    removed : float
        Height of the touching parts where it is constant, which is taken off, mm.
    offset : float
        Asked for on purpose: stand-off positive, engraving negative, mm.
    depth : float
        How far the stroke would go into the surface beyond what was asked for, mm; at most `band`
        where it may be drawn.
    touching : float
        Share of the path in contact, 0 to 1.
    lift : float
        Largest height of the lifted parts, mm; 0 where there are none.
    """

    band: float
    removed: float
    offset: float
    depth: float
    touching: float
    lift: float

    @property
    def deep(self) -> bool:
        """Whether the stroke would dig into the surface."""
        return self.depth > self.band > 0.0

    def drawn(self, w: Floats) -> Floats:
        """Heights as drawn: 0 in contact, w from twice the band on, and smoothly in between."""
        return _drawn(w - self.removed, self.band) + self.offset


def contact_heights(skill: Skill, contact: float | None, offset: float = 0.0) -> ContactHeights:
    """Find out how a skill's strokes lie over a surface that is named to draw on.

    Parameters
    ----------
    skill : Skill
        Of the modified model.
    contact : float or None
        mm; None takes the larger of `CONTACT` and `NOISE` times the recording's noise; 0 draws
        every height as it is.
    offset : float
        mm.
    """
    t = np.linspace(0.0, skill.duration, _SAMPLES)
    x = demonstrated_scale(skill, t)
    steps = np.linalg.norm(np.diff(x[:, :3], axis=0), axis=1)
    share = np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])
    share /= share.sum()
    if contact is None:
        noise = 0.0 if skill.reached is None else skill.reached.noise
        contact = max(CONTACT, NOISE * noise)
    w = x[:, 2]
    near = np.abs(w) <= contact
    removed = 0.0
    if contact > 0.0 and share[near].sum() > _TELLING:
        removed = _weighted_quantile(w[near], share[near], 0.5)
        apart = _weighted_quantile(np.abs(w[near] - removed), share[near], _ALIKE)
        if apart > max(_OF_BAND * contact, _OF_ITSELF * abs(removed)):
            removed = 0.0
    drawn = _drawn(w - removed, contact)
    touching: Booleans = np.abs(w - removed) <= max(contact, 1e-6)
    # On purpose is what the offset takes down; a stand-off lifts what would dig in.
    lowest = float(drawn.min()) + max(offset, 0.0)
    lift = float(drawn.max())
    return ContactHeights(
        contact,
        removed,
        offset,
        max(0.0, -lowest),
        float(share[touching].sum()),
        lift if lift > 0.0 else 0.0,
    )


def pressed(
    w: Floats, force: float | Floats | None, heights: ContactHeights | None
) -> Floats | None:
    """Set-point of the force along the normal: a force in contact, 0 where the tool is lifted.

    Parameters
    ----------
    w : array, shape (T,)
        Heights as drawn, mm.
    force : float, array of shape (T,), or None
        N; None asks for none.
    heights : ContactHeights or None
        What was drawn of them over a named surface; without one a pen within `CONTACT` of the
        stroke's own plane touches.

    Returns
    -------
    array, shape (T,), or None
        N.
    """
    if force is None:
        return None
    # What is drawn in contact lies exactly on its offset.
    known = heights is not None and heights.band > 0.0
    near, offset = (1e-6, heights.offset) if known and heights else (CONTACT, 0.0)
    found: Floats = np.where(np.abs(w - offset) <= near, force, 0.0)
    return found


def end_heights(skill: Skill, heights: ContactHeights | None) -> tuple[float, float]:
    """Heights w at which the strokes of a skill begin and end, mm."""
    if skill.model == "original":
        return 0.0, 0.0
    ends = np.array([skill.start[2], skill.goal[2]])
    first, last = (ends if heights is None else heights.drawn(ends)).tolist()
    return first, last


def demonstrated_scale(skill: Skill, t: Floats) -> Floats:
    """Coordinates of the skill's own stroke, at the mean start, goal and length, shape (T, 6)."""
    return skill.response(t).between(skill, skill.start, skill.goal)


def _drawn(w: Floats, band: float) -> Floats:
    if band <= 0.0:
        return w
    q = np.clip(np.abs(w) / band - 1.0, 0.0, 1.0)
    # The quintic blend has no kink, nor a jump in acceleration.
    smooth: Floats = q**3 * (10.0 - 15.0 * q + 6.0 * q**2)
    return smooth * w


def _weighted_quantile(values: Floats, weights: Floats, part: float) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, part * reached[-1])])
