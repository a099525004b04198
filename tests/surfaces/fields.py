"""Surfaces whose true geodesics are known from other mathematics than ours, and meshes of them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Two crossing waves of 80 and 62 mm; smallest radius of curvature 29.0 mm (`smallest_radius`).
WAVES = np.array([[0.95, 0.3122, 2 * np.pi / 80.0], [-0.4, 0.9165, 2 * np.pi / 62.0]])
AMPLITUDE = 3.315


@dataclass(frozen=True)
class Field:
    """z = f(x, y) with first and second derivatives, mm."""

    f: Callable
    gradient: Callable
    hessian: Callable

    def point(self, x, y):
        return np.stack([x, y, self.f(x, y)], axis=-1)

    def normal(self, x, y):
        gx, gy = self.gradient(x, y)
        n = np.stack([-gx, -gy, np.ones_like(gx)], axis=-1)
        return n / np.linalg.norm(n, axis=-1, keepdims=True)

    def walk(self, xy, direction, length, steps=80):
        """End point and direction in space of geodesics, by Runge and Kutta's fourth-order steps.

        x'' = -f_x q / (1 + f_x² + f_y²), q the second derivative of f along the way. With 80 steps
        a strip's points are right to 6e-6 mm, seen beside 640.
        """

        def motion(z):
            x, y, p, q = np.moveaxis(z, -1, 0)
            gx, gy = self.gradient(x, y)
            hxx, hxy, hyy = self.hessian(x, y)
            bend = (hxx * p * p + 2 * hxy * p * q + hyy * q * q) / (1 + gx * gx + gy * gy)
            return np.stack([p, q, -gx * bend, -gy * bend], axis=-1)

        z = np.concatenate([xy, direction[..., :2]], axis=-1)
        h = np.asarray(length)[..., None] / steps
        for _ in range(steps):
            a = motion(z)
            b = motion(z + h / 2 * a)
            c = motion(z + h / 2 * b)
            z = z + h / 6 * (a + 2 * b + 2 * c + motion(z + h * c))
        gx, gy = self.gradient(z[..., 0], z[..., 1])
        slope = gx * z[..., 2] + gy * z[..., 3]
        return z[..., :2], np.concatenate([z[..., 2:], slope[..., None]], axis=-1)

    def tangent(self, xy, heading):
        """Unit tangents above directions in the x-y plane."""
        gx, gy = self.gradient(xy[..., 0], xy[..., 1])
        c, s = np.cos(heading), np.sin(heading)
        t = np.stack([c, s, gx * c + gy * s], axis=-1)
        return t / np.linalg.norm(t, axis=-1, keepdims=True)

    def strip(self, xy, direction, coordinates, steps=80):
        """Points, e_v and normals (B, T, 3) of chart coordinates (B, T, 3) off given geodesics."""
        T = coordinates.shape[1]
        start = np.repeat(xy[:, None], T, axis=1)
        first = np.repeat(direction[:, None], T, axis=1)
        at, along = self.walk(start, first, coordinates[..., 0], steps)
        e_v = np.cross(self.normal(at[..., 0], at[..., 1]), along)
        end, e_v = self.walk(at, e_v, coordinates[..., 1], steps)
        return self.point(end[..., 0], end[..., 1]), e_v, self.normal(end[..., 0], end[..., 1])

    def distance(self, points):
        """Distances of points near the surface, by Newton steps along the normal."""
        x, y = points[..., 0].copy(), points[..., 1].copy()
        for _ in range(20):
            n = self.normal(x, y)
            gap = points - self.point(x, y)
            rest = gap - np.sum(gap * n, axis=-1, keepdims=True) * n
            x, y = x + rest[..., 0], y + rest[..., 1]
        return np.linalg.norm(points - self.point(x, y), axis=-1)


def saddle():
    """Return z = (x² - y²) / 240."""
    return Field(
        lambda x, y: (x * x - y * y) / 240,
        lambda x, y: (x / 120, -y / 120),
        lambda x, y: (np.full_like(x, 1 / 120), np.zeros_like(x), np.full_like(x, -1 / 120)),
    )


def bumpy():
    """Return z = a Σ sin(k_i · (x, y) + i), see `WAVES` and `AMPLITUDE`."""
    K = WAVES[:, :2] * WAVES[:, 2:]

    def waves(of, x, y):
        return [AMPLITUDE * of(k[0] * x + k[1] * y + i) for i, k in enumerate(K)]

    def gradient(x, y):
        a, b = waves(np.cos, x, y)
        return tuple(K[0, c] * a + K[1, c] * b for c in (0, 1))

    def hessian(x, y):
        a, b = waves(np.sin, x, y)
        return tuple(
            -K[0, c] * K[0, d] * a - K[1, c] * K[1, d] * b for c, d in ((0, 0), (0, 1), (1, 1))
        )

    return Field(lambda x, y: sum(waves(np.sin, x, y)), gradient, hessian)


def smallest_radius(field, reach=100.0):
    """Smallest radius of normal curvature over a square, mm."""
    x, y = np.meshgrid(np.linspace(-reach, reach, 801), np.linspace(-reach, reach, 801))
    gx, gy = field.gradient(x, y)
    hxx, hxy, hyy = (np.broadcast_to(h, x.shape) for h in field.hessian(x, y))
    w = np.sqrt(1 + gx**2 + gy**2)
    E, F, G = 1 + gx**2, gx * gy, 1 + gy**2
    e, f, g = hxx / w, hxy / w, hyy / w
    det = E * G - F**2
    mean, gauss = (e * G - 2 * f * F + g * E) / (2 * det), (e * g - f * f) / det
    return 1.0 / np.max(np.abs(mean) + np.sqrt(np.maximum(mean**2 - gauss, 0.0)))


def grid(point, nu, nv, u, v):
    """Mesh of a patch given by point(u, v) over ranges, two triangles per cell."""
    U, W = np.meshgrid(np.linspace(*u, nu), np.linspace(*v, nv), indexing="ij")
    V = point(U, W).reshape(-1, 3)
    i = np.arange(nu * nv).reshape(nu, nv)
    a, b, c, d = i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]
    F = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return V, F


def square(field, faces, reach=100.0):
    """Mesh of a height field over a square with about so many faces."""
    n = round(np.sqrt(faces / 2)) + 1
    return grid(field.point, n, n, (-reach, reach), (-reach, reach))


def strokes(lengths, T, periods=2, height=49.98):
    """Chart coordinates (B, T, 3) of sine waves in minimum-jerk time."""
    r = np.linspace(0, 1, T)
    s = r**3 * (10 - 15 * r + 6 * r**2)
    wave = height / 2 * np.sin(2 * np.pi * periods * s)
    out = np.zeros((len(lengths), T, 3))
    out[..., 0], out[..., 1] = np.asarray(lengths)[:, None] * s, wave
    return out


def edge_length(mesh):
    """Mean length of a mesh's edges, mm."""
    return np.linalg.norm(np.roll(mesh.corners, -1, axis=1) - mesh.corners, axis=-1).mean()
