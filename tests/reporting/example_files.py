"""Records of the paper's experiment made from closed forms, for the tests of report and inspect."""

import numpy as np

from dmpcli.metrics.paper_values import GENERALIZATION, REPRODUCTION
from dmpcli.records import schemas
from dmpcli.records.record import Provenance, Record, encode
from dmpcli.records.schemas import POSITION, suffixed
from dmpcli.reporting.recorded import Recorded
from dmpcli.spatial import rotations
from tests.minimum_jerk import minimum_jerk

START, GOAL = np.array(REPRODUCTION.start), np.array(REPRODUCTION.goal)
NEW_START, NEW_GOAL = np.array(GENERALIZATION.start), np.array(GENERALIZATION.goal)
UP = np.array([0.0, 0.0, 1.0])


def wave(start=START, goal=GOAL, height=49.979, periods=1.0, n=501, normal=UP):
    """Sine across the start-goal line, minimum-jerk along it, shape (n, 3)."""
    s = np.linspace(0.0, 1.0, n)
    u = minimum_jerk(s)[:, None]
    v = np.cross(normal, goal - start)
    return (
        start
        + u * (goal - start)
        + 0.5 * height * np.sin(2 * np.pi * periods * u) * v / np.linalg.norm(v)
    )


def circle(centre=START, radius=30.0, n=501):
    a = np.linspace(0.0, 2 * np.pi, n)
    return centre + radius * np.column_stack([np.cos(a), np.sin(a), 0 * a])


def demonstration(path=None, drag="admittance", noise=0.0, facts=None, dt=0.02):
    path = wave() if path is None else path
    path = path + noise * np.random.default_rng(7).standard_normal(path.shape)
    columns = {"t": np.arange(len(path)) * dt} | dict(zip(POSITION, path.T, strict=True))
    said = {"simulated": True, "reference": {"shape": "csv"}} | (facts or {})
    return Record(schemas.DEMONSTRATION, columns, Provenance("record", {"drag": drag}, (), said))


def demonstrated(recording, label, normal=None, origin=None, lesson=None):
    """A recording as a stroke of the report."""
    return Recorded(recording, label, normal=normal, origin=origin or Provenance("")).stroke(lesson)


def trajectory(path, ids=None, dt=0.02, **facts):
    """One stroke, or several of equal length when `ids` names them."""
    ids = ["1"] if ids is None else ids
    each = len(path) // len(ids)
    columns = {
        "id": np.repeat(np.array(ids, dtype=object), each),
        "t": np.tile(np.arange(each) * dt, len(ids)),
    } | dict(zip(POSITION, path.T, strict=True))
    known = {"model": "modified", "forcing_scale": None} | facts
    if len(ids) == 1:
        known = {"start": path[0].tolist(), "goal": path[-1].tolist(), "normal": [0, 0, 1]} | known
    return Record(schemas.TRAJECTORY, columns, Provenance("generalize", {}, (), known))


def run(planned, lag=3, late=()):
    """The trajectory as drawn by an arm `lag` cycles behind, after five cycles of approach."""
    plan = np.vstack([np.repeat(planned.position()[:1], 5, axis=0), planned.position()])
    actual = np.vstack([np.repeat(plan[:1], lag, axis=0), plan[: len(plan) - lag]])
    n = len(plan)
    t = np.arange(n) * 0.02
    deadline, lateness = t.copy(), np.full(n, 1e-4)
    for i in late:
        # The loop was still late at the next deadline, which then passed without a set-point.
        lateness[i] = 0.03
        deadline[i + 1 :] += 0.02
    columns = {"t": t, "t_plan": np.clip(t - 0.1, 0, None)}
    columns |= {"deadline": deadline, "lateness": lateness}
    for suffix, values in (("plan", plan), ("sent", plan)):
        columns |= dict(zip(suffixed(POSITION, suffix), values.T, strict=True))
    columns |= dict(zip(POSITION, actual.T, strict=True))
    columns["state"] = np.array(["ready"] * n, dtype=object)
    columns["phase"] = np.array(["approach"] * 5 + ["stroke"] * (n - 5), dtype=object)
    facts = {"trajectory": planned.provenance.facts, "simulated": True}
    return Record(schemas.RUN, columns, Provenance("execute", {}, (), facts))


def paper_files(folder):
    """Write the paper's experiment with known wave heights; return the paths by name."""
    records = {
        "demo": demonstration(),
        "original": trajectory(wave(height=47.7), model="original", forcing_scale="axis"),
        "modified": trajectory(wave(height=49.2)),
        "literal": trajectory(
            wave(NEW_START, NEW_GOAL, 98.1), model="original", forcing_scale="axis"
        ),
        "distance": trajectory(
            wave(NEW_START, NEW_GOAL, 45.7), model="original", forcing_scale="distance"
        ),
        "carried": trajectory(wave(NEW_START, NEW_GOAL, 49.9)),
    }
    records["drawn"] = run(records["carried"], late=[50])
    return {name: put(folder, name, record) for name, record in records.items()}


def put(folder, name, record):
    path = folder / f"{name}.parquet"
    path.write_bytes(encode(record))
    return str(path)


TOP, TANGENT, RADIUS = -17.54, 5.106, 86.774
"""The bench's rounded side: z of the top, y where it begins, radius, mm."""
CURVED_START = np.array([-551.698, -37.580, -28.765])
CURVED_GOAL = np.array([-657.597, -43.254, -32.265])


def on_fillet(flat):
    """Points (x, length of arc) carried to the rounded side: positions and normals."""
    a = flat[:, 1] / RADIUS
    normal = np.column_stack([0 * a, -np.sin(a), np.cos(a)])
    return normal * RADIUS + np.column_stack([flat[:, 0], 0 * a + TANGENT, 0 * a + TOP - RADIUS]), (
        normal
    )


def off_fillet(point):
    """Points of the rounded side unrolled: x and length of arc."""
    arc = RADIUS * np.arctan2(TANGENT - point[..., 1], point[..., 2] - TOP + RADIUS)
    return np.stack([point[..., 0], arc], axis=-1)


def fillet_wave(height=50.0, n=501):
    """Sine wave along the rounded side at the paper's curved pair: positions and normals."""
    start, goal = off_fillet(CURVED_START), off_fillet(CURVED_GOAL)
    s = np.linspace(0.0, 1.0, n)
    u = minimum_jerk(s)[:, None]
    way = goal - start
    across = np.array([way[1], -way[0]]) / np.linalg.norm(way)
    return on_fillet(start + u * way + 0.5 * height * np.sin(2 * np.pi * u) * across)


def fillet_mesh(step=2.0):
    """Mesh of the rounded side and some of the top: V, F; its corners lie on the surface."""
    x = np.arange(-680.0, -529.0, 10.0)
    arc = np.concatenate([np.arange(-80.0, 0.0, 10.0), np.arange(0.0, 130.0, step)])
    grid = np.stack(np.meshgrid(x, arc, indexing="ij"), axis=-1).reshape(-1, 2)
    V = on_fillet(grid)[0]
    flat = grid[:, 1] < 0.0
    V[flat] = np.column_stack([grid[flat, 0], TANGENT - grid[flat, 1], np.full(flat.sum(), TOP)])
    i = np.arange(len(V)).reshape(len(x), len(arc))
    a, b, c, d = (k.ravel() for k in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    return V, np.concatenate([np.column_stack([a, c, b]), np.column_stack([a, d, c])])


def put_stl(folder, name, V, F):
    """Write a binary STL; return its path."""
    facet = np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    facets = np.zeros(len(F), dtype=facet)
    facets["v"] = V[F]
    path = folder / f"{name}.stl"
    path.write_bytes(b" " * 80 + np.uint32(len(F)).tobytes() + facets.tobytes())
    return str(path)


def curved_trajectory(path, normals=None, rotation=None, dt=0.02, **facts):
    """Trajectory on a curved surface: a normal per row, none in the facts."""
    columns = {"id": np.array(["1"] * len(path), dtype=object), "t": np.arange(len(path)) * dt}
    columns |= dict(zip(POSITION, path.T, strict=True))
    if rotation is not None:
        angles = rotations.to_euler_continuous(rotation)
        columns |= dict(zip(schemas.EULER_ANGLES, angles.T, strict=True))
    if normals is not None:
        columns |= dict(zip(schemas.NORMAL, normals.T, strict=True))
    known = {"model": "modified", "forcing_scale": None}
    known |= {"start": CURVED_START.tolist(), "goal": CURVED_GOAL.tolist()} | facts
    return Record(schemas.TRAJECTORY, columns, Provenance("generalize", {}, (), known))
