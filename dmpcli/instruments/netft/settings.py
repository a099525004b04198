"""What a box says of itself: scale, units, range, rates; read from its pages, never assumed.

The pages are ``netftapi2.xml`` (the active configuration) and ``netftcalapi.xml`` (the
calibration); without HTTP, the reply to READCALINFO on TCP 49151 gives scale and units alone.
"""

import re
import struct
from dataclasses import dataclass
from typing import NoReturn
from xml.etree import ElementTree as ET

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments.netft import units
from dmpcli.instruments.netft.protocol import MAGIC

FILTERS = ("none", 838, 326, 152, 73, 35, 18, 8, 5, 1500, 2000, 2500, 3000)
"""Cut-off of the box's low-pass by its number (``setuserfilter``), Hz."""

READCALINFO = bytes([1]) + bytes(19)
_CALIBRATION = struct.Struct(">HBBII12x")
CALIBRATION_SIZE = _CALIBRATION.size

_USED = re.compile(
    "prodname|cfgnam|cfgcpf|cfgcpt|scfgfu|scfgtu|cfgmr|cfgcalsel|comrdte|comrdtrate|comrdtbsiz|"
    "runrate|setrate|setuserfilter|setbias|calcpf|calcpt|calsn"
)
"""The fields that are read; each may stand in a page once."""


@dataclass(frozen=True)
class Scale:
    """What one count is.

    Attributes
    ----------
    counts_per_force, counts_per_torque : float
        Counts per unit.
    force_unit, torque_unit : str
    """

    counts_per_force: float
    counts_per_torque: float
    force_unit: str
    torque_unit: str

    def __post_init__(self) -> None:
        """Check; ValueError says what is wrong."""
        for name in ("counts_per_force", "counts_per_torque"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise ValueError(f"{name.replace('_', ' ')} = {value:g} is not a scale")
        try:
            units.newtons(self.force_unit)
            units.newton_metres(self.torque_unit)
        except KeyError as error:
            raise ValueError(f"unit {error.args[0]!r} is not known") from None

    @property
    def per_count(self) -> Floats:
        """N and N·m in one count, shape (6,)."""
        force = units.newtons(self.force_unit) / self.counts_per_force
        torque = units.newton_metres(self.torque_unit) / self.counts_per_torque
        return np.array([force] * 3 + [torque] * 3)

    @property
    def per_unit(self) -> Floats:
        """N and N·m in one of the box's units, shape (6,)."""
        force, torque = units.newtons(self.force_unit), units.newton_metres(self.torque_unit)
        return np.array([force] * 3 + [torque] * 3)


@dataclass(frozen=True)
class BoxInfo:
    """What a box says of itself.

    Attributes
    ----------
    product, configuration : str
        Names; empty where it does not say.
    scale : Scale
    limit : array, shape (6,), or None
        Measuring range, N and N·m; None where it does not say.
    rate : float or None
        RDT records per second, Hz.
    internal_rate : float or None
        Readings per second, Hz: the fastest that it can send.
    enabled : bool
        Whether its RDT interface is switched on.
    records : int
        Records in one datagram of a buffered stream.
    low_pass : int or None
        Number of its low-pass filter, see `FILTERS`.
    serial : str
        Serial number of the calibrated transducer; empty where it does not say.
    bias : tuple of float, or None
        What it takes off its readings, counts per axis; None where it does not say.
    """

    product: str
    configuration: str
    scale: Scale
    limit: Floats | None = None
    rate: float | None = None
    internal_rate: float | None = None
    enabled: bool = True
    records: int = 1
    low_pass: int | None = None
    serial: str = ""
    bias: tuple[float, ...] | None = None


def calibration_page(api: bytes) -> str:
    """Return the path of the calibration that the active configuration uses.

    Parameters
    ----------
    api : bytes
        ``netftapi2.xml``.

    Raises
    ------
    ValueError
        The page is not what it should be.
    """
    index = _number(_fields(api), "cfgcalsel")
    return "/netftcalapi.xml" + ("" if index is None else f"?index={index:.0f}")


def read_pages(api: bytes, calibration: bytes | None = None) -> BoxInfo:
    """Read ``netftapi2.xml`` and ``netftcalapi.xml``.

    Parameters
    ----------
    api : bytes
    calibration : bytes, optional
        For the serial number, and for the scale where the first page gives none.

    Raises
    ------
    ValueError
        A page is not what it should be; the message names the field.
    """
    fields = _fields(api)
    more = {} if calibration is None else _fields(calibration)
    scale = Scale(
        _number(fields, "cfgcpf") or _number(more, "calcpf") or _missing("cfgcpf"),
        _number(fields, "cfgcpt") or _number(more, "calcpt") or _missing("cfgcpt"),
        fields.get("scfgfu") or _missing("scfgfu"),
        fields.get("scfgtu") or _missing("scfgtu"),
    )
    records = _number(fields, "comrdtbsiz")
    low_pass = _number(fields, "setuserfilter")
    return BoxInfo(
        product=fields.get("prodname", ""),
        configuration=fields.get("cfgnam", ""),
        scale=scale,
        limit=_limit(fields, scale),
        rate=_number(fields, "comrdtrate"),
        # An Axia calls the rate of its converter setrate.
        internal_rate=_number(fields, "setrate") or _number(fields, "runrate"),
        enabled=fields.get("comrdte", "1").lower() in ("1", "enabled", "on", "true"),
        records=1 if records is None else max(int(records), 1),
        low_pass=None if low_pass is None else int(low_pass),
        serial=more.get("calsn", ""),
        bias=_bias(fields),
    )


def read_calibration(reply: bytes) -> Scale:
    """Read the reply to READCALINFO.

    Raises
    ------
    ValueError
        It is not one.
    """
    if len(reply) != CALIBRATION_SIZE:
        raise ValueError(f"READCALINFO: {len(reply)} bytes came, not {CALIBRATION_SIZE}")
    magic, force, torque, per_force, per_torque = _CALIBRATION.unpack(reply)
    if magic != MAGIC:
        raise ValueError(f"READCALINFO: the reply begins with 0x{magic:04x}, not 0x{MAGIC:04x}")
    if force not in units.FORCE_NUMBERS or torque not in units.TORQUE_NUMBERS:
        raise ValueError(f"READCALINFO: unit {force} of force, {torque} of torque is not known")
    return Scale(per_force, per_torque, units.FORCE_NUMBERS[force], units.TORQUE_NUMBERS[torque])


def _fields(page: bytes) -> dict[str, str]:
    # No page of a box declares entities; a page that does is not one and could be a bomb.
    if b"<!DOCTYPE" in page or b"<!ENTITY" in page:
        raise ValueError("the page declares a document type, which no box does")
    try:
        root = ET.fromstring(page)
    except (ET.ParseError, ValueError, LookupError) as error:
        raise ValueError(f"the page is not XML: {error}") from None
    fields: dict[str, str] = {}
    for element in root.iter():
        text = (element.text or "").strip()
        if _USED.fullmatch(element.tag) and fields.setdefault(element.tag, text) != text:
            raise ValueError(f"{element.tag} stands twice, as {fields[element.tag]!r} and {text!r}")
    return fields


def _missing(name: str) -> NoReturn:
    raise ValueError(f"the page gives no {name}")


def _number(fields: dict[str, str], name: str) -> float | None:
    text = fields.get(name, "")
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{name} = {text!r} is not a number")
    return value


def _list(fields: dict[str, str], name: str) -> list[float]:
    parts = [part for part in fields.get(name, "").split(";") if part.strip()]
    return [_number({name: part}, name) or 0.0 for part in parts]


def _bias(fields: dict[str, str]) -> tuple[float, ...] | None:
    try:
        return tuple(_list(fields, "setbias")) or None
    except ValueError:
        return None  # of another form; nothing else is made of it


def _limit(fields: dict[str, str], scale: Scale) -> Floats | None:
    """Range in N and N·m; a box that does not know it gives zeros.

    It is taken to be in the configuration's own units, which the manual leaves open.
    """
    values = _list(fields, "cfgmr")
    if len(values) != 6 or not all(value > 0.0 for value in values):
        return None
    return np.array(values) * scale.per_unit
