"""How ``generalize`` draws a table that names the surface of each pair.

What the words of the table can tell is checked before anything is drawn; a surface itself is read
where its pairs are drawn, and what stands against it, or against pairs on it, is told by row.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.batch.site import PreparedSite, Remark, Site, SiteFile
from dmpcli.batch.task import Task
from dmpcli.dmp.copies import ends
from dmpcli.dmp.drawn_strokes import GeneralizeOptions, OnBorder
from dmpcli.dmp.feasibility import admit, snapped
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.sides import turned_over
from dmpcli.dmp.skill import Skill
from dmpcli.errors import InputError
from dmpcli.kinematics.reachability import Reach
from dmpcli.messages import heard, warn
from dmpcli.records import file_io, learning_record, pose
from dmpcli.records.file_io import Source
from dmpcli.records.learned_skill import LearnedSkill
from dmpcli.records.mesh_store import MeshStore
from dmpcli.records.pairs import PairTable
from dmpcli.records.record import Provenance
from dmpcli.records.schemas import OK
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.spatial.output_events import asked
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.surface import Surface
from dmpcli.workflows import process
from dmpcli.workflows.generalize import (
    Order,
    Ready,
    asked_events,
    check_asked,
    durations,
    objections,
)
from dmpcli.workflows.generalize_inputs import facing_tool, in_base, reach_of, style_of
from dmpcli.workflows.generalize_messages import mark, tell_of_stretch, tell_of_surface
from dmpcli.workflows.surface_input import SurfaceInput, placed_input, store_in
from dmpcli.workflows.table_sites import POSE_COLUMN, TableSites

_MOST_FACES = 100_000
"""Meshes of so many faces together are held for the next pairs on them."""


def prepared_sites(order: Order, named: TableSites, cache: str | None = None) -> Ready:
    """Check an order whose table names surfaces, as far as the table alone can tell.

    Parameters
    ----------
    order : Order
        Without a surface of its own.
    named : TableSites
        What becomes of the table's words.
    cache : str, optional
        Folder of prepared meshes.

    Raises
    ------
    InputError
        The skill cannot give what is asked; or a surface is missing and `Order.stop` holds.
    """
    skill, settings, table = order.skill, order.settings, order.table
    otherwise = named.otherwise
    assert table.places is not None
    options = settings.as_options() | order.options | {"on_border": order.on_border}
    said = {
        "surface_unit": otherwise.unit,
        "in": otherwise.axes if otherwise.axes != "base" else None,
    }
    options |= {key: value for key, value in said.items() if value is not None}
    inputs = [{"role": "skill", "sha256": skill.sha256}]
    if otherwise.pose is not None:
        options["surface_pose"] = _said_pose(otherwise.pose)
    reach = reach_of(order.robot_model, order.tool, skill.oriented, options, inputs)
    inputs += order.inputs
    check_asked(skill, table, settings)
    process.check_skill(settings, skill, table, order.keep_out)
    if order.keep_out is not None:
        inputs.append({"role": "keep-out", "sha256": file_io.read(order.keep_out).sha256})
    table = process.copied(table, settings)
    said_mark = mark(skill, skill.name)
    if said_mark is not None:
        warn(said_mark)
    sites = named.of(table)
    bad = np.flatnonzero(~table.good)
    if order.stop and len(bad):
        raise InputError(f"{table.name}: {table.status[bad[0]]}")
    work = SiteWork(
        skill,
        settings,
        order.on_border,
        order.keep_out,
        reach,
        SurfaceReader(store_in(cache, settings.compiled)),
    )
    return Ready(
        Task(skill.plain(), None, settings.style(), reach, asked_events(settings)),
        table,
        durations(skill, table.duration, settings),
        Provenance(
            "generalize", options, tuple(inputs), learning_record.of_skill(skill.file).facts()
        ),
        sites,
        work,
    )


def _said_pose(given: str) -> list[float] | str:
    """Six numbers as they are, a pose file by its hash."""
    _, source = pose.parse(given, "--surface-pose")
    return [float(word) for word in given.split()] if source is None else source.sha256


class SurfaceReader:
    """Reads the surfaces of sites, and holds the last ones.

    Parameters
    ----------
    store : MeshStore
    """

    def __init__(self, store: MeshStore) -> None:
        self.store = store
        self._open: dict[Site, SurfaceInput] = {}

    def __reduce__(self) -> tuple[type["SurfaceReader"], tuple[MeshStore]]:
        # What is held stays; another process begins with nothing.
        return type(self), (self.store,)

    def read(self, site: Site) -> tuple[SurfaceInput, list[Remark]]:
        """Return a surface as placed, and what is told of it when it is read from its file.

        Raises
        ------
        InputError
            It cannot be read or placed.
        """
        key = replace(site, axes="", offset=0.0)
        if key in self._open:
            self._open[key] = self._open.pop(key)
            return self._open[key], []
        name = site.surface.name
        with heard() as told:
            at: tuple[Pose, Source | None] | None = None
            if isinstance(site.pose, SiteFile):
                source = site.pose.read()
                at = pose.decode(source)[0], source
            elif site.pose is not None:
                at = pose.parse(site.pose, POSE_COLUMN)
            words = site.pose if isinstance(site.pose, str) else None
            read = placed_input(
                site.surface.read(), words, at, site.unit, f"{name}, {POSE_COLUMN}", self.store
            )
        self._open[key] = read
        while len(self._open) > 1 and sum(map(_faces, self._open.values())) > _MOST_FACES:
            del self._open[next(iter(self._open))]
        return read, _remarks(name, told)


@dataclass(frozen=True)
class SiteWork:
    """Makes pairs ready that lie on surfaces of their own; see `Prepare`.

    The side of a plane's normal follows the tool of the pairs that are prepared together.
    """

    skill: LearnedSkill
    settings: GeneralizeSettings
    on_border: OnBorder
    keep_out: Path | None
    reach: Reach | None
    reader: SurfaceReader

    @cached_property
    def plain(self) -> Skill:
        """The skill that is drawn, one for all sites: what it has found once it knows."""
        return self.skill.plain()

    @cached_property
    def _styles(self) -> dict[float, GeneralizeOptions]:
        return {}

    def _style(self, given: Surface, offset: float) -> GeneralizeOptions:
        """How strokes are drawn over a surface: of one offset, over one as over another."""
        if offset not in self._styles:
            settings = self.settings
            style = style_of(settings.style(), self.skill, given, settings.contact, offset)
            self._styles[offset] = style
        return self._styles[offset]

    def __call__(
        self, site: Site, ids: list[str], pairs: Pairs, duration: Floats
    ) -> tuple[PreparedSite, list[Remark]]:
        """Read the site's surface, and hold the pairs against it.

        Raises
        ------
        InputError, RefusedError
            The surface cannot be read or placed, or none of its pairs can be drawn.
        """
        skill, settings, name = self.skill, self.settings, site.surface.name
        if settings.force_setpoint is not None and site.offset > 0.0:
            raise InputError(
                f"--force-setpoint: nothing presses at an offset of {site.offset:g} mm off the "
                "surface; leave one of them out"
            )
        read, remarks = self.reader.read(site)
        table = PairTable(name, ids, pairs, None, duration, [OK] * len(ids))
        with heard() as told:
            if site.axes == "part":
                table = in_base(table, read)
            surface = read.surface
            if settings.compiled and isinstance(surface, Mesh):
                surface = surface.with_kernels
            given = facing_tool(surface, skill, table, name)
            style = self._style(given, site.offset)
            style = process.process_style(style, settings, self.on_border, given, self.keep_out, [])
            tell_of_surface(skill, style, given, table, name)
            verdict = admit(skill, table.pairs, duration, style, given, settings.snap_tol)
            rows = np.arange(len(ids))
            against = objections(verdict, table, rows, skill, settings, read, site.axes == "part")
            tell_of_stretch(verdict, np.flatnonzero(verdict.admitted), skill, name)
        on = snapped(table.pairs, given)
        good = np.flatnonzero(verdict.admitted)
        start, goal = on.start.copy(), on.goal.copy()
        start[good], goal[good] = ends(skill, on[good], given, style.turn)
        task = Task(self.plain, given, style, self.reach, asked(settings.event or ()))
        return (
            PreparedSite(
                task,
                on,
                start,
                goal,
                against,
                (verdict.upright | verdict.deep | verdict.stretched) & ~verdict.far,
                bool(turned_over(skill, on[good], given).all()) and len(good) > 0,
                given.normal.tolist() if isinstance(given, Plane) else None,
            ),
            remarks + _remarks(name, told),
        )


def _faces(read: SurfaceInput) -> int:
    return len(read.surface.F) if isinstance(read.surface, Mesh) else 0


def _remarks(name: str, told: list[tuple[int, str]]) -> list[Remark]:
    return [Remark(level, name, text.removeprefix(f"{name}: ")) for level, text in told]
