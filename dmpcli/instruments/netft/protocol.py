"""RDT on the wire: requests of 8 bytes to the sensor, records of 36 bytes from it.

Everything is big-endian. Source: ATI Net F/T manual 9620-05-Net FT, chapter 10; ATI Axia manual
9620-05-C, chapter 12. OnRobot and OptoForce boxes speak the same bytes.
"""

import struct
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

MAGIC = 0x1234
RDT_PORT, TCP_PORT, HTTP_PORT = 49152, 49151, 80

RECORD = np.dtype(
    [
        ("rdt_sequence", ">u4"),
        ("ft_sequence", ">u4"),
        ("status", ">u4"),
        ("counts", ">i4", (6,)),
    ]
)
"""One record: the number within this request (from 1), the sensor's own sample counter, the status
word, and Fx Fy Fz Tx Ty Tz in counts."""

Records = NDArray[np.void]
"""Array of `RECORD`."""

MOST_RECORDS = 40
"""What a box packs into one datagram at most: 40 records are 1440 bytes, one Ethernet frame."""

_REQUEST = struct.Struct(">HHI")


class Command(IntEnum):
    """What a request asks for."""

    STOP = 0x0000
    START_AXIA = 0x0001
    START = 0x0002
    START_BUFFERED = 0x0003
    RESET_LATCH = 0x0041
    BIAS = 0x0042
    FILTER = 0x0081
    PERIOD = 0x0082


def request(command: int, count: int = 0) -> bytes:
    """Encode a request.

    Parameters
    ----------
    command : int
        One of `Command`.
    count : int
        Records to send, 0 until stopped; the value, for the settings that OnRobot takes.
    """
    return _REQUEST.pack(MAGIC, command, count)


def parse_request(datagram: bytes) -> tuple[int, int] | None:
    """Return command and count of a request, None where it is none."""
    if len(datagram) != _REQUEST.size:
        return None
    magic, command, count = _REQUEST.unpack(datagram)
    return (command, count) if magic == MAGIC else None


def records(datagram: bytes) -> Records | None:
    """Look at a datagram as records, without a copy.

    Parameters
    ----------
    datagram : bytes

    Returns
    -------
    array of `RECORD`, shape (k,)
        None where the length is not k·36 bytes with k from 1 to `MOST_RECORDS`.
    """
    count, rest = divmod(len(datagram), RECORD.itemsize)
    if rest or not 1 <= count <= MOST_RECORDS:
        return None
    return np.frombuffer(datagram, RECORD)


def encode(rdt_sequence: int, ft_sequence: int, status: int, counts: NDArray[np.int64]) -> bytes:
    """Encode one record; the sequences wrap at 2^32.

    Parameters
    ----------
    rdt_sequence, ft_sequence, status : int
    counts : array, shape (6,)
        Within 32 bits.
    """
    record = np.zeros(1, RECORD)
    record["rdt_sequence"] = rdt_sequence % 2**32
    record["ft_sequence"] = ft_sequence % 2**32
    record["status"] = status
    record["counts"] = counts
    return record.tobytes()
