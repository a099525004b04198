"""Command lines that are told, so that a shell takes them as they stand."""

import re
import shlex

INDENT = 2
"""Columns before a line that is to be typed."""

_FURTHER = 4


def is_typed(line: str) -> bool:
    """Tell whether a line of a description is one to be typed."""
    return line.startswith(f"{'':{INDENT}}dmpcli ")


def wrapped(line: str, width: int) -> list[str]:
    """Break a command line before options; a backslash ends what goes on.

    Parameters
    ----------
    line : str
        With its indent.
    width : int
        Columns; an option with a longer value has a line of its own.
    """
    groups: list[str] = []
    for word in shlex.split(line):
        option = re.fullmatch(r"--?[A-Za-z][\w-]*", word)
        if option or not groups:
            groups.append(shlex.quote(word))
        else:
            groups[-1] += f" {shlex.quote(word)}"
    made, now = list[str](), f"{'':{INDENT}}{groups[0]}"
    for group in groups[1:]:
        if len(now) + len(group) + 3 > width and now.strip():
            made.append(f"{now} \\")
            now = f"{'':{INDENT + _FURTHER}}{group}"
        else:
            now += f" {group}"
    return [*made, now]
