"""Random strokes on parts, and a judge of them that is not ours: potpourri3d's geodesic tracer.

The tracer walks straight over the facets, one line at a time. With it goals are laid (so that each
pair has a geodesic), strokes are told that lie on one smooth patch, and refusals are confirmed.
"""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import potpourri3d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dmpcli.surfaces import geodesic_search
from dmpcli.surfaces.surface import Status
from tests.surfaces import fields

SAMPLES, HEIGHT = 300, 5.0
# The reference is traced at every so manieth sample.
EVERY = 4
SMOOTH = 20.0


@dataclass(frozen=True)
class Pairs:
    """Starts, goals (B, 3), unit normals and headings at the start, and lengths (B,)."""

    start: np.ndarray
    goal: np.ndarray
    normal: np.ndarray
    heading: np.ndarray
    face: np.ndarray
    length: np.ndarray

    def rows(self, rows):
        return Pairs(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


class Judge:
    """What is known of a mesh without our walks."""

    def __init__(self, mesh):
        self.mesh = mesh
        self.tracer = potpourri3d.GeodesicTracer(mesh.V, mesh.F)

    @cached_property
    def patches(self):
        """Number of the smooth patch of each face: joined by edges of less than `SMOOTH`."""
        neighbours = self.mesh.topology.neighbours
        face, edge = np.nonzero((neighbours >= 0) & (self.mesh.shape.dihedrals < SMOOTH))
        joined = coo_array(
            (np.ones(len(face)), (face, neighbours[face, edge])), shape=2 * (len(neighbours),)
        )
        return connected_components(joined, directed=False)[1]

    def line(self, face, point, direction, length):
        """Return the polyline (k, 3) of a geodesic; shorter than `length` where it was stopped."""
        if length < 1e-9:
            return np.array([point])
        n = self.mesh.face_normals[face]
        ahead = direction - direction @ n * n
        ahead *= length / np.linalg.norm(ahead)
        share = self._barycentric(face, point)
        return np.asarray(self.tracer.trace_geodesic_from_face(int(face), share, ahead))

    def _barycentric(self, face, point):
        a, b, c = self.mesh.corners[face]
        p, q, r = b - a, c - a, point - a
        pp, pq, qq, rp, rq = p @ p, p @ q, q @ q, r @ p, r @ q
        share = np.array([qq * rp - pq * rq, pp * rq - pq * rp]) / (pp * qq - pq * pq)
        share = np.clip([1.0 - share.sum(), *share], 1e-9, 1.0)
        return share / share.sum()

    def strip(self, pairs, i, heading, length, coordinates):
        """Trace a stroke's points (T, 3), their faces (T,) and which were reached (T,).

        Straight lines over the facets: along the centre line, and at a right angle off it.
        """
        line = self.line(pairs.face[i], pairs.start[i], heading, length)
        ways = np.linalg.norm(np.diff(line, axis=0), axis=1)
        keep = np.flatnonzero(ways > 1e-9)
        line, ways = line[np.append(keep, len(ways))], ways[keep]
        place = np.concatenate([[0.0], np.cumsum(ways)])
        middles = 0.5 * (line[1:] + line[:-1])
        faces = self.mesh.search(middles)[1]
        feet, reached = np.full((len(coordinates), 3), np.nan), np.zeros(len(coordinates), bool)
        for k, (u, v) in enumerate(coordinates[:, :2]):
            if u > place[-1] + 1e-6:
                continue
            at = min(max(int(np.searchsorted(place, u)) - 1, 0), len(ways) - 1)
            ahead = (line[at + 1] - line[at]) / ways[at]
            foot = line[at] + (u - place[at]) * ahead
            face = faces[at]
            sideways = np.cross(self.mesh.face_normals[face], ahead) * np.sign(v)
            out = self.line(face, foot, sideways, abs(v))
            feet[k] = out[-1]
            walked = np.linalg.norm(np.diff(out, axis=0), axis=1).sum()
            reached[k] = walked > abs(v) - 1e-4
        face = np.full(len(feet), -1)
        face[reached] = self.mesh.search(feet[reached])[1]
        return feet, face, reached

    def cross_line(self, pairs, i, heading, u, v):
        """Return the end, its face and e_u there of the cross line to (u, v)."""
        u, v = max(u, 1e-5), v if abs(v) > 1e-5 else 1e-5
        line = self.line(pairs.face[i], pairs.start[i], heading, u)
        ahead = line[-1] - line[-2]
        face = self.mesh.search((line[-1] - 1e-7 * ahead)[None])[1][0]
        ahead /= np.linalg.norm(ahead)
        sideways = np.cross(self.mesh.face_normals[face], ahead) * np.sign(v)
        out = self.line(face, line[-1], sideways, abs(v))
        off = out[-1] - out[-2]
        face = self.mesh.search((out[-1] - 1e-7 * off)[None])[1][0]
        along = np.cross(off / np.linalg.norm(off) * np.sign(v), self.mesh.face_normals[face])
        return out[-1], face, along

    def confirms(self, status, pairs, i, heading, length, coordinates):
        """Tell whether the tracer meets what a stroke is refused for, on the same centre line."""
        if status == Status.OTHER_SIDE:
            return self._thin(pairs.goal[i])
        feet, _, reached = self.strip(pairs, i, heading, length, coordinates)
        if status == Status.BORDER:
            return not reached.all()
        if not reached.all():
            return False
        if status == Status.TORN:
            return self._torn(pairs, i, heading, coordinates, feet)
        if status == Status.FOLDED:
            return self._folded(pairs, i, heading, coordinates)
        return False

    def _thin(self, goal):
        """Tell whether a facet that looks the other way is less than a mm behind a goal."""
        a, b, c = np.moveaxis(self.mesh.corners, 1, 0)
        n = self.mesh.face_normals[self.mesh.search(goal[None])[1][0]]
        normal = np.cross(b - a, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.sum((a - goal) * normal, axis=1) / (normal @ -n)
            hit = goal - depth[:, None] * n
            inside = np.all(
                [
                    np.sum(np.cross(q - p, hit - p) * normal, axis=1) >= 0.0
                    for p, q in ((a, b), (b, c), (c, a))
                ],
                axis=0,
            )
        return np.any(inside & (depth > 1e-6) & (depth <= 1.0) & (normal @ n < 0.0))

    def _torn(self, pairs, i, heading, coordinates, feet):
        """Tell whether points stay apart however near their coordinates are."""
        apart = np.linalg.norm(np.diff(feet, axis=0), axis=1)
        flat = np.linalg.norm(np.diff(coordinates[:, :2], axis=0), axis=1)
        for k in np.argsort(3.0 * flat - apart)[:5]:
            ends = [coordinates[k], coordinates[k + 1]]
            for _ in range(24):
                middle = 0.5 * (ends[0] + ends[1])
                at = [self.cross_line(pairs, i, heading, *c[:2])[0] for c in (*ends, middle)]
                nearer = np.linalg.norm(at[2] - at[0]) < np.linalg.norm(at[2] - at[1])
                ends[0 if nearer else 1] = middle
            if np.linalg.norm(at[1] - at[0]) > 0.1:
                return True
        return False

    def _folded(self, pairs, i, heading, coordinates):
        """Tell whether cross lines that begin ahead end back along e_u, by a fifth of a mm."""
        some = coordinates[coordinates[:, 0] > 0.01]
        lines = [self.cross_line(pairs, i, heading, u, v) for u, v in some[:, :2]]
        at, face, along = (np.array(part) for part in zip(*lines, strict=True))
        normal = self.mesh.face_normals[face]
        way = np.sum(np.diff(at, axis=0) * 0.5 * (along[1:] + along[:-1]), axis=1)
        # Over a crease there is no one direction.
        way[np.sum(normal[1:] * normal[:-1], axis=1) < np.cos(np.radians(10.0))] = 0.0
        gone = np.concatenate([[0.0], np.cumsum(way)])
        return np.max(np.maximum.accumulate(gone) - gone) > 0.2


def traced(judge, count, rng, reach=(10.0, 30.0)):
    """Return pairs of random starts by area, and goals at random lengths in random headings."""
    mesh = judge.mesh
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    face = rng.choice(len(area), count, p=area / area.sum())
    start = np.einsum("ni,nij->nj", rng.dirichlet([1, 1, 1], count), mesh.corners[face])
    normal = mesh.face_normals[face]
    heading = np.cross(normal, rng.normal(size=(count, 3)))
    heading /= np.linalg.norm(heading, axis=1, keepdims=True)
    length = rng.uniform(*reach, count)
    goal = np.array(
        [
            judge.line(f, s, h, r)[-1]
            for f, s, h, r in zip(face, start, heading, length, strict=True)
        ]
    )
    return Pairs(start, goal, normal, heading, face, length)


def smooth(judge, count, rng):
    """Return such pairs whose strokes lie on one smooth patch, seen by the tracer."""
    found = []
    for _ in range(40 * count):
        if len(found) == count:
            break
        pairs = traced(judge, 1, rng)
        stroke = fields.strokes(pairs.length, SAMPLES, height=HEIGHT)[0, ::EVERY]
        # Quick: most that do not lie on a patch show it at their extrema.
        some = [0, *np.argsort(np.abs(stroke[:, 1]))[-6:], -1]
        own = judge.patches[pairs.face[0]]
        for part in (stroke[some], stroke):
            _, face, reached = judge.strip(pairs, 0, pairs.heading[0], pairs.length[0], part)
            if not (reached.all() and (judge.patches[face] == own).all()):
                break
        else:
            found.append(pairs)
    return joined(found)


def joined(found):
    """Return pairs one after the other."""
    return Pairs(
        *(np.concatenate([getattr(p, name) for p in found]) for name in Pairs.__dataclass_fields__)
    )


@dataclass(frozen=True)
class Drawn:
    """Strokes drawn on pairs, and what is wrong with each (B,): an empty word, or what."""

    charts: object
    lift: object
    coordinates: np.ndarray
    wrong: np.ndarray


def draw(judge, pairs):
    """Draw waves on pairs and look at what came out."""
    mesh = judge.mesh
    charts = mesh.charts(pairs.start, pairs.goal, pairs.normal)
    coordinates = fields.strokes(charts.lengths, SAMPLES, height=HEIGHT)
    lift = charts.lift(coordinates)
    wrong = np.full(len(pairs.length), "", dtype=object)
    position = lift.position
    hits = mesh.closest(position)
    move = np.linalg.norm(np.diff(position, axis=1), axis=-1)
    flat = np.linalg.norm(np.diff(coordinates, axis=1), axis=-1)
    ends = np.maximum(
        np.linalg.norm(position[:, 0] - pairs.start, axis=1),
        np.linalg.norm(position[:, -1] - pairs.goal, axis=1),
    )
    lean = leaning(mesh, position, hits.face, lift.normal)
    checks = {
        "end": ends > 0.01,
        "torn": (move > 3.0 * flat + 0.3).any(axis=1),
        "off the mesh": (hits.distance > 1e-5).any(axis=1),
        "leans": (lean > 15.0).any(axis=1),
    }
    for word, mark in checks.items():
        wrong[mark & (wrong == "")] = word
    wrong[lift.status != Status.DRAWN] = ""
    return Drawn(charts, lift, coordinates, wrong)


def leaning(mesh, position, face, normal):
    """Angles, degrees (B, T), of normals to the facet at positions, or one that touches it."""
    either = np.concatenate([face[..., None], mesh.topology.neighbours[face]], axis=-1)
    flat = mesh.face_normals[either]
    near = np.abs(np.sum((position[..., None, :] - mesh.corners[either, 0]) * flat, axis=-1)) < 1e-5
    near &= either >= 0
    cosine = np.where(near, np.abs(np.sum(normal[..., None, :] * flat, axis=-1)), 0.0).max(axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))


@dataclass(frozen=True)
class Verdict:
    """What became of pairs: how many, drawn, wrong ones by what is wrong, refused by status.

    `unconfirmed` are the refusals whose reason the tracer does not meet, as (row, status).
    """

    count: int
    drawn: int
    wrong: dict
    refused: dict
    unconfirmed: list


def verdict(judge, pairs, drawn, rows):
    """Judge the waves that were drawn on some of the pairs."""
    status, charts = drawn.lift.status, drawn.charts
    unconfirmed = []
    for i in rows[status[rows] != Status.DRAWN]:
        what = Status(int(status[i]))
        heading, length = charts.centre.direction[i], charts.lengths[i]
        stroke = drawn.coordinates[i].copy()
        if not charts.creased[i]:  # a line that was stepped along is not the facets' own
            ends = pairs.start[i][None], pairs.goal[i][None]
            heading, length, _ = (found[0] for found in geodesic_search.find(judge.mesh, *ends))
            stroke[:, 0] *= length / charts.lengths[i]
        if not judge.confirms(what, pairs, i, heading, length, stroke):
            unconfirmed.append((int(i), what.name))
    status = status[rows]
    return Verdict(
        len(status),
        int((status == Status.DRAWN).sum()),
        dict(Counter(word for word in drawn.wrong[rows] if word)),
        dict(Counter(Status(int(one)).name for one in status if one != Status.DRAWN)),
        unconfirmed,
    )


def verdicts(mesh, count, seed):
    """Judge so many pairs on smooth patches, and as many traced anywhere; drawn together."""
    judge, rng = Judge(mesh), np.random.default_rng(seed)
    pairs = joined([smooth(judge, count, rng), traced(judge, count, rng)])
    drawn, split = draw(judge, pairs), len(pairs.length) - count
    return tuple(
        verdict(judge, pairs, drawn, rows)
        for rows in np.split(np.arange(len(pairs.length)), [split])
    )
