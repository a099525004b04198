"""What the strokes of a batch are measured against, and by which skill that is seen."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.contact_heights import ContactHeights
from dmpcli.metrics.deviation import Taught
from dmpcli.metrics.many_on_surface import TaughtHeights
from dmpcli.records import learning_record as lessons
from dmpcli.records.learning_record import Lesson
from dmpcli.reporting.report_surface import Grounds, ReportSurface
from dmpcli.reporting.stroke import ReportedStroke, as_drawn
from dmpcli.reporting.strokes import over_of


@dataclass(frozen=True)
class Drawn:
    """How a skill saw its recordings, and what it changed where it drew; see `ReportedStroke`."""

    lesson: Lesson | None = None
    over: ContactHeights | None = None
    size: float = 1.0
    turn: float = 0.0


_AS_TAUGHT = Drawn()


@dataclass(frozen=True)
class MeasurementContext:
    """What strokes are measured against.

    Attributes
    ----------
    reference : ReportedStroke, optional
        The demonstration.
    ground : ReportSurface, optional
        The surface of the report.
    normal : array, shape (3,), optional
        Of a surface that is a plane.
    drawn : Drawn
        By which skill the demonstration is seen.
    grounds : Grounds, optional
        The surfaces of batches, where each stroke has its own.
    compiled : bool
        Whether by kernels: the same figures but for rounding.
    """

    reference: ReportedStroke | None = None
    ground: ReportSurface | None = None
    normal: Floats | None = None
    drawn: Drawn = _AS_TAUGHT
    grounds: Grounds | None = None
    compiled: bool = False
    _others: dict[Drawn, "MeasurementContext"] = field(
        default_factory=dict, init=False, compare=False, repr=False
    )

    def of_drawn(self, facts: Mapping[str, Any]) -> "MeasurementContext":
        """Return it as seen by the skill that drew a part, whose facts these are."""
        size, turn = float(facts.get("size", 1.0)), float(facts.get("turn", 0.0))
        drawn = Drawn(lessons.of_facts(facts), over_of(facts), size, turn)
        if drawn == self.drawn or self.reference is None:
            return self
        if drawn not in self._others:
            at = self.reference
            if at.seen_by is not None and drawn.lesson is not None:
                at = at.seen_by(drawn.lesson)
            self._others[drawn] = replace(self, reference=at, drawn=drawn)
        return self._others[drawn]

    @cached_property
    def taught(self) -> Taught | None:
        """The demonstration in its own chart, as it was to be drawn."""
        at = self.reference
        if at is None or at.chart is None or at.elsewhere:
            return None
        d = self.drawn
        return Taught(at.t, as_drawn(at.chart, d.over, d.size, d.turn), self.compiled)

    @cached_property
    def heights(self) -> TaughtHeights | None:
        """Heights of the demonstration over a surface, as they were to be drawn."""
        at = self.reference
        if at is None or at.chart is None or at.closed or at.elsewhere:
            return None
        phase = (at.t - at.t[0]) / (at.t[-1] - at.t[0])
        place = as_drawn(np.asarray(at.chart), self.drawn.over)
        return TaughtHeights(phase, place, self.compiled)
