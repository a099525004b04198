"""What becomes of sound inputs: bytes cut, doubled and changed, documents and tables made odd."""

import contextlib
import functools
import io
import json
import re
from copy import deepcopy
from random import Random
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

_NUMBERS = (
    "0", "-1", "1", "-0", "1e308", "-1e308", "1e-320", "nan", "inf", "-inf", "4294967295",
    "2147483648", "-2147483649", "9223372036854775808", "99999999999999999999", "0x10", "1e",
    "1,5", "", "null", "9" * 400, "9" * 5000, "0." + "3" * 300, "true", '"x"', "[]", "{}",
)  # fmt: skip
_WORDS = (
    b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\n\n", b'"', b"'", b",", b";", b"#", b"\\",
    b"\xc2\x85", b"\xe2\x80\xa8", b"[" * 2000, b"{" * 2000, b"(", b"\x1b[2J",
)  # fmt: skip


def mutated(seeds: tuple[bytes, ...], random: Random) -> bytes:
    """Return one mutation of one of some sound inputs."""
    content = random.choice(seeds)
    crafted = content[:4] == b"PAR1"
    if crafted and random.random() < 0.6:
        return _crafted(content, random)
    if content[:1] == b"{" and random.random() < 0.5:
        return _redone(content, random)
    for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
        content = _changed(content, random)
    return content


def _changed(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    to = min(at + random.choice((1, 1, 2, 4, 8, 64, 512)), len(content))
    how = random.randrange(10)
    if how == 0:
        return content[:at]
    if how == 1:
        return content[:at] + content[to:]
    if how == 2:
        return content[:at] + content[at:to] * random.choice((2, 3, 100)) + content[to:]
    if how == 3:
        return content[:at] + random.choice(_WORDS) + content[at:]
    if how == 4:
        return content[:at] + random.randbytes(to - at) + content[to:]
    if how == 5 and at < len(content):
        return content[:at] + bytes([content[at] ^ 1 << random.randrange(8)]) + content[at + 1 :]
    if how == 6:
        value = random.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, 1000))
        size = random.choice((1, 2, 4, 8))
        packed = (value % 256**size).to_bytes(size, random.choice(("little", "big")))
        return content[:at] + packed + content[at + size :]
    if how == 7:
        other = random.randrange(len(content) + 1)
        return content[:at] + content[other : other + to - at] + content[to:]
    return _numbered(content, random)


_DIGITS = re.compile(rb"[.eE+-]*[0-9][0-9.eE+-]*")


def _numbered(content: bytes, random: Random) -> bytes:
    """Put another number where one stands in a text."""
    begin = random.randrange(min(len(content), 20000) + 1)
    found = _DIGITS.search(content, begin) or _DIGITS.search(content)
    if found is None:
        return content[: len(content) // 2]
    at, to = found.span()
    return content[:at] + random.choice(_NUMBERS).encode() + content[to:]


_VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1.5, 1e308, -1e-320, 2**63, 2**70, "", "x", "\x00\x1b", [], {}, [1], [[1]],
    {"a": 1}, [1e308] * 3, [0.0] * 6, "é" * 300, [None] * 3, float("nan"), float("inf"),
)  # fmt: skip


def _redone(content: bytes, random: Random) -> bytes:
    """Change values of a JSON document, or its keys."""
    document = json.loads(content)
    for _ in range(random.choice((1, 1, 2, 4))):
        _shuffle(document, random)
    return json.dumps(document).encode()


def _shuffle(document: Any, random: Random) -> None:
    while isinstance(document, dict | list) and document:
        keys = list(document) if isinstance(document, dict) else list(range(len(document)))
        key = random.choice(keys)
        if isinstance(document[key], dict | list) and document[key] and random.random() < 0.7:
            document = document[key]
            continue
        how = random.randrange(4)
        if how == 0:
            del document[key]
        elif how == 1 and isinstance(document, dict):
            document[random.choice(("schema", "version", "x", "", key + "_"))] = deepcopy(
                document[key]
            )
        elif how == 2 and isinstance(document, list):
            document += deepcopy(document[:3]) * random.choice((1, 300))
        else:
            document[key] = deepcopy(random.choice(_VALUES))
        return


def _crafted(content: bytes, random: Random) -> bytes:
    """Write a Parquet table anew, with something odd about it."""
    table = _table(content)
    for _ in range(random.choice((1, 1, 2, 3))):
        table = _odd(table, random)
    sink = io.BytesIO()
    compression = random.choice(("zstd", "none", "snappy", "gzip"))
    try:
        pq.write_table(
            table, sink, compression=compression, row_group_size=random.choice((7, 10**6, 10**6))
        )
    except (pa.ArrowException, ValueError, TypeError):
        return content[: random.randrange(len(content))]
    return sink.getvalue()


@functools.lru_cache
def _table(content: bytes) -> Any:
    return pq.read_table(io.BytesIO(content), use_threads=False)


def _odd(table: Any, random: Random) -> Any:
    how = random.randrange(8)
    if table.num_columns == 0 or table.num_rows == 0:
        return table
    i = random.randrange(table.num_columns)
    name, n = table.column_names[i], table.num_rows
    if how == 0:
        return table.remove_column(i)
    if how == 1:
        return table.append_column(name, table.column(i))
    if how == 2:
        return table.set_column(i, name, random.choice(_columns_of_others(n)))
    if how == 3:
        return table.slice(random.randrange(n), random.choice((0, 1, 2, n)))
    if how == 4:
        metadata = dict(table.schema.metadata or {})
        key = b"dmpcli"
        if key in metadata:
            with contextlib.suppress(ValueError):
                metadata[key] = _redone(metadata[key], random)
            if random.random() < 0.3:
                metadata[key] = _changed(metadata[key], random)
        return table.replace_schema_metadata(metadata)
    if how == 5:
        order = list(range(n))
        random.shuffle(order)
        return table.take(pa.array(order))
    if how == 6:
        values = table.column(i).to_pylist()
        values[random.randrange(n)] = None
        with contextlib.suppress(pa.ArrowException):
            return table.set_column(i, name, pa.array(values, type=table.column(i).type))
        return table
    values = [random.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 0.0, 5e-324))] * n
    return table.set_column(i, name, pa.array(values))


def _columns_of_others(n: int) -> list[Any]:
    """Columns of kinds that no file of ours has."""
    return [
        pa.array(["x"] * n),
        pa.array([""] * n),
        pa.array(["1.5"] * n),
        pa.array([b"\xff\xfe"] * n),
        pa.array(["é" * 50] * n).dictionary_encode(),
        pa.array([[1.0, 2.0]] * n),
        pa.array([{"a": 1}] * n),
        pa.array([True] * n),
        pa.array([None] * n, type=pa.null()),
        pa.array([2**62] * n),
        pa.array([0] * n, type=pa.timestamp("ns")),
        pa.array([10**15] * n, type=pa.timestamp("us", "UTC")),
        pa.array([1] * n, type=pa.date32()),
        pa.array([1] * n, type=pa.time64("us")),
        pa.array([1] * n, type=pa.duration("s")),
        pa.array([1] * n).cast(pa.decimal128(30, 3)),
        pa.array([1.0] * n, type=pa.float32()),
        pa.array([np.float16(1.0)] * n, type=pa.float16()),
        pa.array([255] * n, type=pa.uint8()),
        pa.array([2**64 - 1] * n, type=pa.uint64()),
        pa.array(["id"] * n, type=pa.large_string()),
        pa.array([b"1234"] * n, type=pa.binary(4)),
    ]
