import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.instruments.netft import protocol
from dmpcli.instruments.netft.protocol import Command

RECORD = bytes.fromhex(
    "00000007"  # rdt_sequence
    "fffffffe"  # ft_sequence
    "80010000"  # status
    "000f4240"  # 1 000 000
    "fff0bdc0"  # -1 000 000
    "00000000"
    "7fffffff"
    "80000000"
    "ffffffff"  # -1
)


def test_requests_are_the_bytes_of_the_manual():
    assert protocol.request(Command.STOP) == bytes.fromhex("1234 0000 00000000")
    assert protocol.request(Command.START) == bytes.fromhex("1234 0002 00000000")
    assert protocol.request(Command.START_BUFFERED) == bytes.fromhex("1234 0003 00000000")
    assert protocol.request(Command.START, 1000) == bytes.fromhex("1234 0002 000003e8")
    assert protocol.request(Command.RESET_LATCH) == bytes.fromhex("1234 0041 00000000")
    assert protocol.request(Command.BIAS, 255) == bytes.fromhex("1234 0042 000000ff")
    assert protocol.request(Command.FILTER, 4) == bytes.fromhex("1234 0081 00000004")
    assert protocol.request(Command.PERIOD, 10) == bytes.fromhex("1234 0082 0000000a")


def test_a_record_is_read_as_the_manual_lays_it_out():
    (record,) = protocol.records(RECORD)
    assert record["rdt_sequence"] == 7
    assert record["ft_sequence"] == 2**32 - 2
    assert record["status"] == 0x80010000
    assert record["counts"].tolist() == [1_000_000, -1_000_000, 0, 2**31 - 1, -(2**31), -1]


def test_a_buffered_datagram_holds_its_records_in_order():
    second = RECORD.replace(bytes.fromhex("00000007fffffffe"), bytes.fromhex("0000000800000044"))
    both = protocol.records(RECORD + second)
    assert both["rdt_sequence"].tolist() == [7, 8]
    assert both["ft_sequence"].tolist() == [2**32 - 2, 68]


@pytest.mark.parametrize("size", [0, 1, 35, 37, 71, 36 * 41])
def test_a_datagram_of_a_wrong_length_is_no_record(size):
    assert protocol.records(bytes(size)) is None


@given(st.binary(max_size=300))
def test_any_datagram_is_records_or_nothing(datagram):
    records = protocol.records(datagram)
    if records is None:
        assert len(datagram) == 0 or len(datagram) % 36
        return
    for number, record in enumerate(records):
        expected = struct.unpack_from(">IIIiiiiii", datagram, 36 * number)
        got = [record["rdt_sequence"], record["ft_sequence"], record["status"], *record["counts"]]
        assert tuple(int(value) for value in got) == expected


@given(
    st.integers(0, 2**33),
    st.integers(0, 2**33),
    st.integers(0, 2**32 - 1),
    st.lists(st.integers(-(2**31), 2**31 - 1), min_size=6, max_size=6),
)
def test_an_encoded_record_is_what_struct_packs(rdt, ft, status, counts):
    expected = struct.pack(">III6i", rdt % 2**32, ft % 2**32, status, *counts)
    assert protocol.encode(rdt, ft, status, np.array(counts)) == expected


@given(st.binary(max_size=12))
def test_a_request_is_eight_bytes_that_begin_with_the_magic_number(datagram):
    asked = protocol.parse_request(datagram)
    assert (asked is not None) == (len(datagram) == 8 and datagram[:2] == b"\x12\x34")
    if asked is not None:
        assert protocol.request(*asked) == datagram
