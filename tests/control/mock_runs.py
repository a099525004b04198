"""Whole executions on the mock lab, in memory: what they logged, said and ended with."""

import logging
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby
from unittest import mock

import numpy as np

from dmpcli.control import execution
from dmpcli.errors import DmpError
from dmpcli.records import record, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.spatial import output_events
from dmpcli.spatial.rotations import to_euler_continuous
from dmpcli.workflows.execute import ExecutionRequest, execute
from tests.control.streaming_fakes import stroke

UP = (0.0, 0.0, 1.0)


def short(name="0", duration=0.8, size=0.2, by=(0.0, 0.0, 0.0), **more):
    """A small stroke of the usual form, whose pen presses on a level plate."""
    made = stroke(duration, normal=UP)
    start = made.position[0]
    return replace(made, id=name, position=start + size * (made.position - start) + by, **more)


def source(strokes, **facts):
    """The content of a trajectory file."""
    columns = {name: [] for name in ("id", "t", *schemas.POSE, *schemas.NORMAL, "fn", "event")}
    for one in strokes:
        n = len(one.t)
        angles = np.full((n, 3), np.nan)
        if one.rotation is not None:
            angles = to_euler_continuous(one.rotation)
        normal = np.full((n, 3), np.nan) if one.normal is None else one.normal
        force = np.full(n, np.nan) if one.force is None else one.force
        events = output_events.stored(one.events, one.t) if one.events else [None] * n
        table = np.column_stack([one.t, one.position, angles, normal, force])
        columns["id"].append(np.full(n, one.id, dtype=object))
        columns["event"].append(np.array(events, dtype=object))
        names = ("t", *schemas.POSE, *schemas.NORMAL, "fn")
        for name, values in zip(names, table.T, strict=True):
            columns[name].append(values)
    whole = {name: np.concatenate(parts) for name, parts in columns.items()}
    for name in ("fn", *schemas.NORMAL, *schemas.EULER_ANGLES):
        if np.isnan(whole[name]).all():
            del whole[name]
    if not any(whole["event"]):
        del whole["event"]
    given = {"tau": float(strokes[0].t[-1])} | facts
    made = Record(schemas.TRAJECTORY, whole, Provenance("generalize", {}, (), given))
    return Source("t.parquet", record.encode(made))


@contextmanager
def told():
    """The messages of what is done while this is entered."""
    said = []

    class Listener(logging.Handler):
        def emit(self, one):
            said.append(one.getMessage())

    log, ear = logging.getLogger("dmpcli"), Listener()
    level = log.level
    log.addHandler(ear)
    log.setLevel(logging.INFO)
    try:
        yield said
    finally:
        log.removeHandler(ear)
        log.setLevel(level)


def words(values):
    """A column of texts by its runs."""
    return [f"{len(list(run))} {text}" for text, run in groupby(map(str, values))]


def executed(strokes, facts=None, ids=(), **options):
    """Execute strokes, with options of the request and settings mixed; return all that came of it.

    Returns
    -------
    dict
        The error's class and text or the reason, the run's columns and facts, and what was told.
    """
    known = ExecutionRequest.__dataclass_fields__
    asked = {name: options.pop(name) for name in list(options) if name in known}
    request = ExecutionRequest(source(strokes, **facts or {}), tuple(ids), **asked)
    made, keep = [], execution.record_of

    def keeping(*given):
        made.append(keep(*given))
        return made[-1]

    found = {}
    with told() as said, mock.patch.object(execution, "record_of", keeping):
        try:
            run = execute(ExecuteSettings(**options), request).run
            found["ended"] = "checked" if run is None else run.reason
        except DmpError as error:
            found["ended"] = f"{type(error).__name__}: {error}"
    found["told"] = said
    if made:
        columns = made[0].columns
        found["columns"] = {
            name: words(values) if values.dtype == object else values
            for name, values in columns.items()
        }
        found["facts"] = made[0].provenance.facts
    return found
