"""Names of a controller's digital outputs: letters and a number, DO1."""

import re

from dmpcli.errors import InputError


def number(name: str, robot: str, first: int, last: int, letters: str = "DO") -> int:
    """Return the number of an output.

    Parameters
    ----------
    name : str
    robot : str
        For the message.
    first, last : int
    letters : str
        That its name begins with.

    Raises
    ------
    InputError
        The robot has none of this name.
    """
    found = re.fullmatch(rf"{letters}(\d{{1,4}})", name, re.ASCII)
    if found is None or not first <= int(found[1]) <= last:
        raise InputError(
            f"{robot}: has no output {name}; there are {letters}{first} to {letters}{last}"
        )
    return int(found[1])
