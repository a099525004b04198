"""Bytes as they come out of bad cables and bad programs: what every importer must survive."""

import re

import numpy as np

_WORDS = (b"nan", b"inf", b"-", b"1e999", b"", b"0", b"9" * 40, b"\x00", b"\xff\xfe", b"((", b"{")


def mutated(content, rng):
    """The content with one to four faults: bits, bytes, cuts, copies, numbers and lines."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(0, max(1, len(data))))
        kind = int(rng.integers(0, 8))
        size = int(rng.integers(1, 40))
        if kind == 0 and data:
            data[at] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1 and data:
            data[at] = int(rng.integers(0, 256))
        elif kind == 2:
            del data[at : at + size]
        elif kind == 3:
            data[at:at] = data[at : at + size]
        elif kind == 4:
            del data[at:]
        elif kind == 5:
            data[at:at] = rng.bytes(size)
        elif kind == 6:
            data[at : at + size] = _WORDS[int(rng.integers(0, len(_WORDS)))]
        else:
            numbers = list(re.finditer(rb"\d+\.?\d*", bytes(data[at : at + 400])))
            if numbers:
                one = numbers[int(rng.integers(0, len(numbers)))]
                word = _WORDS[int(rng.integers(0, len(_WORDS)))]
                data[at + one.start() : at + one.end()] = word
    return bytes(data)


def survived(read, content, count, seed):
    """How many mutations were read, how many refused; other errors than ours pass on."""
    from dmpcli.errors import DmpError

    rng = np.random.default_rng(seed)
    taken = refused = 0
    for _ in range(count):
        try:
            read(mutated(content, rng))
            taken += 1
        except DmpError as error:
            assert error.exit_code == 2
            refused += 1
    return taken, refused
