"""How a recording was read, told by the commands that take any."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dmpcli.primitives.smoothing import Stroke
    from dmpcli.records.layouts import Layout
    from dmpcli.records.recordings import Recording
    from dmpcli.records.streams import Source


def recording(source: "Source", layout: "Layout | None") -> "Stroke":
    """Read a recording, and say how it was read and what is doubtful about it."""
    from dmpcli.records import recordings

    found = recordings.read(source, layout)
    announce(source.name, found, layout)
    return found.stroke


def announce(name: str, found: "Recording", layout: "Layout | None") -> None:
    """Say how a recording was read and what is doubtful about it."""
    from dmpcli.messages import tell, warn

    if found.ours and layout is not None:
        tell(f"{name}: is dmpcli's own and tells its columns and units; options were not used")
    for remark in found.told:
        tell(f"{name}: {remark}")
    for doubt in found.doubts:
        warn(f"{name}: {doubt}")
