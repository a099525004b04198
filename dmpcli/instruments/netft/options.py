"""What may follow ``netft://HOST[:PORT]?``.

========  ========================  ====================================================  =========
key       value                     meaning                                               default
========  ========================  ====================================================  =========
dialect   ati | axia | onrobot      whose commands and status bits                        the box's
http      port                      of its pages                                          80
tcp       port                      of its TCP interface, asked where HTTP does not       49151
                                    answer
range     six numbers, or two       measuring range Fx,Fy,Fz,Tx,Ty,Tz or force,torque,    the box's
                                    N and N·m
counts    two numbers               counts per unit of force and of torque, instead of    the box's
                                    what the box says
force     lbf N klbf kN kgf         unit of force that `counts` are for                   N
torque    lbf-in lbf-ft N-m N-mm    unit of torque that `counts` are for                  N-m
          kgf-cm kN-m
rate      set | keep                set the box's rate to the one that the loop asks      set
                                    for, or leave it and refuse to start where it
                                    differs
buffered  yes | no                  many records in one datagram                          no
filter    whole number              low-pass of the box: ATI 0 to 12, OnRobot 0 to 6; 0   as it is
                                    is none
bias      yes | no                  make the present reading zero, in the box; a          no
                                    calibration made before is then wrong
frozen    whole number              so many readings in a row, alike in all six counts,   25
                                    are a sensor that has frozen; 0: no matter how many
watch     s                         how often scale, units and bias of the box are read   0.5
                                    from its pages and compared, and once at the end;
                                    0: never
========  ========================  ====================================================  =========
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.instruments.address import Address
from dmpcli.instruments.netft.protocol import HTTP_PORT, TCP_PORT
from dmpcli.instruments.netft.settings import FILTERS, Scale
from dmpcli.instruments.options import Options as Query

ONROBOT_SCALE = Scale(10_000.0, 100_000.0, "N", "N-m")
"""By OnRobot's own UDP example; its boxes have no page that tells."""

FROZEN, WATCH = 25, 0.5
"""Noise makes two readings alike in all six counts a rarity; a changed bias moves an arm."""

_FORCES = ("lbf", "N", "klbf", "kN", "kgf")
_TORQUES = ("lbf-in", "lbf-ft", "N-m", "N-mm", "kgf-cm", "kN-m")
_ONROBOT_FILTERS = 7


@dataclass(frozen=True)
class NetFtOptions:
    """The options of one ``netft://`` URL; the module's table says what they mean.

    Attributes
    ----------
    dialect : str or None
        None: what the box calls itself decides.
    http, tcp : int
    range : array, shape (6,), or None
        N and N·m.
    scale : Scale or None
        None: the box is asked.
    keep_rate, buffered, bias : bool
    filter : int or None
    frozen : int
    watch : float
        s.
    """

    dialect: str | None = None
    http: int = HTTP_PORT
    tcp: int = TCP_PORT
    range: Floats | None = None
    scale: Scale | None = None
    keep_rate: bool = False
    buffered: bool = False
    bias: bool = False
    filter: int | None = None
    frozen: int = FROZEN
    watch: float = WATCH


def read(address: Address) -> NetFtOptions:
    """Read the options of a URL.

    Parameters
    ----------
    address : Address

    Raises
    ------
    InputError
        One is unknown, or its value is wrong; the message names it.
    """
    given = Query(address)
    dialect = given.choice("dialect", "", "ati", "axia", "onrobot") or None
    onrobot = dialect == "onrobot"
    filters = _ONROBOT_FILTERS if onrobot else len(FILTERS)
    low_pass = given.whole("filter", -1, 0, filters - 1)
    asked = NetFtOptions(
        dialect=dialect,
        http=given.whole("http", HTTP_PORT, 1, 65535),
        tcp=given.whole("tcp", TCP_PORT, 1, 65535),
        range=_range(given),
        scale=_scale(given, address),
        keep_rate=given.choice("rate", "set", "set", "keep") == "keep",
        buffered=given.flag("buffered", default=False),
        bias=given.flag("bias", default=False),
        filter=None if low_pass < 0 else low_pass,
        frozen=given.whole("frozen", FROZEN, 0, 1_000_000),
        watch=given.number("watch", WATCH, 0.0, 60.0, "s"),
    )
    given.done()
    if onrobot and asked.keep_rate:
        raise InputError(f"{address}: rate=keep: an OnRobot box does not tell its rate")
    if onrobot and asked.buffered:
        raise InputError(f"{address}: buffered: an OnRobot box sends single records only")
    return asked


def _range(given: Query) -> Floats | None:
    values = given.numbers("range", (6, 2))
    if values is None:
        return None
    return np.array(values) if len(values) == 6 else np.repeat(values, 3)


def _scale(given: Query, address: Address) -> Scale | None:
    counts = given.numbers("counts", (2,))
    force = given.choice("force", "N", *_FORCES)
    torque = given.choice("torque", "N-m", *_TORQUES)
    if counts is not None:
        return Scale(counts[0], counts[1], force, torque)
    for key in ("force", "torque"):
        if key in address.options:
            raise InputError(f"{address}: {key}: is the unit of counts, which is not given")
    return None
