"""Force sensors of the tests."""

import numpy as np

from dmpcli.instruments.protocols import Sample, SensorInfo


class StreamingSensor:
    """Sends `wrench(t)` in sensor axes at its rate, except where `silent(t)`."""

    def __init__(self, clock, wrench=lambda t: np.zeros(6), silent=lambda t: False):
        self.clock, self.wrench, self.silent = clock, wrench, silent
        self.limit = np.full(6, 100.0)
        self.healthy = True
        self.closed = 0
        self.seq = 0

    def open(self):
        return SensorInfo("fake", 1000.0, self.limit)

    def start(self, rate):
        self.begun, self.rate = self.clock.now(), rate

    def poll(self):
        samples = []
        while (t := self.begun + (self.seq + 1) / self.rate) <= self.clock.now() + 1e-9:
            self.seq += 1
            if not self.silent(t):
                samples.append(Sample(t, self.seq, self.wrench(t), self.healthy, 0))
        return samples

    def close(self):
        self.closed += 1


class PolledSensor:
    """A sample with every poll, except where `silent`; `wrench` is what it senses."""

    def __init__(self, clock, wrench=(0.0,) * 6):
        self.clock, self.wrench, self.silent = clock, wrench, False

    def poll(self):
        if self.silent:
            return []
        return [Sample(self.clock.now(), 1, np.array(self.wrench, dtype=float), True, 0)]


class BatchSensor:
    """Hands out one batch of samples after the other."""

    def __init__(self, *batches):
        self.batches = list(batches)

    def poll(self):
        return self.batches.pop(0) if self.batches else []
