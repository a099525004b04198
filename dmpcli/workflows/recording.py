"""How a recording was read, told by all who take any."""

from dmpcli.messages import tell, warn
from dmpcli.records import recordings
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.recordings import Recording
from dmpcli.spatial.trajectory import Trajectory


def recording(source: Source, layout: Layout | None) -> Trajectory:
    """Read a recording, and say how it was read and what is doubtful about it."""
    return whole(source, layout).stroke


def whole(source: Source, layout: Layout | None, wrench: bool = False) -> Recording:
    """Read a recording with all that was said of it, which is told; see `recordings.read`."""
    found = recordings.read(source, layout, wrench)
    if found.ours and layout is not None:
        tell(
            f"{source.name}: is dmpcli's own and tells its columns and units; options were not used"
        )
    for remark in found.told:
        tell(f"{source.name}: {remark}")
    for doubt in found.doubts:
        warn(f"{source.name}: {doubt}")
    return found
