"""What was felt on the strokes of a run, and on how much of each the tool was in contact."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dmpcli.metrics.contact import contact


@dataclass
class _StrokeTally:
    """Cycles of one stroke that were to be in contact, and those that were."""

    cycles: int = 0
    touching: int = 0

    @property
    def share(self) -> float:
        return self.touching / self.cycles if self.cycles else 1.0


class ContactTally:
    """Counts the cycles in which a force was wanted.

    Attributes
    ----------
    felt : list of float
        Forces along the normal, N.
    """

    def __init__(self) -> None:
        self.felt: list[float] = []
        self._errors: list[float] = []
        self._touching = self._saturated = 0
        self._strokes: dict[str, _StrokeTally] = {}
        self._now = _StrokeTally()

    def begin(self, name: str) -> None:
        """Go on with another stroke."""
        self._now = self._strokes[name] = _StrokeTally()

    def add(self, force: float, wanted: float, touching: bool, saturated: bool) -> None:
        """Count one cycle.

        Parameters
        ----------
        force, wanted : float
            Along the normal, N.
        touching : bool
            Whether that is a contact.
        saturated : bool
            Whether the correction met its own limits.
        """
        self.felt.append(force)
        self._errors.append(force - wanted)
        self._touching += touching
        self._saturated += saturated
        self._now.cycles += 1
        self._now.touching += touching

    def share(self, name: str) -> float:
        """Share of a stroke in contact, of the part that was to be; 0 to 1."""
        return self._strokes[name].share

    def facts(self, threshold: float) -> dict[str, Any]:
        """Return what a run file says of it; empty where no force was wanted.

        Parameters
        ----------
        threshold : float
            N; less is no contact.
        """
        if not self.felt:
            return {}
        errors = np.array(self._errors)
        return asdict(contact(np.array(self.felt), threshold)) | {
            "share": self._touching / len(self.felt),
            "rms_error": float(np.sqrt(np.mean(errors**2))),
            "saturated": self._saturated / len(self.felt),
            "shares": {name: one.share for name, one in self._strokes.items() if one.cycles},
        }
