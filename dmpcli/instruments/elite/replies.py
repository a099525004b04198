"""Replies of the EC controller's JSON-RPC: cut out of a byte stream, and read with suspicion.

A reply is one JSON object, with or without a newline after it; its result is a string that is JSON
once more. Whatever is not exactly that raises `BadReplyError`, with the fault's name in it.
"""

import json
import math
from typing import Any, NoReturn

LONGEST = 65536
"""Bytes of one reply; those that we ask for stay below 1024."""

_SPACE = b" \t\r\n"


class BadReplyError(Exception):
    """A reply that cannot be believed; the text names the fault."""


class Refusal(Exception):  # noqa: N818
    """The controller's answer that it will not.

    Attributes
    ----------
    code : int
    message : str
    """

    def __init__(self, code: int, message: str) -> None:
        super().__init__(f"{message} (code {code})")
        self.code, self.message = code, message


class ReplyBuffer:
    """Cuts whole JSON objects out of a stream of bytes, however it is chopped."""

    def __init__(self) -> None:
        self._pending = bytearray()
        self._scanned = 0
        self._depth = 0
        self._quoted = self._escaped = False

    @property
    def empty(self) -> bool:
        """Whether nothing but white space is left over."""
        return not self._pending.strip(_SPACE)

    def feed(self, received: bytes) -> None:
        """Take in bytes."""
        self._pending += received

    def take(self) -> bytes | None:
        """Return the next whole object; None while it is not complete.

        Raises
        ------
        BadReplyError
            Something else than an object begins, or it is too long.
        """
        if self._depth == 0:
            self._pending = self._pending.lstrip(_SPACE)
            if self._pending and self._pending[0] != ord("{"):
                raise BadReplyError(f"is no JSON object: {bytes(self._pending[:20])!r}")
        if self._scanned == 0 and _plainly_whole(self._pending):
            return self._cut(self._pending.rfind(b"}") + 1)
        for at in range(self._scanned, len(self._pending)):
            self._step(self._pending[at])
            if self._depth == 0:
                return self._cut(at + 1)
        self._scanned = len(self._pending)
        if self._scanned > LONGEST:
            raise BadReplyError(f"is longer than {LONGEST} bytes")
        return None

    def _cut(self, size: int) -> bytes:
        whole = bytes(self._pending[:size])
        del self._pending[:size]
        self._scanned = 0
        return whole

    def _step(self, byte: int) -> None:
        if self._escaped:
            self._escaped = False
        elif self._quoted:
            self._escaped = byte == ord("\\")
            self._quoted = byte != ord('"')
        elif byte == ord('"'):
            self._quoted = True
        elif byte in b"{[":
            self._depth += 1
        elif byte in b"}]":
            self._depth -= 1


def _plainly_whole(text: bytearray) -> bool:
    """Tell whether bytes that begin with a brace are one object, without looking at each of them.

    The usual reply is: braces only around it, and the last one in no text.
    """
    plain = text.count(b"{") == 1 and text.count(b"}") == 1 and b"\\" not in text
    return plain and text.rstrip(_SPACE).endswith(b"}") and text.count(b'"') % 2 == 0


def result_of(reply: bytes, number: int) -> Any:
    """Return the decoded result of a reply.

    Parameters
    ----------
    reply : bytes
        One JSON object.
    number : int
        Of the request that it must answer.

    Raises
    ------
    BadReplyError
        It is not JSON, answers another request, or holds no result.
    Refusal
        It holds an error.
    """
    told = _decoded(reply, "the reply")
    if not isinstance(told, dict):
        raise BadReplyError("is no JSON object")
    if told.get("jsonrpc", "2.0") != "2.0":
        raise BadReplyError(f"speaks another protocol: jsonrpc {_short(told['jsonrpc'])}")
    if ("error" in told) == ("result" in told):
        raise BadReplyError("holds neither a result nor an error, or both")
    answered = told.get("id")
    # A controller that could not read the request does not know its number.
    unread = "error" in told and answered is None
    # True is 1 to Python, and so is 1.0.
    if not unread and (type(answered) is not int or answered != number):
        raise BadReplyError(f"answers request {_short(answered)}, not {number}")
    if "error" in told:
        raise _refusal(told["error"])
    if not isinstance(told["result"], str):
        raise BadReplyError(f"holds a result that is no text: {_short(told['result'])}")
    return _decoded(told["result"].encode("utf-8", "surrogatepass"), "the result")


def _refusal(error: Any) -> Refusal:
    code, message = (
        (error.get("code"), error.get("message")) if isinstance(error, dict) else 2 * (None,)
    )
    if type(code) is not int or not isinstance(message, str):
        raise BadReplyError(f"holds an error without code and message: {_short(error)}")
    return Refusal(code, " ".join(message.split())[:200])


def _decoded(text: bytes, what: str) -> Any:
    try:
        return _DECODER.decode(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise BadReplyError(f"is not JSON in {what}: {error}") from None


def _no_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    named = dict(pairs)
    if len(named) != len(pairs):
        raise ValueError("a name stands twice")
    return named


_DECODER = json.JSONDecoder(parse_constant=_no_constant, object_pairs_hook=_object)


def boolean(value: Any) -> bool:
    """Read yes or no: true and false, or 1 and 0.

    Raises
    ------
    BadReplyError
    """
    if type(value) not in (bool, int) or value not in (0, 1):
        raise BadReplyError(f"is neither true nor false: {_short(value)}")
    return bool(value)


def whole(value: Any, low: int, high: int) -> int:
    """Read a whole number between two bounds.

    Parameters
    ----------
    value : object
        As JSON gave it; ``true`` and ``1.0`` are no whole numbers.
    low, high : int
        Both allowed.

    Raises
    ------
    BadReplyError
        It is another kind of value, or beyond a bound.
    """
    if type(value) is not int or not low <= value <= high:
        raise BadReplyError(f"is no whole number from {low} to {high}: {_short(value)}")
    return value


def numbers(value: Any, counts: tuple[int, ...], largest: float) -> list[float]:
    """Read a list of finite numbers within ±`largest`; its length must be one of `counts`.

    Parameters
    ----------
    value : object
        As JSON gave it.
    counts : tuple of int
        The first is the one that a message names.
    largest : float
        In the unit of the reply: mm, degrees or rad.

    Raises
    ------
    BadReplyError
        It is no list, of another length, or holds what is no number or beyond ±`largest`.
    """
    if not isinstance(value, list) or len(value) not in counts:
        raise BadReplyError(f"is no list of {counts[0]} numbers: {_short(value)}")
    for each in value:
        # A whole number may be longer than any float.
        if type(each) not in (int, float) or not -largest <= each <= largest or math.isnan(each):
            raise BadReplyError(f"holds what is no number within ±{largest:g}: {_short(each)}")
    return [float(each) for each in value]


def _short(value: Any) -> str:
    if type(value) is int and abs(value) >= 10**40:  # Python refuses to write out longer ones
        return "a number of very many digits"
    try:
        return repr(value)[:60]
    except ValueError:
        return "a value that holds a number of very many digits"
