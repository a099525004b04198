import pytest

from dmpcli.instruments.netft.status import SATURATED, WARNING, describe, serious


def test_only_zero_and_the_latched_monitor_leave_a_reading_believable():
    assert not serious(0)
    assert not serious(0x80010000)
    assert all(serious(1 << bit) for bit in range(32))
    assert all(serious(WARNING | 1 << bit) for bit in range(31) if bit != 16)


@pytest.mark.parametrize(
    ("status", "family", "words"),
    [
        (0x80020000, "net f/t", "saturation or A/D error"),
        (0x80004000, "net f/t", "watchdog timeout"),
        (0xC0000000, "net f/t", "CPU or RAM error"),
        (0xC0000000, "axia", "force or torque out of range"),
        (0x88000000, "axia", "gage out of range"),
        (0x80000004, "axia", "broken gage"),
        (0x80000004, "net f/t", "temperature out of range"),
        (0x80000001, "axia", "temperature out of range"),
        (0x80020010, "net f/t", "saturation or A/D error, excitation or supply error"),
        (0x00000700, "net f/t", "analog board error"),
        (0x80080000, "net f/t", "bit 19"),
        (0x00000003, "onrobot", "bit 1, bit 0"),
        (0x80000000, "net f/t", "an error without a name"),
    ],
)
def test_bits_are_named_by_the_familys_own_list(status, family, words):
    assert describe(status, family) == f"status 0x{status:08x}: {words}"


def test_each_family_calls_saturation_serious():
    assert all(serious(status) for status in SATURATED.values())
