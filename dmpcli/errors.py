"""What goes wrong through no fault of the program, and the exit code of each.

A message is one or two lines: what is wrong, where (file, column, row), what to do.
"""

import contextlib
import re
from collections.abc import Iterator


class DmpError(Exception):
    """Root of every error that a user can cause and mend; never shown as a traceback."""

    exit_code = 2


class InputError(DmpError):
    """The command line, a preset, an input file or a missing extra is wrong (exit code 2)."""

    exit_code = 2


class RefusedError(DmpError):
    """The stroke cannot be drawn here, or the motion or robot state breaks a limit (code 3)."""

    exit_code = 3


class InstrumentError(DmpError):
    """An instrument cannot be reached, or failed while running (exit code 4)."""

    exit_code = 4


class UnconfirmedStopError(InstrumentError):
    """An arm that may still move (code 4); its text ends with that, and nothing outranks it.

    Its cause, where that is a defect of ours, is shown with its traceback before.
    """


# Control characters but for tab and newline, what turns the direction of writing or ends a line
# unseen, and halves of characters, as file names that are no text have them.
_UNPRINTED = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
_FEIGNED = re.compile(r"\n(?=dmpcli: )")


def printable(text: str) -> str:
    r"""Return a text as it may be printed: names and values in it move no cursor, hide no words.

    What would is shown as ``\u001b``, which within JSON means the same as before; and no line but
    the first begins as this program's own messages do.

    Parameters
    ----------
    text : str
        May hold what files, controllers and the command line say.
    """
    shown = _UNPRINTED.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
    return _FEIGNED.sub("\n  ", shown)


def counted(number: int, what: str) -> str:
    """Return a number of things in words: 1 pose, 2 poses."""
    return f"{number} {what}" + ("" if number == 1 else "s")


@contextlib.contextmanager
def about(name: str, kind: type[DmpError] = DmpError) -> Iterator[None]:
    """Put a file's name before the messages of errors that mathematics raises about it, once.

    Parameters
    ----------
    name : str
    kind : type of DmpError
        Others are about something else, and pass as they are.
    """
    try:
        yield
    except kind as error:
        said = str(error)
        named = said if said.startswith(f"{name}: ") else f"{name}: {said}"
        raise type(error)(named) from None


def beside(value: float, bound: float, form: str) -> str:
    """Return a number as text that lies on the same side of a bound as the number itself.

    Rounded onto its bound a message would contradict itself: 100 ms late, over 100 ms.

    Parameters
    ----------
    value, bound : float
    form : str
        A format such as ``.3g`` or ``.2f``; it gets more digits where it needs them.
    """
    for digits in range(int(form[1:-1]), 17):
        text = f"{value:.{digits}{form[-1]}}"
        if not (value - bound) * (float(text) - bound) <= 0.0 or value == bound:
            return text
    return text
