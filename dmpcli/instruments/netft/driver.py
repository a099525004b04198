"""The force/torque sensor behind ``netft://``.

It stops at the first fault and says what it was; nothing is reconnected behind the loop's back,
since of a sensor that was away nobody knows what it missed.
"""

import contextlib
from dataclasses import dataclass

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments.netft import dialects, protocol
from dmpcli.instruments.netft.box_watch import BoxWatch
from dmpcli.instruments.netft.dialects import Dialect
from dmpcli.instruments.netft.http_client import Box, NoAnswerError, resolve
from dmpcli.instruments.netft.options import ONROBOT_SCALE, NetFtOptions
from dmpcli.instruments.netft.protocol import RDT_PORT, Command, request
from dmpcli.instruments.netft.sequence import ahead
from dmpcli.instruments.netft.settings import BoxInfo
from dmpcli.instruments.netft.stream import SILENCE, Stream
from dmpcli.instruments.netft.udp_receiver import UdpReceiver
from dmpcli.instruments.protocols import Clock, Sample, SensorInfo

ATTEMPTS, PAUSE = 10, 0.1
"""How often a stream is asked for, and how long each time is waited for it, s."""

ROUNDED, MEASURED = 0.05, 0.25
"""Share by which a box may round the rate up; and by which a measured rate may differ."""

_LOOK_UP, _PAGES, _TCP = 0.8, 1.0, 0.6
_LOOK_AGAIN = 0.002
_MEASURING = 0.3
_STOPS, _ON_THE_WAY, _STOP_PAUSE = 5, 0.005, 0.02


@dataclass(frozen=True)
class _Opened:
    """A box that has answered; `pages` is None where it has no web pages."""

    address: tuple[str, int]
    pages: Box | None
    dialect: Dialect
    per_count: Floats
    info: SensorInfo


class NetFtSensor:
    """A sensor that speaks RDT.

    Parameters
    ----------
    host : str
    port : int or None
        RDT's; None is 49152.
    options : NetFtOptions
    clock : Clock
        The real one.

    Attributes
    ----------
    box : BoxInfo or None
        What the box last said of itself; None before `open`.
    stream : Stream or None
        What was lost and dropped; None before `start`.
    """

    def __init__(self, host: str, port: int | None, options: NetFtOptions, clock: Clock) -> None:
        self._host, self._port = host, port or RDT_PORT
        self._options, self._clock = options, clock
        self._opened: _Opened | None = None
        self._mailbox: UdpReceiver | None = None
        self.box: BoxInfo | None = None
        self.stream: Stream | None = None
        self._watch: BoxWatch | None = None

    def open(self) -> SensorInfo:
        """Ask the box what it is.

        Returns
        -------
        SensorInfo
            Its rate is the highest; with ``rate=keep``, the one that the box is set to.

        Raises
        ------
        InstrumentError
            It cannot be reached, or answers what no box does.
        InputError
            It does not tell its range, and no option does.
        """
        try:
            host = resolve(self._host, _LOOK_UP)
        except NoAnswerError as error:
            raise self._failed(f"cannot be reached: {error}") from None
        box, pages = self._ask(Box(host, self._options.http, self._options.tcp))
        limit = box.limit if self._options.range is None else self._options.range
        if limit is None:
            raise InputError(
                f"--sensor netft://{self._host}: the box does not tell its measuring range; add "
                "range=Fx,Fy,Fz,Tx,Ty,Tz (N and N·m) to the options of its URL"
            )
        if not box.enabled:
            raise self._failed("its RDT interface is switched off; enable it on its web page")
        dialect = dialects.of(self._options.dialect, box.product)
        kept = box.rate if self._options.keep_rate else None
        info = SensorInfo(
            dialect.make,
            kept or box.internal_rate or dialect.highest_rate,
            limit,
            product=" ".join(part for part in (box.product, box.configuration) if part),
            serial=box.serial,
        )
        scale = self._options.scale or box.scale
        self.box = box
        self._opened = _Opened((host, self._port), pages, dialect, scale.per_count, info)
        return info

    def start(self, rate: float) -> None:
        """Begin to stream.

        Parameters
        ----------
        rate : float
            Hz.

        Raises
        ------
        InstrumentError
            It is not open, does not take this rate, or sends nothing.
        """
        opened = self._opened
        if opened is None:
            raise self._failed("is not open")
        if not 0.0 < rate <= opened.info.rate:
            raise self._failed(f"cannot stream at {rate:g} Hz, only up to {opened.info.rate:g}")
        self._end()
        self._mailbox = mailbox = UdpReceiver(self._clock)
        told = self._prepare(opened, mailbox, rate)
        self._ask_for_stream(opened, mailbox, told or rate)
        if told is None:
            self._measure(opened, mailbox, rate)
        self.stream = Stream(
            opened.address,
            opened.per_count,
            opened.info.limit,
            opened.dialect.family,
            told or rate,
            self._clock.now(),
            self._options.frozen,
        )
        self._begin_watch(opened.pages)

    def poll(self) -> list[Sample]:
        """Return the samples since the last call, oldest first; never waits.

        Raises
        ------
        InstrumentError
            The stream has a fault; from then on, always this one.
        """
        stream, mailbox = self.stream, self._mailbox
        if stream is None or mailbox is None:
            return []
        letters = mailbox.take()
        if mailbox.dropped and stream.fault is None:
            stream.fault = f"{mailbox.dropped} datagrams came and were not read in time"
        samples = stream.take(letters)
        stream.listen(self._clock.now())
        if stream.fault is None and self._watch is not None:
            if stream.leapt:
                self._watch.look_soon()
            stream.fault = self._watch.fault
        stream.leapt = False
        unhealthy = bool(samples) and not samples[-1].healthy  # tells its fault itself
        if stream.fault is not None and not unhealthy:
            raise self._failed(f"{stream.fault}, stopped")
        return samples

    def close(self) -> None:
        """Stop the stream; may be called twice.

        Raises
        ------
        InstrumentError
            The box was set otherwise while it streamed, and no poll has told it yet.
        """
        stream, watch = self.stream, self._watch
        try:
            self._end()
        finally:
            self._watch = None
            if watch is not None:
                watch.end()
        if stream is not None and stream.fault is None and watch is not None and watch.fault:
            raise self._failed(f"{watch.fault}; what was measured meanwhile is in doubt")

    def _begin_watch(self, pages: Box | None) -> None:
        """Read how the box is set, and look from now on whether it stays so."""
        if self._watch is not None:
            self._watch.end()
            self._watch = None
        if pages is None or self._options.watch == 0.0:
            return
        try:
            before = pages.info(_PAGES)
        except (NoAnswerError, ValueError) as error:
            raise self._failed(f"could not be set up: {error}") from None
        given, opened = self._options.scale is not None, self._opened
        if opened is not None and not given and _differ(before, opened):
            raise self._failed("its scale was changed while it was set up; try again")
        self._watch = BoxWatch(pages, before, self._options.watch)

    def _ask(self, box: Box) -> tuple[BoxInfo, Box | None]:
        """Read what the box says of itself, where it has pages; or its scale alone."""
        if self._options.dialect == "onrobot":
            return BoxInfo("", "", self._options.scale or ONROBOT_SCALE), None
        try:
            try:
                return box.info(_PAGES), box
            except NoAnswerError as error:
                if self._options.scale is not None:
                    return BoxInfo("", "", self._options.scale), None
                without_pages = str(error)
            return BoxInfo("", "", box.calibration(_TCP)), None
        except NoAnswerError as error:
            raise self._failed(
                f"cannot be reached ({without_pages}; {error}); check address, cable and power"
            ) from None
        except ValueError as error:
            raise self._failed(f"does not answer like a force sensor: {error}") from None

    def _prepare(self, opened: _Opened, mailbox: UdpReceiver, rate: float) -> float | None:
        """Set what is to be set; return the rate as the box tells it, None where it does not."""
        dialect, number = opened.dialect, self._options.filter
        told: float | None = None
        if dialect.pages:
            told = self._set_pages(opened.pages, rate, number)
        else:
            period = dialects.period_request(rate)
            if period is None:
                raise self._failed(f"cannot stream at {rate:g} Hz; a period is whole ms, to 255")
            self._send(opened, mailbox, period)
            if number is not None:
                self._send(opened, mailbox, request(Command.FILTER, number))
        if self._options.bias:
            # It ends a stream and is not answered; the start that follows begins a new one.
            self._send(opened, mailbox, dialect.bias)
        return told

    def _set_pages(self, pages: Box | None, rate: float, low_pass: int | None) -> float | None:
        if pages is None:
            if low_pass is not None:
                raise self._failed("filter: cannot be set, its web page does not answer")
            return None
        try:
            box = pages.info(_PAGES)
            # A setting that stands as it should is not written once more.
            if not (self._options.keep_rate or _near(box.rate, rate)):
                pages.set("comm.cgi", "comrdtrate", round(rate), _PAGES)
                box = pages.info(_PAGES)
            if low_pass is not None and low_pass != box.low_pass:
                pages.set("setting.cgi", "setuserfilter", low_pass, _PAGES)
                box = pages.info(_PAGES)
        except (NoAnswerError, ValueError) as error:
            raise self._failed(f"could not be set up: {error}") from None
        self.box = box
        if low_pass not in (None, box.low_pass):
            raise self._failed(f"filter = {low_pass}: was not taken, it has {box.low_pass}")
        if box.rate is None:
            return None
        if not _near(box.rate, rate):
            raise self._failed(
                f"streams at {box.rate:g} Hz where {rate:g} Hz is asked for; ask for a rate that "
                "it has, or set it on its web page"
            )
        if self._options.buffered and box.records / box.rate > SILENCE / 2.0:
            raise self._failed(
                f"buffered: {box.records} records take {box.records / box.rate:g} s at "
                f"{box.rate:g} Hz; lower its RDT buffer size, or do without"
            )
        return box.rate

    def _ask_for_stream(self, opened: _Opened, mailbox: UdpReceiver, rate: float) -> None:
        """Ask until something comes from the box; a request may be lost."""
        command = Command.START_BUFFERED if self._options.buffered else Command.START
        pause = max(PAUSE, 2.0 / rate)
        foreign: set[str] = set()
        for _ in range(ATTEMPTS):
            mailbox.take()
            self._send(opened, mailbox, request(command))
            give_up = self._clock.now() + pause
            while self._clock.now() < give_up:
                self._clock.sleep_until(self._clock.now() + _LOOK_AGAIN)
                sources = {letter.source for letter in mailbox.peek()}
                if opened.address in sources:
                    return
                foreign |= {f"{host}:{port}" for host, port in sources}
        because = f"; datagrams came from {', '.join(sorted(foreign))} instead" if foreign else ""
        raise self._failed(
            f"sends nothing after {ATTEMPTS} requests to UDP port {self._port}{because}; check for "
            "another client, or a firewall between"
        )

    def _measure(self, opened: _Opened, mailbox: UdpReceiver, rate: float) -> None:
        """Make sure of a rate that the box does not tell."""
        self._clock.sleep_until(self._clock.now() + max(_MEASURING, 10.0 / rate))
        letters = [x for x in mailbox.peek() if x.source == opened.address]
        records = [protocol.records(x.content) for x in letters]
        numbers = [int(r["rdt_sequence"][-1]) for r in records if r is not None]
        measured = 0.0
        if len(numbers) == len(letters) > 1 and letters[-1].t > letters[0].t:
            measured = ahead(numbers[-1], numbers[0]) / (letters[-1].t - letters[0].t)
        if not abs(measured - rate) <= MEASURED * rate:
            raise self._failed(
                f"streams at about {measured:.0f} Hz where {rate:g} Hz is asked for; ask for the "
                "rate that it has, or set it there"
            )

    def _send(self, opened: _Opened, mailbox: UdpReceiver, datagram: bytes) -> None:
        try:
            mailbox.send(datagram, opened.address)
        except OSError as error:
            raise self._failed(f"cannot be reached: {error.strerror or error}") from None

    def _end(self) -> None:
        """Ask for the end of the stream until it has ended.

        A silent stream is left alone: it may be another client's by now, and a request to stop
        would end that one.
        """
        mailbox, stream, opened = self._mailbox, self.stream, self._opened
        self._mailbox = self.stream = None
        if mailbox is None or opened is None:
            return
        heard = self._clock.now() if stream is None else stream.heard
        since = self._clock.now() - SILENCE
        with contextlib.suppress(OSError):
            for _ in range(_STOPS):
                heard = max([heard, *(x.t for x in mailbox.take() if x.source == opened.address)])
                if heard < since:
                    break
                mailbox.send(request(Command.STOP), opened.address)
                since = self._clock.now() + _ON_THE_WAY
                self._clock.sleep_until(since + _STOP_PAUSE)
        mailbox.close()

    def _failed(self, what: str) -> InstrumentError:
        return InstrumentError(f"sensor netft://{self._host}: {what}")


def _differ(box: BoxInfo, opened: _Opened) -> bool:
    return bool((box.scale.per_count != opened.per_count).any())


def _near(has: float | None, rate: float) -> bool:
    """Tell whether a box has the rate that was asked for, or one rounded up from it."""
    return has is not None and rate * 0.999 <= has <= rate * (1.0 + ROUNDED)
