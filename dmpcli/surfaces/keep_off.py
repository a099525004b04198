"""Where on a surface no stroke may be: near its border, or within a closed line on it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.surface import LEAVES, Status, first_refusal

if TYPE_CHECKING:
    from dmpcli.surfaces.border_margin import BorderMargin


class Region(Protocol):
    """Part of a surface."""

    def holds(self, points: Floats) -> Booleans:
        """Tell which points (B, T, 3) near the surface, samples of B paths, are in it, (B, T).

        A sample counts too if the path from the one before it crosses the region.
        """
        ...


@dataclass(frozen=True)
class KeepOff:
    """Where no stroke may be.

    Attributes
    ----------
    margin : BorderMargin or None
    regions : tuple of Region
    """

    margin: "BorderMargin | None" = None
    regions: tuple[Region, ...] = ()

    def marked(
        self, position: Floats, outside: Booleans, status: Integers
    ) -> tuple[Booleans, Integers]:
        """Mark the samples of strokes that are where they may not be.

        Parameters
        ----------
        position : array, shape (B, T, 3)
            mm.
        outside : array of bool, shape (B, 1 or T)
        status : array of int, shape (B,)
            `Status`; only strokes that are drawn, or leave the surface, are looked at.

        Returns
        -------
        outside : array of bool, shape (B, T)
        status : array of int, shape (B,)
            Of strokes that were drawn: what is in their way first.
        """
        outside = np.broadcast_to(outside, position.shape[:2]).copy()
        rows = np.flatnonzero((status == Status.DRAWN) | np.isin(status, LEAVES))
        some = position[rows]
        near = np.zeros(some.shape[:2], dtype=bool)
        if self.margin is not None:
            near = self.margin.holds(some, ~outside[rows])
        kept = np.zeros_like(near)
        for region in self.regions:
            kept |= region.holds(some)
        status = status.copy()
        status[rows] = first_refusal(
            status[rows],
            np.where(kept.any(axis=1), np.int64(Status.KEPT_OUT), np.int64(Status.DRAWN)),
            np.where(near.any(axis=1), np.int64(Status.NEAR_BORDER), np.int64(Status.DRAWN)),
        )
        outside[rows] |= near | kept
        return outside, status
