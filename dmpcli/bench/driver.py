"""The bench behind the protocols that real instruments obey: ``bench://ec66?...``.

Robot and sensor of one run share a world, which goes on as far as the clock that they were given:
in lock-step with simulated time. What their URLs say of it is put together.
"""

from collections import deque
from weakref import WeakKeyDictionary

import numpy as np

from dmpcli import messages
from dmpcli.arrays import Floats
from dmpcli.bench import options
from dmpcli.bench.parameters import BenchParameters
from dmpcli.bench.world import World
from dmpcli.errors import InstrumentError
from dmpcli.instruments.address import Address
from dmpcli.instruments.driver_protocol import DriverInfo, DriverState
from dmpcli.instruments.protocols import Clock, Sample, SensorInfo
from dmpcli.records import file_io
from dmpcli.spatial.rotations import to_euler

_EPS = 1e-9
_USUAL_PERIOD = 0.02  # s, for the look-ahead: a set-point is taken up within a period


class Bench:
    """What a robot and a sensor of one run share.

    Parameters
    ----------
    clock : Clock

    Attributes
    ----------
    clock : Clock
    said : dict
        Options of either URL.
    """

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.said: dict[str, str] = {}
        self.arm = ""
        self._world: World | None = None
        self._begun = 0.0
        self._every, self._latency = 0.0, 0.0
        self._streaming_since, self._taken = 0.0, 0
        self._coming: deque[Sample] = deque()

    @property
    def world(self) -> World:
        """The physics; it is made when either instrument is first opened.

        Raises
        ------
        InputError
            An option is wrong.
        """
        if self._world is None:
            self._world = World(options.parameters(self.arm, self.said))
            self._begun = self.clock.now()
            self._latency = self._world.parameters.sensor.latency
        return self._world

    @property
    def parameters(self) -> BenchParameters:
        """What the world is made of."""
        return self.world.parameters

    def go_on(self) -> None:
        """Bring the world up to the clock, through the readings that fall due meanwhile."""
        world, now = self.world, self.clock.now()
        while self._every and (due := self._due()) <= now + _EPS:
            world.advance(due - self._begun)
            self._taken += 1
            self._read(due)
        world.advance(now - self._begun)

    def stream(self, rate: float) -> None:
        """Take a reading every 1/rate s from now on."""
        self.go_on()
        self._every, self._streaming_since, self._taken = 1.0 / rate, self.clock.now(), 0

    def end_stream(self) -> None:
        """Take no more readings."""
        self._every = 0.0
        self._coming.clear()

    def samples(self) -> list[Sample]:
        """Hand out the readings that have arrived."""
        self.go_on()
        arrived, now = [], self.clock.now()
        while self._coming and self._coming[0].t <= now + _EPS:
            arrived.append(self._coming.popleft())
        return arrived

    def keep_truth(self) -> None:
        """Write what truly happened, where it is asked for."""
        world = self._world
        if world is not None and world.truth is not None and world.parameters.truth is not None:
            file_io.write(str(world.parameters.truth), world.truth.encoded())

    def _due(self) -> float:
        return self._streaming_since + (self._taken + 1) * self._every

    def _read(self, t: float) -> None:
        sensed, limit = self.world.sensed(), self.parameters.sensor.limit
        healthy = bool((np.abs(sensed) < limit).all())
        shown = sensed if healthy else np.clip(sensed, -limit, limit)
        self._coming.append(Sample(t + self._latency, self._taken, shown, healthy, 0))


_BENCHES: "WeakKeyDictionary[Clock, Bench]" = WeakKeyDictionary()


def bench_of(address: Address, clock: Clock) -> Bench:
    """Return the bench of a run, one per clock; what the URL says is added to what it knows.

    Raises
    ------
    InputError
        The two URLs name different arms, or say different things of the one bench.
    """
    bench = _BENCHES.setdefault(clock, Bench(clock))
    bench.arm = options.agreed(address, bench.arm, bench.said)
    return bench


class BenchDriver:
    """The bench's arm: set-points of its joints.

    Parameters
    ----------
    bench : Bench
    """

    def __init__(self, bench: Bench) -> None:
        self._bench, self._started = bench, False

    def connect(self) -> DriverInfo:
        """Make the world, and say what its arm is."""
        world = self._bench.world
        servos = world.parameters.servos
        if world.links.told:
            messages.tell(f"bench: {world.arm.name} with {world.links.told}")
        return DriverInfo(
            make=f"bench {world.arm.name}",
            period_range=(servos.shortest_period, servos.longest_period),
            lookahead=_USUAL_PERIOD + servos.delay + servos.lag,
            space="joint",
            # A name, so that whoever knows the arm by it has the same one.
            model=world.arm.name if world.parameters.links is None else world.arm,
            length="mm",
            angle="rad",
            orientation="xyz euler",
            remedy="the bench's own tool is told by tool= of its URL",
        )

    def state(self) -> DriverState:
        """Return what the joints are, and where the bench's own TCP is."""
        self._bench.go_on()
        world = self._bench.world
        pose = world.pose
        six = np.concatenate([pose.position, to_euler(pose.rotation)])
        return DriverState(self._bench.clock.now(), "ready", joints=world.joints, pose=six)

    def start(self, period: float) -> None:
        """Take a set-point every `period` s."""
        self._bench.go_on()
        self._bench.world.start(period)
        self._started = True

    def send(self, target: Floats) -> bool:
        """Head for joint angles, shape (6,), rad."""
        if self._started:
            self._bench.go_on()
            self._bench.world.send(target)
        return self._started

    def stop(self) -> None:
        """Stand still."""
        if self._started:
            self._bench.go_on()
            self._bench.world.stand_still()
        self._started = False

    def close(self) -> None:
        """Stand still; the truth is written where the URL names a file for it."""
        self.stop()
        self._bench.keep_truth()


class BenchSensor:
    """The bench's sensor.

    Parameters
    ----------
    bench : Bench
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    def open(self) -> SensorInfo:
        """Make the world, and say what its sensor is."""
        parameters = self._bench.parameters
        return SensorInfo("bench", 1.0 / parameters.grid, parameters.sensor.limit)

    def start(self, rate: float) -> None:
        """Begin to stream at `rate` Hz; the first reading comes one interval from now.

        Raises
        ------
        InstrumentError
            The physics has no step as short.
        """
        highest = 1.0 / self._bench.parameters.grid
        if not 0.0 < rate <= highest * (1.0 + _EPS):
            raise InstrumentError(f"bench sensor: streams at up to {highest:g} Hz, not {rate:g}")
        self._bench.stream(rate)

    def poll(self) -> list[Sample]:
        """Return the readings that have arrived since the last call, oldest first."""
        return self._bench.samples()

    def close(self) -> None:
        """Stop streaming."""
        self._bench.end_stream()


def robot(address: Address, clock: Clock) -> BenchDriver:
    """Make the arm of ``--robot bench://ARM?...``."""
    return BenchDriver(bench_of(address, clock))


def sensor(address: Address, clock: Clock) -> BenchSensor:
    """Make the sensor of ``--sensor bench://ARM?...``."""
    return BenchSensor(bench_of(address, clock))


robot.lock_step = sensor.lock_step = True  # type: ignore[attr-defined]
