"""Options whose value is a pose: six words or one file, which option parsers cannot tell apart.

``--surface-pose X Y Z RX RY RZ`` becomes ``--surface-pose=X Y Z RX RY RZ``, one word, before the
parser sees it; a file's name passes unchanged. `dmpcli.records.pose.parse` reads both. And
``--workspace none`` becomes the widest box there is.
"""

from collections.abc import Sequence

from dmpcli.settings.ranges import WIDEST

POSE_OPTIONS = ("--surface-pose", "--initial")
WORKSPACE, NONE = "--workspace", "none"
NUMBERS = 6


def joined(words: Sequence[str], options: Sequence[str] = POSE_OPTIONS) -> list[str]:
    """Return the command line with the numbers that follow a pose option made one value.

    At most six numbers are joined; where fewer follow, they are joined too, so that the reader of
    the value can say what is missing. Nothing behind ``--`` is touched.
    """
    result: list[str] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        option, equals, first = word.partition("=")
        if word == "--":
            return [*result, word, *rest]
        if option == WORKSPACE and NONE in (first if equals else "", *rest[: not equals]):
            # The parser wants six numbers: the widest box that may be named bounds nothing.
            result += [WORKSPACE, *map(str, WIDEST)]
            del rest[: not equals]
            continue
        if option not in options or (equals and not _is_number(first)):
            result.append(word)
            continue
        numbers = [first] if equals else []
        while rest and len(numbers) < NUMBERS and _is_number(rest[0]):
            numbers.append(rest.pop(0))
        result.append(f"{option}={' '.join(numbers)}" if numbers else word)
    return result


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
