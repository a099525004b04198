"""Poses whose numbers look like degrees or metres: angles are in rad, lengths in mm."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

_TURN = 6.3
"""rad, a full turn and a little: larger angles were hardly meant."""


def warn_of_angles(option: str, angles: "Sequence[float]") -> None:
    """Doubt angles of more than a turn aloud."""
    import numpy as np

    from dmpcli.messages import warn

    if max(abs(angle) for angle in angles) <= _TURN:
        return
    words = " ".join(f"{value:g}" for value in np.round(np.radians(angles), 5) + 0.0)
    warn(
        f"{option}: {' '.join(f'{angle:g}' for angle in angles)} is more than a turn as rad; if "
        f"these are degrees, give {words}"
    )
