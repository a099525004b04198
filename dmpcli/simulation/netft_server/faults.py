"""What the simulated sensor box does wrong on purpose."""

from dataclasses import dataclass

import numpy as np


@dataclass
class BoxFaults:
    """Faults of a simulated box; every one may be changed while it runs.

    Attributes
    ----------
    loss, duplication, reordering, malformed, foreign : float
        Probability, per datagram, that it is not sent, is sent twice, is sent after the next one,
        is preceded by one of a wrong length, or by one from another address.
    silent_at : float
        s after the box started; from then on it sends nothing.
    silent_after : float
        Records of one stream after which nothing more of it is sent.
    saturated : bool
        Every reading stands at the end of the range, flagged as saturated.
    stalled : bool
        The sensor's own counter and reading stand still while records go on.
    status : int or None
        Status word instead of the true one.
    lost_starts : int
        So many requests to start are lost yet.
    seed : int
        Of the probabilities; taken when the box starts.
    """

    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    malformed: float = 0.0
    foreign: float = 0.0
    silent_at: float = np.inf
    silent_after: float = np.inf
    saturated: bool = False
    stalled: bool = False
    status: int | None = None
    lost_starts: int = 0
    seed: int = 0
