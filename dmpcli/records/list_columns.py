"""Columns of Parquet whose cells are lists: one column of numbers for each place in the list.

``observation.state`` of six numbers becomes ``observation.state[0]`` to ``observation.state[5]``.
"""

from typing import Any

import numpy as np
import pyarrow as pa

LONGEST = 256
"""A longer list is an image, not a pose."""


def expanded(name: str, values: Any) -> dict[str, Any]:
    """Return a column as it is, or what its lists hold.

    Parameters
    ----------
    name : str
    values : Arrow array
        Lists of differing lengths, of no numbers or with gaps stay as they are.
    """
    kind = values.type
    lists = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
    if not any(is_kind(kind) for is_kind in lists) or values.null_count or not len(values):
        return {name: values}
    if not (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)):
        return {name: values}
    flat = values.flatten()
    width, rest = divmod(len(flat), len(values))
    if rest or not 0 < width <= LONGEST or flat.null_count:
        return {name: values}
    fixed = pa.types.is_fixed_size_list(kind)
    if not fixed and (np.diff(np.asarray(values.offsets)) != width).any():
        return {name: values}
    table = np.asarray(flat).reshape(-1, width)
    return {f"{name}[{i}]": pa.array(np.ascontiguousarray(table[:, i])) for i in range(width)}
