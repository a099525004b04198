import re
import struct

import numpy as np
import pytest

from dmpcli.instruments.netft.stream import MALFORMED, SILENCE, Stream
from dmpcli.instruments.netft.udp_receiver import Datagram

BOX = ("192.168.1.1", 49152)
RATE = 100.0
LIMIT = np.array([145.0, 145.0, 290.0, 5.0, 5.0, 5.0])
PER_COUNT = np.array([1e-6] * 3 + [2e-6] * 3)


def record(number, ft=None, status=0, counts=(1, 2, 3, 4, 5, 6)):
    ft = 70 * number if ft is None else ft
    return struct.pack(">III6i", number % 2**32, ft % 2**32, status, *counts)


def letter(content, t=0.0, source=BOX):
    return Datagram(t, source, content)


def stream(rate=RATE, heard=0.0, family="net f/t"):
    return Stream(BOX, PER_COUNT, LIMIT, family, rate, heard)


def test_counts_become_newtons_and_newton_metres():
    (sample,) = stream().take([letter(record(1, counts=(1_000_000, -2, 0, 500_000, -1, 0)), t=3.5)])
    np.testing.assert_allclose(sample.wrench, [1.0, -2e-6, 0.0, 1.0, -2e-6, 0.0], rtol=1e-12)
    assert (sample.t, sample.seq, sample.healthy, sample.lost) == (3.5, 1, True, 0)


def test_loss_is_counted_in_the_samples_that_follow():
    samples = stream().take([letter(record(n)) for n in (1, 2, 5, 6)])
    assert [sample.seq for sample in samples] == [1, 2, 5, 6]
    assert [sample.lost for sample in samples] == [0, 0, 2, 2]


def test_duplicates_and_late_ones_are_dropped():
    samples = stream().take([letter(record(n)) for n in (1, 2, 2, 4, 3, 5)])
    assert [sample.seq for sample in samples] == [1, 2, 4, 5]


def test_the_records_of_one_datagram_are_a_period_apart():
    s = stream()
    samples = s.take([letter(b"".join(record(n) for n in range(1, 6)), t=1.0)])
    np.testing.assert_allclose([x.t for x in samples], [0.96, 0.97, 0.98, 0.99, 1.0])
    assert s.heard == 1.0


def test_no_two_samples_have_one_time_even_in_a_burst():
    samples = stream().take([letter(record(n), t=1.0) for n in range(1, 6)])
    assert (np.diff([sample.t for sample in samples]) > 0).all()


@pytest.mark.parametrize(
    ("family", "status", "words"),
    [("net f/t", 0x80020000, "saturation"), ("axia", 0xC0000000, "out of range")],
)
def test_a_flagged_reading_is_unhealthy_and_the_last(family, status, words):
    s = stream(family=family)
    samples = s.take([letter(record(1)), letter(record(2, status=status)), letter(record(3))])
    assert [sample.healthy for sample in samples] == [True, False]
    assert words in samples[-1].reason
    assert words in s.fault
    assert s.take([letter(record(4))]) == []


def test_a_warning_is_believed_and_counted():
    s = stream()
    (sample,) = s.take([letter(record(1, status=0x80010000))])
    assert sample.healthy
    assert s.tally.warnings == 1
    assert s.fault is None


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_reading_at_the_end_of_the_range_is_unhealthy(axis, sign):
    counts = [0] * 6
    counts[axis] = sign * round(LIMIT[axis] / PER_COUNT[axis])
    (sample,) = stream().take([letter(record(1, counts=counts))])
    assert not sample.healthy
    assert sample.reason.startswith(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")[axis])
    counts[axis] -= sign
    (sample,) = stream().take([letter(record(1, counts=counts))])
    assert sample.healthy


def test_ten_malformed_datagrams_in_a_row_are_a_fault_and_nine_are_not():
    s = stream()
    bad = [letter(record(1)[:-1])] * (MALFORMED - 1)
    assert len(s.take([*bad, letter(record(1)), *bad, letter(record(2))])) == 2
    assert s.fault is None
    assert s.tally.malformed == 2 * (MALFORMED - 1)
    s.take([*bad, *bad])
    assert s.fault == "10 malformed datagrams in a row, the last one has 35 bytes"


def test_datagrams_from_elsewhere_are_dropped_counted_and_named():
    s = stream()
    other, port = ("10.0.0.9", 49152), (BOX[0], 5000)
    letters = [letter(record(n), source=source) for n, source in enumerate([other, port, other])]
    assert s.take(letters) == []
    assert s.tally.foreign == {"10.0.0.9:49152": 2, "192.168.1.1:5000": 1}
    s.listen(1.0)
    assert "from 10.0.0.9:49152, which is not the sensor" in s.fault


def test_silence_is_a_fault_that_names_the_other_client():
    s = stream()
    s.take([letter(record(1), t=1.0)])
    s.listen(1.0 + SILENCE - 1e-3)
    assert s.fault is None
    s.listen(1.0 + SILENCE + 1e-3)
    assert s.fault == (
        "silent for 0.10 s; another client may have taken the stream, or check cable and power"
    )


def test_a_stalled_counter_ends_as_silence_that_names_it():
    s = stream()
    s.take([letter(record(n, ft=700), t=0.01 * n) for n in range(1, 20)])
    s.listen(0.2)
    assert s.fault == (
        "silent for 0.19 s; 18 records were dropped, ft_sequence stands still: the box repeats one "
        "reading"
    )


def test_a_counter_that_goes_back_is_a_fault_at_once():
    s = stream()
    samples = s.take([letter(record(1)), letter(record(2, ft=0)), letter(record(3))])
    assert [sample.seq for sample in samples] == [1]
    assert s.fault == "record 2: ft_sequence went backward: the box restarted"


def test_numbers_from_nowhere_are_malformed():
    s = stream()
    letters = [letter(record(1)), *[letter(record(10_000_000 * k)) for k in range(1, 11)]]
    assert len(s.take(letters)) == 1
    assert "10 malformed datagrams in a row, its number jumps" in s.fault


# Streams of valid records, of which some are changed, repeated or strange: 100 000 datagrams.
STREAMS, LENGTH = 2_000, 50
KINDS = {
    "as sent": 0.80,
    "flipped bytes": 0.06,
    "cut": 0.03,
    "random bytes": 0.02,
    "random length": 0.02,
    "two in one": 0.03,
    "from elsewhere": 0.02,
    "serious status": 0.003,
    "late": 0.017,
}
FAULTS = re.compile(
    r"sample \d+: (status 0x[0-9a-f]{8}: .+|[FT][xyz] = .+ is not within the measuring range, .+)"
    r"|record \d+: ft_sequence went backward: the box restarted"
    r"|10 malformed datagrams in a row, .+"
    r"|silent for \d+\.\d\d s; .+"
)


def jumbled(rng):
    """All the streams' letters, and what was done to each."""
    kinds = rng.choice(list(KINDS), size=(STREAMS, LENGTH), p=list(KINDS.values()))
    counts = rng.integers(-4_000_000, 4_000_000, size=(STREAMS, LENGTH, 6))
    counts[..., 3:] //= 4
    firsts = rng.choice([1, 1, 1, 2**32 - 20], size=STREAMS)
    noise = rng.integers(0, 256, size=(STREAMS, LENGTH, 120), dtype=np.uint8)
    numbers = rng.integers(0, 2**31, size=(STREAMS, LENGTH))
    for stream_kinds, values, first, dirt, dice in zip(
        kinds, counts.tolist(), firsts.tolist(), noise, numbers.tolist(), strict=True
    ):
        letters = []
        for k, kind in enumerate(stream_kinds):
            content, source = record(first + k, counts=values[k]), BOX
            if kind == "flipped bytes":
                changed = bytearray(content)
                for place in dirt[k, : 1 + dice[k] % 4]:
                    changed[place % 36] ^= dirt[k, place % 120] or 1
                content = bytes(changed)
            elif kind == "cut":
                content = content[: dice[k] % 36]
            elif kind == "random bytes":
                content = dirt[k, :36].tobytes()
            elif kind == "random length":
                content = dirt[k, : dice[k] % 120].tobytes()
            elif kind == "two in one":
                content += record(first + k + 1, counts=values[k - 1])
            elif kind == "from elsewhere":
                source = (BOX[0], BOX[1] + 1)
            elif kind == "serious status":
                content = record(first + k, status=1 << dice[k] % 32, counts=values[k])
            elif kind == "late":
                content = record(first + max(k - 3, 0), counts=values[k])
            letters.append(Datagram(0.01 * k, source, content))
        yield letters


def believable(letters):
    """Every record that may be handed out, read by struct: its number to all that it may say."""
    found = {}
    for one in letters:
        if one.source == BOX and one.content and len(one.content) % 36 == 0:
            for place in range(0, len(one.content), 36):
                number, ft, status, *counts = struct.unpack_from(">III6i", one.content, place)
                found.setdefault(number, []).append((ft, status, counts * PER_COUNT))
    return found


@pytest.mark.thorough
def test_of_a_hundred_thousand_fuzzed_datagrams_no_wrong_one_is_believed_and_every_fault_is_named():
    rng = np.random.default_rng(20240607)
    datagrams = healthy = faults = 0
    for letters in jumbled(rng):
        datagrams += len(letters)
        s = stream()
        samples = s.take(letters)
        s.listen(10.0)
        truth = believable(letters)
        previous = None
        for sample in samples:
            matches = [
                (ft, status)
                for ft, status, wrench in truth[sample.seq]
                if (wrench == sample.wrench).all()
            ]
            assert matches
            inside = (np.abs(sample.wrench) < LIMIT).all()
            if sample.healthy:
                assert inside
                assert any(status in (0, 0x80010000) for _, status in matches)
            else:
                assert sample is samples[-1]
                assert not inside or any(status not in (0, 0x80010000) for _, status in matches)
            if previous is not None:
                assert 0 < (sample.seq - previous) % 2**32 <= 101
            previous = sample.seq
            healthy += sample.healthy
        assert FAULTS.fullmatch(s.fault)
        faults += not s.fault.startswith("silent")
        assert s.take(letters) == []
    assert datagrams == 100_000
    assert healthy > 30_000  # the fuzz leaves something to believe
    assert faults > 1_000


def test_readings_that_never_change_are_a_frozen_sensor():
    s = stream()
    s.frozen = 25
    noisy = [letter(record(n, counts=(1, 2, 3, 4, 5, n % 2))) for n in range(1, 100)]
    assert len(s.take(noisy)) == 99
    samples = s.take([letter(record(n)) for n in range(100, 200)])
    assert len(samples) == 25
    assert "25 readings in a row are alike in all six counts" in s.fault
    assert s.take([letter(record(200, counts=(9,) * 6))]) == []


def test_where_nobody_asks_no_reading_is_too_much_like_the_last():
    s = stream()
    assert len(s.take([letter(record(n)) for n in range(1, 300)])) == 299
    assert s.fault is None


def test_one_changed_count_begins_the_counting_anew():
    s = stream()
    s.frozen = 10
    for n in range(1, 100):
        s.take([letter(record(n, counts=(0, 0, 0, 0, 0, n // 9)))])
    assert s.fault is None
