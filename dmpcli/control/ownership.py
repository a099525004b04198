"""One owner per arm: who moves it holds a lock that the kernel keeps, and takes no arm that moves.

The lock goes by the address that a URL's host resolves to, and the port, so that two names of one
arm are one. It ends with its process, however that ends. It reaches as far as this computer: what
moves an arm from elsewhere is seen by the arm's moving.
"""

import ipaddress
import os
import socket
import struct
import sys
from types import TracebackType

from dmpcli.control import guards
from dmpcli.control.settling import RestWindow
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments import registry, sockets
from dmpcli.instruments.address import Address
from dmpcli.instruments.protocols import Clock, Servo

WINDOW, BUSY_WINDOW = 0.2, 1.0
"""s: so long an arm must stand still before it is taken; the latter where its controller says that
a motion is under way, which may only have paused."""

_PATIENCE = 1.0
_STEP = 0.01
_NAME = "dmpcli/arm"


class ArmLock:
    """The right to move one arm.

    A simulated arm in lock-step with our own clock has nobody else: there is nothing to take.

    Parameters
    ----------
    address : Address
        The robot's.
    moves : bool
        Whether it is to be moved: who only looks on, or has a hand lead it, takes nothing.

    Attributes
    ----------
    shared : bool
        Whether there is something to take.
    """

    def __init__(self, address: Address, moves: bool = True) -> None:
        self._address = address
        self._held: list[socket.socket | int] = []
        self.shared = moves and not (address.simulated or registry.lock_step(address))

    def __enter__(self) -> "ArmLock":
        self.take()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()

    def take(self) -> None:
        """Take it.

        Raises
        ------
        InstrumentError
            Nobody knows the robot's host.
        RefusedError
            Another process on this computer has it.
        """
        if not self.shared:
            return
        try:
            for name in self._names():
                self._held.append(_hold(name, str(self._address)))
        except BaseException:
            self.release()
            raise

    def release(self) -> None:
        """Give it back; may be called twice."""
        while self._held:
            held = self._held.pop()
            if isinstance(held, int):
                os.close(held)
            else:
                held.close()

    def require_rest(self, servo: Servo, clock: Clock) -> None:
        """Refuse an arm that moves before we have moved it.

        Parameters
        ----------
        servo : Servo
            Open.
        clock : Clock

        Raises
        ------
        InstrumentError
            Its pose is not a number.
        RefusedError
            It moves.
        """
        if self.shared:
            require_rest(servo, clock)

    def _names(self) -> list[str]:
        port = self._address.port or registry.default_port(self._address) or 0
        # The driver looks the port up by itself; here any one serves to look up the host.
        found = sockets.resolved(self._address.host, port or 1, _PATIENCE, str(self._address))
        hosts = {_canonical(str(place[0])) for *_, place in found}
        return sorted(f"{_NAME}/{host}:{port}" for host in hosts)


def require_rest(servo: Servo, clock: Clock) -> None:
    """Refuse an arm that moves before we have moved it; see `ArmLock.require_rest`."""
    begun = clock.now()
    short, long = RestWindow(WINDOW), RestWindow(BUSY_WINDOW)
    while True:
        state = servo.state()
        guards.check_pose(state)
        rested, paused = short.rests(state), long.rests(state)
        if paused or (rested and not state.busy):
            return
        if clock.now() - begun > BUSY_WINDOW + _PATIENCE:
            raise RefusedError(
                f"robot: it moves ({short.moved}), and not by us; stop what moves it, or wait for "
                "its end"
            )
        clock.sleep_until(clock.now() + _STEP)


def _canonical(host: str) -> str:
    """One name for one address: without a zone, IPv4 where that is what is meant."""
    address = ipaddress.ip_address(host.partition("%")[0])
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    if address.is_unspecified or address == ipaddress.IPv6Address("::1"):
        return "127.0.0.1"
    return str(address)


def _hold(name: str, what: str) -> socket.socket | int:
    """Take a name that only one process of this computer can have."""
    if sys.platform == "linux":
        made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            made.bind(f"\0{name}")  # of no file system: nothing is left where the process ends
            made.listen(1)
        except OSError:
            made.close()
            raise _taken(what, _holder(name)) from None
        return made
    else:  # noqa: RET505 - else it would be unreachable to a type checker on Linux
        import fcntl

        path = "/tmp/" + name.replace("/", "-")
        try:
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise InstrumentError(f"{what}: {path} cannot be locked: {error.strerror}") from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(file)
            raise _taken(what, "") from None
        return file


def _holder(name: str) -> str:
    """Who has it, as the kernel says; empty where it does not."""
    number = 0
    if sys.platform == "linux":
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
            asking.settimeout(0.2)
            try:
                asking.connect(f"\0{name}")
                size = struct.calcsize("3i")
                told = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size)
            except OSError:
                return ""
        number = struct.unpack("3i", told)[0]
    return f" (process {number})" if number else ""


def _taken(what: str, holder: str) -> RefusedError:
    return RefusedError(
        f"{what}: another dmpcli on this computer{holder} moves this arm; wait for its end"
    )
