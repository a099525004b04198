"""dmpcli: one drag-taught stroke, drawn anywhere a position-servo arm can reach.

The names below are the Python API, see docs/api.md; they are loaded when they are first used.
"""

from typing import TYPE_CHECKING, Any

from dmpcli.version import __version__

if TYPE_CHECKING:
    from dmpcli.dmp.skill import Skill
    from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
    from dmpcli.spatial.trajectory import Trajectory
    from dmpcli.surfaces.cylinder import Cylinder
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.plane import Plane
    from dmpcli.surfaces.sphere import Sphere
    from dmpcli.workflows.library import fit, generalize, read, read_surface, write
    from dmpcli.workflows.report import StrokeReport
    from dmpcli.workflows.reports import inspect, report, wave_heights
    from dmpcli.workflows.runs import execute, record
    from dmpcli.workflows.values import Demonstration, Run, TrajectoryBatch

_HOMES = {
    "DmpError": "errors",
    "InputError": "errors",
    "InstrumentError": "errors",
    "RefusedError": "errors",
    "Skill": "dmp.skill",
    "Trajectory": "spatial.trajectory",
    "Cylinder": "surfaces.cylinder",
    "Mesh": "surfaces.mesh",
    "Plane": "surfaces.plane",
    "Sphere": "surfaces.sphere",
    "Demonstration": "workflows.values",
    "StrokeReport": "workflows.report",
    "Run": "workflows.values",
    "TrajectoryBatch": "workflows.values",
    "execute": "workflows.runs",
    "fit": "workflows.library",
    "generalize": "workflows.library",
    "inspect": "workflows.reports",
    "read": "workflows.library",
    "read_surface": "workflows.library",
    "record": "workflows.runs",
    "report": "workflows.reports",
    "wave_heights": "workflows.reports",
    "write": "workflows.library",
}

__all__ = [
    "Cylinder",
    "Demonstration",
    "DmpError",
    "InputError",
    "InstrumentError",
    "Mesh",
    "Plane",
    "RefusedError",
    "Run",
    "Skill",
    "Sphere",
    "StrokeReport",
    "Trajectory",
    "TrajectoryBatch",
    "__version__",
    "execute",
    "fit",
    "generalize",
    "inspect",
    "read",
    "read_surface",
    "record",
    "report",
    "wave_heights",
    "write",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'dmpcli' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"dmpcli.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
