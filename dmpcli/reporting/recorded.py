"""A recording as a stroke of the report: seen as the skill saw it that a stroke was drawn with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import paper_preprocessing, reference_paths, smoothing
from dmpcli.dmp.contact_heights import demonstrated_scale
from dmpcli.dmp.learning import lost_of
from dmpcli.dmp.preprocessing import Preprocessed, preprocess
from dmpcli.dmp.skill import Accuracy, Skill
from dmpcli.dmp.taught_strokes import TaughtStroke, taught_strokes, without_spring
from dmpcli.errors import InputError
from dmpcli.records import schemas
from dmpcli.records.learning_record import Lesson
from dmpcli.records.record import Provenance
from dmpcli.reporting.stroke import LEAST, ReportedStroke, chart_axes
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces import plane
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Surface


@dataclass
class Recorded:
    """A recording, and what is at hand to see it as some skill did.

    Attributes
    ----------
    recording : smoothing.Stroke
    label : str
    name : str
        What messages call the file.
    sha256 : str
    normal : array, shape (3,), optional
        Of the plane that the report was given; otherwise the skill's, or the one `fit` would take.
    origin : Provenance
        Of one of our own files: how it was dragged, along what, and whether it is simulated.
    surfaces : mapping of str to Surface
        Those that the report was given, by their facts.
    skills : sequence of (Lesson, Skill)
        Those that the report was given.
    force : array, shape (T, 3), optional
        On the tool, N, base axes.
    began : float, optional
        What the recording's own clock showed at time 0, s; None where that is not known.
    """

    recording: Trajectory
    label: str
    name: str = ""
    sha256: str = ""
    normal: Floats | None = None
    origin: Provenance = field(default_factory=lambda: Provenance(""))
    surfaces: Mapping[str, Surface] = field(default_factory=dict)
    skills: Sequence[tuple[Lesson, Skill]] = ()
    force: Floats | None = None
    began: float | None = None

    def __post_init__(self) -> None:
        self._views: dict[Lesson, ReportedStroke] = {}
        self._seen: dict[Lesson, Preprocessed] = {}

    def stroke(self, lesson: Lesson | None = None) -> ReportedStroke:
        """Return it as a skill saw it; as `fit` sees it by default where no lesson is known.

        Raises
        ------
        InputError
            The tool does not move, or hardly a sample of it does.
        """
        lesson = Lesson() if lesson is None else lesson.of(self.sha256)
        if lesson not in self._views:
            seen_so = self._as_paper if lesson.learning == "paper" else self._by_noise
            self._views[lesson] = seen_so(lesson)
        return self._views[lesson]

    def seen(self, lesson: Lesson) -> Preprocessed:
        """Return it smoothed by its noise, cut as a lesson says.

        Raises
        ------
        InputError
            Its force was learned too, and is not read.
        """
        cut = Lesson(
            cutoff=None if lesson.learning == "paper" else lesson.cutoff,
            trim=lesson.trim,
            start=lesson.start,
            until=lesson.until,
            cut_pauses=lesson.cut_pauses,
            force_profile=lesson.force_profile,
        )
        if cut not in self._seen:
            _enough(len(self.recording.t))
            self._seen[cut] = preprocess(
                replace(self.recording, contact_force=self._force() if cut.force_profile else None),
                cutoff=cut.cutoff,
                trim=cut.trim,
                start=cut.start,
                until=cut.until,
                cut_pauses=cut.cut_pauses,
            )
        return self._seen[cut]

    def _force(self) -> Floats:
        if self.force is None:
            raise InputError(
                f"{self.name or self.label}: its force was taught, and no wrench is read in it; "
                "give the options that fit was given"
            )
        return self.force

    def taught(self, lesson: Lesson) -> TaughtStroke | None:
        """Return it in a skill's coordinates; None where the taught surface is not at hand."""
        surface = None
        if lesson.surface is not None:
            surface = self.surfaces.get(lesson.surface)
            if surface is None:
                return None
        found, _, _ = taught_strokes([self.seen(lesson)], lesson.choices(), surface, lesson.closed)
        return found[0]

    def _by_noise(self, lesson: Lesson) -> ReportedStroke:
        seen, taught = self.seen(lesson), self.taught(lesson)
        t = seen.raw.t
        _enough(len(t))
        position, raw = seen.position(t), seen.raw.position
        place, length, elsewhere = None, None, False
        lost, skill = lost_of(seen), None
        if taught is None:
            # The surface is not at hand: the skill's own curve tells what was demonstrated on it.
            skill = self._skill(lesson)
            elsewhere = skill is None
            if skill is not None:
                place = demonstrated_scale(skill, t / seen.duration * skill.duration)[:, :3]
                lost = (0.0, 0.0) if skill.reached is None else _strayed(skill.reached)
            start, goal = position[0], position[-1]
            closed = plane.is_closed(position) if lesson.closed is None else lesson.closed
            axes = None
            length = None if place is None or closed else float(place[-1, 0] - place[0, 0])
        else:
            surface = None if lesson.surface is None else self.surfaces[lesson.surface]
            if lesson.force_profile and (surface is None or isinstance(surface, Plane)):
                # On a curved one the chart's place, which is compared, is without it.
                as_seen = position
                position = without_spring(seen, t, taught.frame.axes[:, 2])
                raw = raw + position - as_seen
            start, goal, closed = taught.frame.start, taught.frame.goal, not taught.length
            axes = taught.frame.axes
            if surface is not None:
                place, length = taught.curve(t)[:, :3], taught.length
                if not isinstance(surface, Plane):
                    axes = None
        if self.normal is not None and lesson.surface is None and axes is not None:
            tool = None if seen.rotation is None else seen.rotation(t[:1])[0, :, 2]
            normal = self.normal * plane.side(self.normal, tool)
            axes = chart_axes(start, goal, normal, closed)
        return ReportedStroke(
            t=t,
            position=position,
            raw=raw,
            start=start,
            goal=goal,
            axes=axes,
            closed=closed,
            lesson=lesson,
            place=place,
            geodesic=length or None,
            lost=lost,
            noise=seen.sigma,
            elsewhere=elsewhere,
            by_skill=skill is not None,
            rotation=None if seen.rotation is None else seen.rotation(t),
            **self._said(),
        )

    def _skill(self, lesson: Lesson) -> Skill | None:
        """Find the skill that learned from it so, among those of the report."""
        for own, skill in self.skills:
            if own == lesson and self.sha256 in own.recordings:
                return skill
        return None

    def _as_paper(self, lesson: Lesson) -> ReportedStroke:
        even = smoothing.evenly_sampled(self.recording)
        seen = paper_preprocessing.prepare(even, lesson.choices())
        frame, count = seen.frame, len(seen.stroke.t)
        _enough(count)
        first = int(np.argmin(np.abs(even.t - seen.trimmed[0])))
        axes = frame.axes
        if self.normal is not None:
            tool = None if frame.rotation is None else frame.rotation[:, 2]
            normal = self.normal * plane.side(self.normal, tool)
            axes = chart_axes(frame.start, frame.goal, normal, seen.closed)
        return ReportedStroke(
            t=seen.stroke.t,
            position=seen.stroke.position,
            raw=even.position[first : first + count],
            start=frame.start,
            goal=frame.goal,
            axes=axes,
            closed=seen.closed,
            lesson=lesson,
            **self._said(),
        )

    def _said(self) -> dict[str, Any]:
        """What does not depend on how it is seen."""
        origin = self.origin
        return {
            "label": self.label,
            "kind": schemas.DEMONSTRATION.name,
            "role": "builtin" if origin.options.get("drag") == "builtin" else "demonstration",
            "intended": False,
            "simulated": bool(origin.facts.get("simulated", False)),
            # A noise-free stroke is its own guide.
            "guide": None
            if origin.facts.get("noise_free")
            else _guide(origin.facts.get("reference")),
            "staged": origin.command != "record" or "reference" in origin.facts,
            "seen_by": self.stroke,
        }


def _strayed(reached: Accuracy) -> tuple[float, float]:
    """By how much a skill's own curve strays from what it was learned from: RMS and largest, mm."""
    return reached.rms, reached.largest


def _guide(said: Any) -> Floats | None:
    """Return the curve that a demonstration followed, as far as its facts describe one."""
    if not isinstance(said, dict) or said.get("shape") not in ("sine", "line", "circle"):
        return None
    start, goal = (np.asarray(said[key], dtype=float) for key in ("start", "goal"))
    normal = chart_axes(start, goal, np.array([0.0, 0.0, 1.0]), closed=False)[:, 2]
    t = np.linspace(0.0, 1.0, 1001)
    if said["shape"] == "line":
        return reference_paths.line(start, goal, t, 1.0)
    if said["shape"] == "circle":
        return reference_paths.circle(start, goal, t, 1.0, normal)
    return reference_paths.sine(
        start, goal, said["wave_height"], t, 1.0, said.get("periods", 1.0), normal
    )


def _enough(count: int) -> None:
    if count < LEAST:
        raise InputError(f"a stroke of {count} samples cannot be measured; {LEAST} are needed")
