"""What `generalize` says of a skill and of where it is drawn, before and beside the outcome."""

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dmpcli.arrays import Floats, Integers
    from dmpcli.dmp.drawn_strokes import GeneralizeOptions
    from dmpcli.dmp.feasibility import Feasibility
    from dmpcli.dmp.skill import Skill
    from dmpcli.records.pairs import PairTable
    from dmpcli.surfaces.surface import Surface

SQUARE = "the surface stands square to the one that"
"""In what is told of a surface that the tool's side cannot be known on."""

_SHOWN_OFFSET = 0.05
_UNDECIDED = 5.0


def mark(skill: "Skill", name: str) -> str | None:
    """Return the warning that a skill beyond its tolerance carries; None of a good one."""
    from dmpcli.records import tolerance_mark

    found = tolerance_mark.of_reached(skill.reached)
    return None if found is None else tolerance_mark.text(name, found)


def reason(
    verdict: "Feasibility",
    i: int,
    tolerance: float,
    skill: "Skill",
    where: Callable[[list[str]], str] | None = None,
) -> str:
    """Say what stands against a pair, and what to do.

    Parameters
    ----------
    verdict : Feasibility
    i : int
        Of the pair.
    tolerance : float
        Of start and goal off the surface, mm.
    skill : Skill
    where : callable, optional
        Says of the ends that are off the surface where it is instead.
    """
    from dmpcli.dmp.feasibility import MOST_SAMPLES
    from dmpcli.workflows import off_surface

    if verdict.coincident[i]:
        return "start and goal are one point, and the stroke is open; set them apart"
    if verdict.short[i]:
        return (
            "--ease-in and --ease-out together are longer than twice the stroke; "
            "shorten them, or give a longer --duration"
        )
    if verdict.endless[i]:
        return f"more than {MOST_SAMPLES} samples; shorten --duration or lower --rate"
    if verdict.far[i]:
        off = {name: float(verdict.off[i, j]) for j, name in enumerate(("start", "goal"))}
        off = {name: distance for name, distance in off.items() if distance > tolerance}
        said = f"{off_surface.distances(off)} the surface, more than --snap-tol {tolerance:g}; "
        return said + (where(list(off)) if where else "move the point, or raise the tolerance")
    if verdict.upright[i]:
        return (
            "the line from start to goal stands upright on the plane, so that no chart follows; "
            "give the plane to draw on with --surface plane.json"
        )
    if verdict.deep[i]:
        return (
            f"the stroke would go {verdict.depth[i]:.2f} mm into the surface, since it was taught "
            "on another one, or on one that lay elsewhere; name it with fit --surface and "
            "--surface-pose, allow the depth with --contact, or lift the stroke with --offset"
        )
    if skill.closed:
        return (
            "the stroke is closed, and its goal lies far from its start, which makes another "
            "stroke of it; give the start as goal, or ask for it with --allow-stretch"
        )
    return (
        f"the start-goal distance is {verdict.stretch[i]:.3g} times the demonstrated "
        f"{skill.frame.length:.3g} mm, which makes another stroke of it; check the unit of start "
        "and goal, or ask for it with --allow-stretch"
    )


def tell_of_surface(
    skill: "Skill", style: "GeneralizeOptions", given: "Surface", table: "PairTable", name: str
) -> None:
    """Say how the stroke lies over the named surface: in contact, lifted, shifted, turned over.

    Parameters
    ----------
    skill : Skill
    style : GeneralizeOptions
        With its heights, as `style_of` gives them.
    given : Surface
        In the base frame.
    table : PairTable
        In the base frame; rows that cannot be drawn have no say.
    name : str
        What messages call the surface.
    """
    from dmpcli.dmp.sides import turned_over
    from dmpcli.messages import tell, warn

    pairs = table.pairs[table.good.nonzero()[0]]
    start = pairs.start
    if skill.side_guessed:
        _tell_of_guessed_side(skill, given, start, name)
    elif pairs.start_rotation is None:
        _tell_of_taught_side(skill, given, start, name)
    over = turned_over(skill, pairs, given)
    for heights, seen in ((style.heights, not over.all()), (style.heights_over, over.any())):
        if heights is None or not seen or heights.deep:
            continue
        if abs(heights.removed) >= _SHOWN_OFFSET:
            tell(
                f"{name}: the stroke was taught {abs(heights.removed):.2f} mm "
                f"{'off' if heights.removed > 0.0 else 'inside'} its surface, which is taken off; "
                "--contact 0 draws it so",
            )
        if heights.touching < 0.5:
            warn(
                f"{name}: only {100.0 * heights.touching:.0f} % of the stroke touches the surface; "
                "it was taught in the air or on a curved part: name that with fit --surface, or "
                "shift it with --offset"
            )
        elif heights.lift > max(heights.band, heights.offset + 1e-9):
            tell(
                f"{name}: lifted by up to {heights.lift:.2f} mm over "
                f"{100.0 * (1.0 - heights.touching):.0f} % of the path, as taught",
            )


def _tell_of_guessed_side(skill: "Skill", given: "Surface", start: "Floats", name: str) -> None:
    import numpy as np

    from dmpcli.dmp.sides import normals_at
    from dmpcli.messages import tell, warn

    if not len(start):
        return
    cosine = normals_at(given, start) @ skill.frame.normal
    angle = np.degrees(np.arccos(np.clip(np.abs(cosine), 0.0, 1.0)))
    if (angle > 90.0 - _UNDECIDED).any():
        warn(
            f"{name}: the stroke was taught without orientation on a plane square to this surface, "
            "so that it may come out mirrored; name the plane with fit --normal"
        )
    elif (cosine < 0.0).any():
        tell(
            f"{name}: the stroke was taught without orientation; it is seen from this surface's "
            "side",
        )


def _tell_of_taught_side(skill: "Skill", given: "Surface", start: "Floats", name: str) -> None:
    """Say where a curved surface is not decidedly, or not by its own normals, on the taught side.

    A part's own normals point out of it; those of an open sheet mean nothing.
    """
    import numpy as np

    from dmpcli.dmp.sides import taught_side
    from dmpcli.messages import tell, warn
    from dmpcli.surfaces.plane import Plane

    side = None if isinstance(given, Plane) else taught_side(skill, given, start)
    if side is None or not len(start):
        return
    cosine = np.sum(given.closest(start).normal * side, axis=-1)
    if (np.abs(cosine) < np.sin(np.radians(_UNDECIDED))).any():
        warn(
            f"{name}: the surface stands square to the one that the stroke was taught on, so that "
            "it may come out mirrored or on the other side; give the tool at the start, "
            "--start-orientation RX RY RZ"
        )
    elif (cosine < 0.0).any():
        tell(
            f"{name}: drawn on the side that the surface's own normals point away from, as the "
            "tool was when it was taught; for the other one give the tool at the start, "
            "--start-orientation RX RY RZ",
        )


def tell_of_stretch(verdict: "Feasibility", rows: "Integers", skill: "Skill", table: str) -> None:
    """Warn of strokes whose start-goal distance is far from the demonstrated one.

    Parameters
    ----------
    verdict : Feasibility
        Of the pairs that were judged.
    rows : array of int, shape (k,)
        Those of them that are drawn.
    skill : Skill
        A closed or nearly closed one is doubted from 1 % on.
    table : str
        What messages call the table.
    """
    from dmpcli.dmp.feasibility import LONG_STRETCH, nearly_closed
    from dmpcli.messages import warn

    stretch = verdict.stretch[rows]
    far = (stretch > LONG_STRETCH) | (stretch < 1.0 / LONG_STRETCH)
    if skill.closed:
        far = stretch > 1.01
    elif nearly_closed(skill):
        far = (stretch > 1.01) | (stretch < 0.99)
    if not far.any():
        return
    worst = float(stretch[far][abs(_logs(stretch[far])).argmax()])
    of = f"{int(far.sum())} of {len(rows)} strokes, the worst" if len(rows) > 1 else "the stroke"
    warn(
        f"{table}: {of} is stretched along start-goal by {worst:.3g}; check the unit of start and "
        "goal"
        if not nearly_closed(skill)
        else f"{table}: {of} is stretched along start-goal by {worst:.3g}: the demonstration is "
        "nearly closed, so that its start and goal tell its size badly"
    )


def _logs(stretch: "Floats") -> "Floats":
    import numpy as np

    return np.asarray(np.log(stretch))
