"""How a recording was read, told by all who take any."""

from dataclasses import replace

from dmpcli.errors import InputError
from dmpcli.messages import tell, warn
from dmpcli.records import recordings
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.recordings import Recording, Span
from dmpcli.spatial.trajectory import Trajectory


def recording(
    source: Source, layout: Layout | None, force: bool = False, span: Span = (None, None)
) -> Trajectory:
    """Read a recording, and say how it was read and what is doubtful about it.

    Parameters
    ----------
    source : Source
    layout : Layout or None
    force : bool
        Whether the force on the tool is wanted too.
    span : (float or None, float or None)
        What of it is wanted, s from its first sample.

    Raises
    ------
    InputError
        It holds no force in every row.
    """
    found = whole(source, layout, force, span)
    return with_force(found, source.name) if force else found.stroke


def with_force(found: Recording, name: str) -> Trajectory:
    """Return a recording's stroke with the force on the tool; refused where it holds none."""
    if found.wrench is None:
        raise InputError(
            f"{name}: --force-profile: holds no wrench in every row; record with --sensor, "
            "or give a table with fx, fy, fz [N] and tx, ty, tz [N·m] on the tool in base axes"
        )
    return replace(found.stroke, contact_force=found.wrench[:, :3])


def whole(
    source: Source, layout: Layout | None, wrench: bool = False, span: Span = (None, None)
) -> Recording:
    """Read a recording with all that was said of it, which is told; see `recordings.read`."""
    found = recordings.read(source, layout, wrench, span)
    if found.ours and layout is not None:
        tell(
            f"{source.name}: is dmpcli's own and tells its columns and units; options were not used"
        )
    for remark in found.told:
        tell(f"{source.name}: {remark}")
    for doubt in found.doubts:
        warn(f"{source.name}: {doubt}")
    return found
