"""What stands against a pose that `register` found, and what it says of one that stands."""

from typing import TYPE_CHECKING

from dmpcli.errors import InputError, RefusedError, beside

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.records.pose import RunnerUp
    from dmpcli.records.touched import Touched
    from dmpcli.spatial.pose import Pose
    from dmpcli.surfaces.registration import RegisteredPart, Registration, Rival

_ALIKE = 4.0
"""Where two poses differ by less than this many RMS residuals everywhere, no touch tells them."""
_ALIKE_MM = 0.2
_OUTLIER, _OUTLIER_MM = 8.0, 0.2
"""A residual beyond so many medians, and so many mm, is told."""


def rough_pose(
    points: "Touched", scale: float, initial: "Pose | None", guess: str
) -> "Pose | None":
    """Return where to begin: `initial`, else by point pairs, else as in the part's file.

    Parameters
    ----------
    points : Touched
    scale : float
        mm in the part's unit.
    initial : Pose or None
    guess : {'near', 'none'}

    Returns
    -------
    Pose or None
        None where nothing is to be guessed: pairs alone, or all orientations.
    """
    import numpy as np

    from dmpcli.spatial.pose import Pose
    from dmpcli.surfaces.registration import from_pairs

    paired = points.paired
    if paired.all():
        if initial is not None:
            raise InputError("every row has px py pz, which give the pose; leave --initial out")
        if guess == "none":
            raise InputError("every row has px py pz, which give the pose; leave --guess out")
        return None
    if guess == "none":
        return None
    if initial is None and paired.any():
        first = from_pairs(scale * points.part[paired], points.base[paired])
        return Pose(first.position, first.rotation)
    return initial or Pose(np.zeros(3), np.eye(3))


def registered(
    points: "Touched", part: "RegisteredPart", scale: float, start: "Pose | None", limit: float
) -> "Registration":
    """Find the pose: by pairs, about a start, or without one in all orientations."""
    from dmpcli.spatial.pose import Pose
    from dmpcli.surfaces.registration import (
        from_pairs,
        onto_surface,
        starts_anywhere,
        starts_near,
    )

    if points.paired.all():
        return from_pairs(scale * points.part, points.base, part.extreme)
    if start is None:
        starts = starts_anywhere(points.base, part)
        return onto_surface(points.base, part, starts, points.approach, limit)
    starts = starts_near(points.base, start.rotation, start.position)
    found = onto_surface(points.base, part, starts, points.approach, limit)
    if not _beyond(*_moved(found, start, points.base)):
        return found
    # So far from its start a pose is no longer the one that was meant: all others are its rivals.
    starts = Pose.joined(
        starts_near(points.base, found.rotation, found.position),
        starts_anywhere(points.base, part),
    )
    return onto_surface(points.base, part, starts, points.approach, limit)


def _beyond(moved: float, turned: float) -> bool:
    """Whether a pose is so far from its start, mm and degrees, that the start was bad."""
    from math import degrees

    from dmpcli.surfaces.registration import START_SHIFT, START_TURN

    return moved > 2.0 * START_SHIFT or turned > 2.0 * degrees(START_TURN)


def refuse_unsure(
    result: "Registration",
    points: "Touched",
    part: "RegisteredPart",
    start: "Pose | None",
    most_residual: float,
    most_error: float,
    named: bool,
) -> None:
    """Refuse a pose that leaves a point too far off, that another rivals, or that is not certain.

    Parameters
    ----------
    result : Registration
    points : Touched
    part : RegisteredPart
    start : Pose or None
        Where the search began; None for pairs and for all orientations.
    most_residual, most_error : float
        mm.
    named : bool
        Whether the user gave the start.

    Raises
    ------
    RefusedError
    """
    from dmpcli.messages import warn

    against = (
        _residual(result, points, most_residual)
        or _rivalled(result, points, start is None)
        or _uncertain(result, points, most_error)
    )
    if against is None:
        return
    if points.paired.all() and result.residual.max() <= most_residual:
        warn(against)
        return
    if start is not None:
        _refuse_start(result, points, part, start, most_error, named)
    raise RefusedError(against)


def _residual(result: "Registration", points: "Touched", limit: float) -> str | None:
    import numpy as np

    worst = int(np.argmax(result.residual))
    if result.residual[worst] <= limit:
        return None
    table, off = points.table, beside(result.residual[worst], limit, ".3f")
    return (
        f"{table.name}: {table.at(worst)}: lies {off} mm off the part "
        f"(median of all {np.median(result.residual):.3f} mm), more than --max-residual "
        f"{limit:g};\ntouch it again, "
        + (
            "check its px py pz, "
            if points.paired.all()
            else "give a better --initial or px py pz for three points, "
        )
        + "or raise the limit"
        + ("" if not result.outside else f"; {_tip(result)}")
    )


def _tip(result: "Registration") -> str:
    side = "outside" if result.outside > 0.0 else "inside"
    return (
        f"the points lie {abs(result.outside):.2f} mm {side} the part on average, as the middle of "
        "a round tip does by its radius: touch with a point, or take the radius off"
    )


def _rivalled(result: "Registration", points: "Touched", anywhere: bool) -> str | None:
    import numpy as np

    rival = result.rival
    if rival is None or not rival.near:
        return None
    said = (
        f"{points.table.name}: another pose fits the {len(result.residual)} points nearly as well "
        f"({_fits(rival)}; this one {result.rms:.3f} mm), {_away(rival)};\n"
    )
    if rival.difference < max(_ALIKE * result.rms, _ALIKE_MM):
        said += "the part looks the same in both, which no touch can tell apart: "
        return said + (
            "give a rough pose with --initial, or px py pz for three points"
            if anywhere
            else "give px py pz for three points"
        )
    place = " ".join(f"{value:.1f}" for value in np.round(rival.place, 1) + 0.0)
    return said + (
        f"touch more points, one of them near {place} mm, where the two are "
        f"{rival.difference:.1f} mm apart"
        + (", or give a rough pose with --initial" if anywhere else "")
    )


def _uncertain(result: "Registration", points: "Touched", limit: float) -> str | None:
    if result.uncertainty <= limit:
        return None
    return (
        f"{points.table.name}: these points tell the pose only to {result.uncertainty:.2g} mm at "
        f"some point of the part (95 %), more than --max-error {limit:g};\nleast certain, the part "
        f"{result.conditioning.weakest}: touch more points where that would show, or raise the "
        "limit" + ("" if not result.outside else f"; {_tip(result)}")
    )


def _refuse_start(
    result: "Registration",
    points: "Touched",
    part: "RegisteredPart",
    start: "Pose",
    limit: float,
    named: bool,
) -> None:
    """Refuse a start, not the points, where a pose elsewhere fits them much better."""
    import numpy as np

    from dmpcli.spatial import rotations
    from dmpcli.surfaces.pose_bound import sure_rise

    try:
        far = registered(points, part, 1.0, None, limit)
    except InputError:
        return
    squares = [float(np.sum(found.residual**2)) for found in (far, result)]
    if squares[1] <= squares[0] + sure_rise(squares[0], far.spare):
        return
    moved, turned = _moved(far, start, points.base)
    six = [*far.position, *rotations.to_euler(far.rotation)]
    words = " ".join(f"{value:.4f}" for value in np.array(six) + 0.0)
    whole = far.rival is None or not far.rival.near
    raise RefusedError(
        f"{points.table.name}: the start is bad: "
        + (
            "--initial"
            if named
            else "that of px py pz"
            if points.paired.any()
            else "where the part lies in its file"
        )
        + f" is {moved:.1f} mm and {turned:.1f}° from a pose that fits the points "
        f"({far.rms:.3f} mm RMS, {result.rms:.3f} mm near the start);\n"
        + (
            f"check it, and give --initial {words}, or --guess none"
            if whole
            else "give a better --initial, or px py pz for three points"
        )
    )


def _moved(result: "Registration", start: "Pose", touched: "Floats") -> tuple[float, float]:
    """How far a pose is from a start: at the touched points' centre, mm, and turned, degrees."""
    import numpy as np

    from dmpcli.spatial import rotations

    centre = touched.mean(axis=0)
    in_part = (centre - result.position) @ result.rotation
    moved = np.linalg.norm(start.apply(in_part) - centre)
    turned = np.linalg.norm(rotations.log_one(result.rotation @ start.rotation.T))
    return float(moved), float(np.degrees(turned))


def _fits(rival: "Rival") -> str:
    return f"residual {rival.rms:.3f} mm RMS"


def _away(rival: "Rival") -> str:
    import numpy as np

    return f"turned by {np.degrees(rival.turned):.1f}° and up to {rival.apart:.1f} mm away"


def runner_up(result: "Registration") -> "RunnerUp | None":
    """Return the second best pose as the pose file keeps it."""
    from dmpcli.records.pose import RunnerUp
    from dmpcli.spatial import rotations

    rival = result.rival
    if rival is None:
        return None
    return RunnerUp(
        position=rival.position.tolist(),
        rotation=rotations.to_euler(rival.rotation).tolist(),
        rms=rival.rms,
        apart=rival.apart,
    )


def tell_of(result: "Registration", points: "Touched", output: str, start: "Pose | None") -> None:
    """Say how well a pose fits, how certain it is, and what comes next to it."""
    import numpy as np

    from dmpcli.messages import tell, warn

    conditioning = result.conditioning
    tell(
        f"{output}: {len(result.residual)} points, residual {result.rms:.4f} mm RMS, "
        f"{result.residual.max():.4f} mm at most; condition number {conditioning.number:.3g}",
    )
    tell(
        f"certain to {result.uncertainty:.2g} mm at every point of the part (95 %); least certain: "
        f"the part {conditioning.weakest}",
    )
    if points.paired.all():
        return
    if result.rival is None:
        tell("no other pose was found")
    else:
        tell(f"the runner-up, {_away(result.rival)}: {_fits(result.rival)}")
    if points.approach is not None and not result.directed:
        warn(
            f"{points.table.name}: the directions of approach point out of the part in every pose "
            "that fits, and are not used; ax ay az (or the tool's axis of rx ry rz) point into it"
        )
    if result.outside:
        warn(f"{points.table.name}: {_tip(result)}")
    worst, middle = int(np.argmax(result.residual)), float(np.median(result.residual))
    if result.residual[worst] > max(_OUTLIER * middle, _OUTLIER_MM):
        warn(
            f"{points.table.name}: {points.table.at(worst)}: lies {result.residual[worst]:.3f} mm "
            f"off the part, the median of all {middle:.3f} mm: touch it again"
        )
    if start is not None:
        moved, turned = _moved(result, start, points.base)
        if _beyond(moved, turned):
            warn(
                f"{points.table.name}: the start is bad, {moved:.1f} mm and {turned:.1f}° from the "
                "pose that was found; no other in all orientations fits as well"
            )
            return
        tell(f"{moved:.1f} mm and {turned:.1f}° from the start")
