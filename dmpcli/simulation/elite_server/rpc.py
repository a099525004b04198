"""JSON-RPC as the EC66 speaks it: one object a line in, replies whose result is encoded twice."""

import json
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from dmpcli.simulation.elite_server.parameters import BAD_PARAMS, PARSE, RpcError

LONGEST = 65536
"""Bytes of one request; more without a line's end is no request."""

Call: TypeAlias = Callable[[str, dict[str, Any]], Any]
"""From a method and its parameters to its result; None where nothing is to be answered."""


class RequestLines:
    """Cuts a stream of bytes into lines."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, received: bytes) -> Iterator[bytes]:
        """Yield the lines that are whole now, without their ends.

        Raises
        ------
        RpcError
            A line does not end.
        """
        *lines, self._rest = (self._rest + received).split(b"\n")
        yield from (line for line in lines if line.strip())
        if len(self._rest) > LONGEST:
            self._rest = b""
            raise RpcError(PARSE, "Parse error: no end of line")


def answer(line: bytes, call: Call, newline: bool) -> bytes:
    """Carry one request out and return the reply's bytes; empty where none is due.

    Parameters
    ----------
    line : bytes
    call : callable
    newline : bool
        Whether the reply ends in a newline.
    """
    number: Any = None
    try:
        request = _parsed(line)
        number = request.get("id")
        result = call(request["method"], _params(request))
    except RpcError as error:
        return refusal(error, number, newline)
    if result is None:
        return b""
    # The controller puts its result into a string, as JSON within JSON.
    return _encoded({"jsonrpc": "2.0", "result": json.dumps(result), "id": number}, newline)


def refusal(error: RpcError, number: Any, newline: bool) -> bytes:
    """Return the bytes of an error reply.

    Parameters
    ----------
    error : RpcError
    number : JSON value
        Id of the request; None where it could not be read.
    newline : bool
        Whether the reply ends in a newline.
    """
    told = {"code": error.code, "message": error.message}
    return _encoded({"jsonrpc": "2.0", "error": told, "id": number}, newline)


def _parsed(line: bytes) -> dict[str, Any]:
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        raise RpcError(PARSE, "Parse error") from None
    if not isinstance(request, dict) or not isinstance(request.get("method"), str):
        raise RpcError(PARSE, "Parse error: an object with a method is needed")
    return request


def _params(request: dict[str, Any]) -> dict[str, Any]:
    params = request.get("params")
    # Where there are none they come as {}, as [], or not at all.
    if params in (None, []):
        return {}
    if not isinstance(params, dict):
        raise RpcError(BAD_PARAMS, "Invalid params")
    return params


def _encoded(reply: dict[str, Any], newline: bool) -> bytes:
    text = json.dumps(reply, separators=(",", ":"))
    return text.encode() + (b"\n" if newline else b"")
