"""The options of a real instrument's URL, read one by one; each with its unit and its range."""

import math
import re

from dmpcli.errors import InputError
from dmpcli.instruments.address import Address

_YES_NO = {"yes": True, "no": False, "1": True, "0": False}


class Options:
    """What follows the question mark of one URL; an option that nobody reads is refused.

    Parameters
    ----------
    address : Address
    """

    def __init__(self, address: Address) -> None:
        self._address = address
        self._known: list[str] = []

    def number(self, key: str, default: float, low: float, high: float, unit: str) -> float:
        """Read a number between `low` and `high`.

        Parameters
        ----------
        key : str
        default : float
            What an absent option means; it may lie beyond the bounds.
        low, high : float
            Both allowed, in `unit`.
        unit : str
            For the message; empty where there is none.

        Raises
        ------
        InputError
            It is no number, or beyond a bound; names the option and the range.
        """
        text = self._text(key)
        if text is None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise self.wrong(key, f"a number from {low:g} to {high:g} {unit}".rstrip())
        return value

    def numbers(self, key: str, counts: tuple[int, ...]) -> list[float] | None:
        """Read positive numbers with commas between, so many as `counts` allows; None if absent.

        Raises
        ------
        InputError
        """
        text = self._text(key)
        if text is None:
            return None
        try:
            values = [float(part) for part in text.split(",")]
        except ValueError:
            values = []
        if len(values) not in counts or not all(0.0 < value < math.inf for value in values):
            many = " or ".join(str(count) for count in counts)
            raise self.wrong(key, f"{many} positive numbers with commas between")
        return values

    def whole(self, key: str, default: int, low: int, high: int) -> int:
        """Read a whole number from `low` to `high`.

        Parameters
        ----------
        key : str
        default : int
            What an absent option means; it may lie beyond the bounds.
        low, high : int
            Both allowed.

        Raises
        ------
        InputError
            It is no whole number, or beyond a bound; names the option and the range.
        """
        text = self._text(key)
        if text is None:
            return default
        value = int(text) if re.fullmatch("-?[0-9]{1,9}", text) else None
        if value is None or not low <= value <= high:
            raise self.wrong(key, f"a whole number from {low} to {high}")
        return value

    def choice(self, key: str, default: str, *choices: str) -> str:
        """Read one of several words.

        Raises
        ------
        InputError
        """
        text = self._text(key)
        if text is not None and text not in choices:
            raise self.wrong(key, f"one of {', '.join(choices)}")
        return default if text is None else text

    def flag(self, key: str, default: bool) -> bool:
        """Read yes or no.

        Raises
        ------
        InputError
        """
        return _YES_NO[self.choice(key, "yes" if default else "no", *_YES_NO)]

    def text(self, key: str) -> str | None:
        """Read a text that the driver itself judges; None if absent."""
        return self._text(key)

    def quarter_turn(self, key: str) -> float:
        """Read an angle of 0, 90, 180 or 270 degrees, 0 by default; return it in rad.

        Raises
        ------
        InputError
        """
        return math.radians(float(self.choice(key, "0", "0", "90", "180", "270")))

    def wrong(self, key: str, needed: str) -> InputError:
        """Return the error that refuses an option's value.

        Parameters
        ----------
        key : str
        needed : str
            What would do.
        """
        return InputError(f"{self._address}: {key} = {self._address.options[key]!r}: {needed}")

    def done(self) -> None:
        """Refuse the options that were not read.

        Raises
        ------
        InputError
        """
        for key in self._address.options:
            if key not in self._known:
                raise InputError(
                    f"{self._address}: {key}: there is no such option; "
                    f"{self._address.scheme} has {', '.join(self._known) or 'none'}"
                )

    def _text(self, key: str) -> str | None:
        self._known.append(key)
        return self._address.options.get(key)
