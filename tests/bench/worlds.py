"""Benches without noise, for tests; nothing of MuJoCo is imported before one is made."""

from dataclasses import replace

import numpy as np

from dmpcli.bench.parameters import BenchParameters, Pen, WristSensor
from dmpcli.bench.workpiece import Flat, placed
from dmpcli.bench.world import World
from dmpcli.spatial.pose import Pose

UP, ALONG = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
TIP = BenchParameters().position
FRAME = placed(TIP, UP, ALONG)
QUIET = WristSensor(noise=np.zeros(6))
PERIOD = 0.02


def world(workpiece=None, pen=None, **more):
    """A bench with the surface at the tip."""
    parts = {"workpiece": workpiece or Flat(FRAME), "pen": pen or Pen(), "sensor": QUIET}
    return World(replace(BenchParameters(), **(parts | more)))


def at(bench, *offset):
    """The pose of a bench's start, moved by so much, mm."""
    start = bench.parameters
    return Pose(start.position + np.array(offset), start.rotation)


def press(bench, depth, seconds=0.8):
    """Lead the pen into the surface, and wait until it rests."""
    for k in range(1, 11):
        bench.step(PERIOD, at(bench, 0.0, 0.0, -depth * k / 10))
    for _ in range(round(seconds / PERIOD)):
        bench.step(PERIOD)


def slide(bench, depth, speed, seconds, direction=(1.0, 0.0)):
    """Draw a line with the pen so deep; return force and tip of each millisecond."""
    forces, tips = [], []
    for k in range(round(seconds / PERIOD)):
        way = speed * PERIOD * k
        pose = at(bench, way * direction[0], way * direction[1], -depth)
        bench.start(PERIOD)
        bench.send(bench.joints_of(pose, bench.reference.position))
        end = bench.t + PERIOD
        while bench.t < end - 1e-9:
            bench.advance(min(bench.t + 1e-3, end))
            forces.append(bench.contact_force)
            tips.append(bench.tip)
    return np.array(forces), np.array(tips)
