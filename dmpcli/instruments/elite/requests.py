"""Requests to an EC controller whose replies are checked: form, range, unit."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments.elite import replies
from dmpcli.instruments.elite.jsonrpc import Client
from dmpcli.instruments.elite.replies import BadReplyError, Refusal

NOT_REMOTE = -32693
"""Error code of what needs the remote mode; the only one that is known."""

Params = dict[str, Any]

# Degrees and mm that no joint and no pose of an EC arm exceeds.
_LARGEST_JOINT, _LARGEST_POSE = 720.0, 10_000.0


class Requests:
    """What is asked of a controller, in its units: mm and degrees.

    Parameters
    ----------
    client : Client
    name : str
        For messages.
    """

    def __init__(self, client: Client, name: str) -> None:
        self._client, self._name = client, name

    def yes(self, method: str, params: Params | None = None, patience: float | None = None) -> bool:
        """Return the result of a request for yes or no, which comes within `patience` s.

        Parameters
        ----------
        method : str
        params : dict, optional
            As JSON, in the controller's units.
        patience : float, optional
            Without it the client's own.

        Raises
        ------
        RefusedError
            The controller is not in remote mode.
        InstrumentError
            It cannot be asked, refuses, or its reply cannot be believed; also below.
        """
        with self._believing(method):
            return replies.boolean(self._client.call(method, params, patience))

    def whole(self, method: str, low: int, high: int) -> int:
        """Return the result of a request for a whole number.

        Parameters
        ----------
        method : str
            One without parameters.
        low, high : int
            A reply beyond them cannot be believed.
        """
        with self._believing(method):
            return replies.whole(self._client.call(method), low, high)

    def deed(self, method: str, params: Params | None = None) -> None:
        """Ask for something to be done; InstrumentError also where it was not."""
        if not self.yes(method, params):
            raise InstrumentError(f"{self._name}: did not do {method}; see its pendant")

    def unanswered(self, method: str, params: Params) -> None:
        """Send a request that the controller does not answer."""
        self._client.notify(method, params)

    def joints(self, method: str, params: Params | None = None) -> Floats:
        """Return joint angles, shape (6,), degrees; older controllers send two more."""
        with self._believing(method):
            told = replies.numbers(self._client.call(method, params), (6, 8), _LARGEST_JOINT)
        return np.array(told[:6])

    def pose(self, method: str, params: Params) -> Floats:
        """Return a pose, shape (6,), in mm and what was asked for."""
        with self._believing(method):
            told = replies.numbers(self._client.call(method, params), (6,), _LARGEST_POSE)
        return np.array(told)

    @contextmanager
    def _believing(self, method: str) -> Iterator[None]:
        try:
            yield
        except BadReplyError as error:
            raise InstrumentError(f"{self._name}: {method}: its reply {error}") from None
        except Refusal as refusal:
            if refusal.code == NOT_REMOTE:
                raise RefusedError(
                    f"{self._name}: not in remote mode; turn the key to remote"
                ) from None
            raise InstrumentError(f"{self._name}: {method}: {refusal}") from None
