"""An instrument's URL, taken apart: scheme, host, port and the options after the question mark."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import parse_qsl, urlsplit

from dmpcli.errors import InputError

MOCK = "mock:"

# Of these a URL says what was simulated, and names no place.
_SIMULATED = ("mock", "bench")


@dataclass(frozen=True)
class Address:
    """One instrument's URL, taken apart.

    Attributes
    ----------
    role : str
        ``sensor`` or ``robot``.
    scheme : str
        Names the driver.
    host : str
        Empty for the mock.
    port : int or None
        None is the driver's own.
    options : mapping
        What follows the question mark, as text; the driver reads it (`dmpcli.instruments.options`).
    """

    role: str
    scheme: str
    host: str = ""
    port: int | None = None
    options: Mapping[str, str] = field(default_factory=dict)

    @property
    def simulated(self) -> bool:
        """Whether this is the mock."""
        return self.scheme == "mock"

    def __str__(self) -> str:
        """Option and URL for messages: ``--robot elite://10.0.0.1:8055``, without its options."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        place = f"//{host}" if host else ""
        return f"--{self.role} {self.scheme}:{place}{'' if self.port is None else f':{self.port}'}"


def split(url: str, role: str) -> Address:
    """Take a URL apart, whether or not a driver is installed for its scheme.

    Parameters
    ----------
    url : str
        ``mock:``, ``mock:?plate=-17.5&stiffness=5``, ``elite://HOST:PORT?lookahead=0.1``, ...
    role : str
        ``sensor`` or ``robot``: which option it was given to.

    Raises
    ------
    InputError
        Host or port is missing or wrong, or an option is given twice.
    """
    scheme, _, rest = url.partition(":")
    if scheme == "mock":
        if rest and not rest.startswith("?"):
            raise InputError(
                f"--{role} {url}: the mock has no host; options follow as mock:?key=value"
            )
        return Address(role, scheme, options=_query(url, role, rest.removeprefix("?")))
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise InputError(f"--{role} {url}: {error}") from None
    if not host:
        raise InputError(f"--{role} {url}: needs a host, as in {scheme}://192.168.1.1")
    if parts.path.strip("/") or parts.fragment or "@" in parts.netloc or port == 0:
        raise InputError(
            f"--{role} {url}: only a host, a port and options, as in "
            f"{scheme}://192.168.1.1:8000?key=value"
        )
    return Address(role, scheme, host, port, _query(url, role, parts.query))


def _query(url: str, role: str, query: str) -> dict[str, str]:
    options: dict[str, str] = {}
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise InputError(f"--{role} {url}: options are key=value pairs joined by &") from None
    for key, text in pairs:
        if key in options:
            raise InputError(f"--{role} {url}: {key}: is given twice")
        options[key] = text
    return options


def in_provenance(url: str | None) -> str | None:
    """Return what a file may say of an instrument: a simulated URL, a real one's scheme.

    Parameters
    ----------
    url : str or None
        None where there is no such instrument.
    """
    if url is None:
        return None
    scheme = url.partition(":")[0]
    return url if scheme in _SIMULATED else scheme


def need_tool(sensor: Address, given: bool) -> None:
    """Refuse a real sensor without the tool on it; the mock knows its own.

    Parameters
    ----------
    sensor : Address
    given : bool
        Whether there is a tool file.

    Raises
    ------
    InputError
    """
    if not (sensor.simulated or given):
        raise InputError(f"{sensor}: a real sensor needs its tool: --tool FILE")
