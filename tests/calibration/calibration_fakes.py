"""An arm and a sensor that do what a test tells them, on a simulated clock."""

import numpy as np

from dmpcli.control.force_sensing import Sensing
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import RobotState, Sample, SensorInfo
from dmpcli.simulation.mock import PEN_DOWN

INFO = SensorInfo("fake", 100.0, np.full(6, 100.0))


class Arm:
    """Stands where `at(t)` says."""

    def __init__(self, clock, at=lambda t: np.zeros(3), rotation=lambda t: PEN_DOWN):
        self.clock, self.at, self.rotation = clock, at, rotation

    def state(self):
        t = self.clock.now()
        return RobotState(t, np.asarray(self.at(t), float), self.rotation(t), "ready")


class Feeler:
    """Sends `wrench(t)` at 100 Hz."""

    def __init__(self, clock, wrench=lambda t: np.zeros(6)):
        self.clock, self.wrench, self.sent = clock, wrench, 0

    def poll(self):
        samples = []
        while (t := (self.sent + 1) / 100.0) <= self.clock.now() + 1e-9:
            self.sent += 1
            samples.append(Sample(t, self.sent, self.wrench(t), healthy=True, lost=0))
        return samples


def sensing(clock, wrench=lambda t: np.zeros(6)):
    felt = Sensing(Feeler(clock, wrench), INFO, 100.0, 0.02, clock)
    felt.first(0.1)
    return felt


__all__ = ["INFO", "PEN_DOWN", "Arm", "Feeler", "SimulatedClock", "sensing"]
