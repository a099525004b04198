"""What truly happened on the bench, step by step, as a Parquet file: the judge of what was felt."""

import io
from array import array
from collections.abc import Sequence

import numpy as np

from dmpcli.arrays import Floats

COLUMNS = {
    "t": "s",
    "setpoint": "how many set-points had come",
    "x": "end of the pen, mm, base frame",
    "y": "mm",
    "z": "mm",
    "fx": "force of the workpiece on the pen, N, base axes",
    "fy": "N",
    "fz": "N",
    "push": "its part along the normal, N; 0 without contact",
}
"""What it holds, with units."""


class Truth:
    """A row per step of the physics."""

    def __init__(self) -> None:
        self._rows = array("d")

    def add(
        self, t: float, setpoint: int, tip: Sequence[float], force: Sequence[float], push: float
    ) -> None:
        """Add a row.

        Parameters
        ----------
        t : float
            s.
        setpoint : int
            How many set-points had come.
        tip : sequence of float, length 3
            End of the pen, base frame, mm.
        force : sequence of float, length 3
            Of the workpiece on the pen, base axes, N.
        push : float
            Its part along the normal, N; 0 without contact.
        """
        self._rows.extend((t, setpoint, *tip, *force, push))

    def columns(self) -> dict[str, Floats]:
        """Return the rows so far by column, each of shape (n,)."""
        rows = np.array(self._rows).reshape(-1, len(COLUMNS))
        return dict(zip(COLUMNS, rows.T, strict=True))

    def encoded(self) -> bytes:
        """Return a Parquet file."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        fields = [
            pa.field(name, pa.float64(), metadata={"unit": said}) for name, said in COLUMNS.items()
        ]
        arrays = [pa.array(column) for column in self.columns().values()]
        into = io.BytesIO()
        pq.write_table(pa.table(arrays, schema=pa.schema(fields)), into)
        return into.getvalue()
