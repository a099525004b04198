"""What a status word says, bit by bit; Net F/T, Axia and OnRobot give the bits other meanings.

Source: ATI Net F/T manual 9620-05-Net FT, section 17.1; ATI Axia manual 9620-05-C, chapter 12.
"""

from typing import Literal

Family = Literal["net f/t", "axia", "onrobot"]

WARNING = 0x80010000
"""A monitor condition is latched, and nothing else: a warning, the reading stands."""

SATURATED: dict[Family, int] = {
    "net f/t": 0x80020000,
    "axia": 0xC0000000,
    "onrobot": 0x80020000,
}
"""How a box says that a reading is beyond what it can measure."""

_NET_FT = {
    30: "CPU or RAM error",
    29: "digital board error",
    28: "analog board error",
    27: "serial link error",
    26: "program memory error",
    25: "halted by configuration errors",
    24: "settings validation error",
    23: "configuration and calibration do not match",
    22: "network error",
    20: "RDT error",
    17: "saturation or A/D error",
    16: "monitor condition latched",
    14: "watchdog timeout",
    10: "analog board error",
    9: "analog board error",
    8: "analog board error",
    7: "excitation or supply error",
    6: "excitation or supply error",
    5: "excitation or supply error",
    4: "excitation or supply error",
    3: "artificial reference out of range",
    2: "temperature out of range",
    1: "HTTP error",
}
_AXIA = {
    30: "force or torque out of range",
    29: "calibration checksum error",
    28: "simulated readings",
    27: "gage out of range",
    16: "monitor condition latched",
    5: "common error",
    3: "busy",
    2: "broken gage",
    1: "supply out of range",
    0: "temperature out of range",
}
_BITS: dict[Family, dict[int, str]] = {"net f/t": _NET_FT, "axia": _AXIA, "onrobot": {}}
_SUMMARY = 31


def serious(status: int) -> bool:
    """Tell whether a reading with this status must not be believed.

    Anything but 0 and `WARNING` is serious, also a bit that no manual names.

    Parameters
    ----------
    status : int
    """
    return status not in (0, WARNING)


def describe(status: int, family: Family) -> str:
    """Say what a status word means.

    Parameters
    ----------
    status : int
    family : str
        ``net f/t``, ``axia`` or ``onrobot``.

    Returns
    -------
    str
        Such as ``status 0x80020000: saturation or A/D error``.
    """
    names: list[str] = []
    for bit in reversed(range(32)):
        if status >> bit & 1 and (bit != _SUMMARY or family == "onrobot"):
            name = _BITS[family].get(bit, f"bit {bit}")
            if name not in names:
                names.append(name)
    return f"status 0x{status:08x}: {', '.join(names) or 'an error without a name'}"
