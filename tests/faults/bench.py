"""The bench: an EC66 and a Net F/T box in simulated time, behind the real drivers.

The drivers' own encoders, parsers, checks and loops run as they do in a real cell; what is
replaced is what they stand on: the machine's clock, sockets, and the threads that read these.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib import metadata
from types import SimpleNamespace
from typing import Any, TypeAlias
from unittest import mock

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments import clock as clocks
from dmpcli.instruments import sockets
from dmpcli.instruments.elite import controller as elite_controller
from dmpcli.instruments.elite import jsonrpc, monitor
from dmpcli.instruments.netft import box_watch, http_client, protocol
from dmpcli.instruments.netft import driver as netft_driver
from dmpcli.simulation.elite_server import lab as elite_lab
from dmpcli.simulation.elite_server import rpc
from dmpcli.simulation.elite_server.lab import LabParameters, VirtualLab
from dmpcli.simulation.elite_server.monitor import PERIOD
from dmpcli.simulation.elite_server.parameters import RpcError
from dmpcli.simulation.elite_server.visiting_hand import VisitingHand
from dmpcli.simulation.netft_server import box as netft_box
from dmpcli.simulation.netft_server import pages, state
from dmpcli.simulation.netft_server.faults import BoxFaults
from dmpcli.simulation.netft_server.sender import Sender
from dmpcli.simulation.netft_server.settings import BoxSettings
from tests.faults.wires import Connection, Exchange, Mailbox
from tests.faults.world import World

RPC_PORT, MONITOR_PORT = 8055, 8056
# Read once: what is installed does not change from run to run.
_INSTALLED = metadata.entry_points()
SOURCE = ("127.0.0.1", 49152)
STRANGER = ("127.0.0.1", 49999)

Wire: TypeAlias = Callable[[bytes], list[tuple[bytes, float]]]
"""From bytes that are sent to what arrives of them, and how much later, s."""


class LockStepMonitor(monitor.Monitor):
    """The driver's monitor without its thread: frames are fed as they arrive."""

    world: World

    def open(self) -> None:
        """As of a `Monitor`."""
        link: Any = sockets.connect(self._host, self._port, self._patience, self._what)
        self._socket = link

        def listen() -> None:
            for report in self._frames.feed(link.drained(), self._clock.now()):
                self._take(report)
            if link.closed:
                self._gone = "the controller closed the connection"

        link.heard = listen
        self._news: Any = SimulatedCondition(self.world)
        self._news.wait_for(lambda: self._newest or self._gone, self._patience)
        try:
            self.newest()
        except Exception:
            self.close()
            raise


class LockStepWatch(box_watch.BoxWatch):
    """The driver's watch over a box's pages without its thread: events look, and take no time."""

    world: World
    aside: set[str]

    def __init__(self, pages: Any, before: Any, every: float) -> None:
        self._pages, self._before = pages, before
        self.fault = None
        self._ending, self._asked = threading.Event(), threading.Event()
        self._thread: Any = SimpleNamespace(join=lambda _: None)
        self._rests = self.world.now()

        self.world.every(every, self._turn)

    def look_soon(self) -> None:
        """As of a `BoxWatch`."""
        if not self._asked.is_set():
            self._asked.set()
            self.world.at(max(self._rests, self.world.now() + 2e-3), self._turn)

    def _turn(self) -> bool:
        self._asked.clear()
        if self.fault is None and not self._ending.is_set():
            self.aside.add("watch")
            self._look()
            self.aside.discard("watch")
            self._rests = self.world.now() + box_watch.PAUSE
        return self.fault is None and not self._ending.is_set()


class SimulatedCondition:
    """A condition on which one waits in simulated time."""

    def __init__(self, world: World) -> None:
        self._world = world

    def __enter__(self) -> "SimulatedCondition":
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is held."""

    def wait_for(self, done: Callable[[], object], timeout: float) -> bool:
        """As of a condition."""
        return self._world.wait(done, self._world.now() + timeout)

    def notify_all(self) -> None:
        """Whoever waits looks by itself."""


class LockStepBox(netft_box.RdtBox):
    """The sensor's box: what it streams is sent by events, and not by a thread."""

    def __init__(self, world: World, read: Callable[[float], Floats], faults: BoxFaults) -> None:
        super().__init__(read, BoxSettings(rdt_port=SOURCE[1]), faults)
        self._world = world
        self._streamed: Any = None

    def plug(self, mailbox: Mailbox) -> None:
        """Send to this mailbox from now on."""
        self.sender = LockStepSender(mailbox, self.faults)

    def receive(self, datagram: bytes, mailbox: Mailbox) -> None:
        """Obey a datagram."""
        asked = protocol.parse_request(datagram)
        if asked is not None:
            self._command(*asked, mailbox.ADDRESS)
        self._go_on()

    def _go_on(self) -> None:
        request = self._request
        if request is None or request is self._streamed:
            return
        self._streamed = request

        def due() -> None:
            if self._request is request:
                self._stream(request)
                self._world.at(request.due, due)

        self._world.at(request.due, due)


class LockStepSender(Sender):
    """The box's sender, into a mailbox."""

    def __init__(self, mailbox: Mailbox, faults: BoxFaults) -> None:
        self._faults = faults
        self._rng = np.random.default_rng([faults.seed, 0xF7])
        self._socket: Any = SimpleNamespace(sendto=lambda d, _: mailbox.sendto(d, SOURCE))
        self._stranger: Any = SimpleNamespace(sendto=lambda d, _: mailbox.sendto(d, STRANGER))
        self._held = None
        self.offered = 0
        self.lost = self.duplicated = self.reordered = self.malformed = self.foreign = 0


class Bench:
    """One experiment.

    Parameters
    ----------
    parameters : LabParameters
    hand : VisitingHand, optional
    seed : int
        Of the box's own faults.

    Attributes
    ----------
    world : World
    lab : VirtualLab
    exchange : Exchange
    box : LockStepBox
    reply, frame : callable
        What a reply or a frame becomes on its way: from bytes to pairs of bytes and delay, s.
    page : callable
        What a page becomes on its way, and how long it takes, s.
    answers : callable
        What the controller answers to a method with its parameters.
    signal : callable
        Sends a signal to the command.
    sent : list
        Time, s, and joint angles, rad, of each set-point that the controller took.
    begun : list of callable
        Called when the first set-point comes, or a plan is played.
    must_stop, must_stop_with_sensor : list of float
        s after that, from when on the arm must not draw on; with a sensor, or always.
    must_heed : list of float
        s after that, when signals came: one stops a stroke that has set-points left to be sent.
    entered, ended : float
        When the motion began, and when the last set-point came or the arm came to rest, s.
    """

    def __init__(
        self, parameters: LabParameters, hand: VisitingHand | None = None, seed: int = 0
    ) -> None:
        self.world = World()
        self._stack = ExitStack()
        for module in (elite_lab, netft_box, state, pages, jsonrpc, http_client):
            self._stack.enter_context(mock.patch.object(module, "time", self.world))
        self.lab = VirtualLab(parameters, hand, self.world.now)
        self.box = LockStepBox(self.world, self.lab.wrench, BoxFaults(seed=seed))
        self.exchange = Exchange(self.world)
        self.exchange.services = {RPC_PORT: self._requests, MONITOR_PORT: self._frames}
        self.lab.drop = self._drop
        self.reply: Wire = lambda r: [(r, 3e-4)]
        self.frame: Wire = lambda f: [(f, 3e-4)]
        self.page: Callable[[bytes], tuple[bytes, float]] = lambda p: (p, 2e-3)
        self.answers: Callable[[str, dict[str, Any]], Any] = self.lab.call
        self.signal: Callable[[int], object] = lambda _: None
        self.sent: list[tuple[float, Floats]] = []  # set-points that the controller took, rad
        self.begun: list[Callable[[], None]] = []
        self.must_stop: list[float] = []
        self.must_stop_with_sensor: list[float] = []
        self.must_heed: list[float] = []
        self.entered = self.ended = 0.0

    @contextmanager
    def laid_out(self) -> Iterator[None]:
        """The drivers stand on this bench while this is entered."""
        world = self.world
        aside: set[str] = set()

        def get(box: Any, path: str, deadline: float) -> bytes:
            del box
            status, _, page = pages.get(self.box, path)
            content, delay = self.page(page.encode())
            if not aside:
                if world.now() + delay > deadline:
                    world.advance(deadline)
                    raise http_client.NoAnswerError("HTTP port 80: timed out")
                world.sleep(delay)
            if status >= 400:
                raise http_client.NoAnswerError(f"HTTP port 80: {path} is answered with {status}")
            return content

        def mailbox(_: object) -> Mailbox:
            made = Mailbox(world, self.box.receive)
            self.box.plug(made)
            return made

        LockStepMonitor.world = LockStepWatch.world = world
        LockStepWatch.aside = aside
        with ExitStack() as stack, self._stack:
            for thing, name, value in (
                (metadata, "entry_points", lambda **only: _INSTALLED.select(**only)),
                (clocks, "MonotonicClock", lambda: world),
                (sockets, "connect", self.exchange.connect),
                (elite_controller, "Monitor", LockStepMonitor),
                (netft_driver, "UdpReceiver", mailbox),
                (netft_driver, "BoxWatch", LockStepWatch),
                (netft_driver, "resolve", lambda *_: SOURCE[0]),
                (http_client.Box, "_get", get),
            ):
                stack.enter_context(mock.patch.object(thing, name, value))
            yield

    def _requests(self) -> Connection:
        lines = rpc.RequestLines()

        def receive(content: bytes) -> None:
            try:
                for line in lines.feed(content):
                    reply = rpc.answer(line, self._call, self.lab.controller.habits.newline)
                    for part, delay in self.reply(reply) if reply else ():
                        link.put(part, delay)
            except RpcError as error:
                link.put(rpc.refusal(error, None, False))

        link = Connection(self.world, receive)
        return link

    def _call(self, method: str, params: dict[str, Any]) -> Any:
        result = self.answers(method, params)
        puts = method == "tt_put_servo_joint_to_buf"
        if puts and result is not False:
            self.sent.append((self.world.now(), np.radians(params["targetPos"])))
        if puts or method == "start_trajectory":
            self.ended = self.world.now()
            if not self.entered:
                self.entered = self.world.now()
                for begin in self.begun:
                    begin()
        return result

    def _frames(self) -> Connection:
        link = Connection(self.world, lambda _: None)

        def send() -> bool:
            for part, delay in self.frame(self.lab.frame()):
                link.put(part, delay)
            return not link.closed

        self.world.every(PERIOD, send)
        return link

    def _drop(self, which: str) -> None:
        for name, port in (("robot", RPC_PORT), ("monitor", MONITOR_PORT)):
            if which in (name, "both"):
                self.exchange.cut(port)
