"""Columns that look like a rotation by their names, but were not read, and what reads them.

Recorders name them in many ways, and a recording whose orientation is left out by mistake still
makes a stroke: so what looks like one is named.
"""

import re
from collections.abc import Iterator, Sequence

from dmpcli.records.rotation_forms import (
    EULER_NAMES,
    MATRIX_NAMES,
    NUMBERED,
    QUATERNION_NAMES,
)

# Groups of columns that look like a rotation, as ends of their names, and the words that read them.
_LOOKS = (
    (QUATERNION_NAMES, "--rotation quaternion"),
    (("q_x", "q_y", "q_z", "q_w"), "--rotation quaternion with --map qx=..."),
    (
        ("orientation.x", "orientation.y", "orientation.z", "orientation.w"),
        "--layout ros, or --rotation quaternion with --map qx=...",
    ),
    (EULER_NAMES, "--rotation with --map rx=..."),
    (("roll", "pitch", "yaw"), "--rotation rpy --map rx=roll --map ry=pitch --map rz=yaw"),
    (tuple(f"actual_TCP_pose_{i}" for i in (3, 4, 5)), "--layout ur"),
    (("A", "B", "C"), "--rotation rpy --angle-unit deg --map rx=C --map ry=B --map rz=A (KUKA)"),
    (("W", "P", "R"), "--rotation rpy --angle-unit deg --map rx=W --map ry=P --map rz=R (Fanuc)"),
    (MATRIX_NAMES, "--rotation matrix"),
)

# Words that name a rotation, in lower case, where letters or numbers of its entries follow them.
_EULER = frozenset(["euler", "theta", "angle", "angles"])
_ANGLES = _EULER | {"r", "rot", "rotation", "rotvec", "ori", "orient", "orientation", "o"}
_QUATERNIONS = frozenset(["q", "quat", "quaternion", "rot", "rotation", "orient", "orientation"])
_MATRICES = frozenset(["r", "rot", "rotation", "matrix", "m"])
_UNIT = r"(?P<after>[\W_]*(?:deg|degrees?|rad|radians?|°)?[\W_]*)"
_TURNS, _GREEK = ("roll", "pitch", "yaw"), ("alpha", "beta", "gamma")
_BY_LETTER = re.compile(rf"(?P<before>.*?)(?P<entry>[xyzw]){_UNIT}", re.IGNORECASE)
_BY_WORD = re.compile(
    rf"(?P<before>.*?)(?P<entry>{'|'.join(_TURNS + _GREEK)}){_UNIT}", re.IGNORECASE
)
_BY_NUMBER = re.compile(r"(?P<before>.*?)(?P<entry>\d)(?P<after>\W*)")
_BY_NUMBERS = re.compile(r"(?P<before>.*?)(?P<entry>\d[\W_]?\d)(?P<after>\W*)")


def unread(names: Sequence[str], taken: Sequence[str], oriented: bool) -> list[str]:
    """Say which columns look like a rotation but were not read, and what reads them.

    Parameters
    ----------
    names, taken : sequence of str
        All columns, and those that were read.
    oriented : bool
        Whether a rotation was read. Then names that only resemble those of one are no doubt, but
        for a fourth column that makes a quaternion of three angles.
    """
    remarks = []
    for ends, option in _LOOKS:
        for first in names:
            before = re.fullmatch(f"(.*){re.escape(ends[0])}", first)
            if before is None or (before[1] and before[1][-1].isalnum()):
                continue
            group = [before[1] + end for end in ends]
            if all(name in names for name in group) and not set(group) & set(taken):
                remarks.append(
                    f"columns {', '.join(group)} are there but were not read; {option} reads them"
                )
                taken = [*taken, *group]
    for group, option in _alike(names):
        known = set(group) & set(taken)
        if not known and not oriented:
            remarks.append(
                f"columns {_listed(group)} are there but were not read; {option} reads them"
            )
            taken = [*taken, *group]
        elif len(group) == 4 and known == set(group[:3]):
            remarks.append(
                f"column {group[3]} was not read, and makes a quaternion of {_listed(group[:3])}; "
                f"{option} reads it"
            )
    return remarks


def _alike(names: Sequence[str]) -> Iterator[tuple[list[str], str]]:
    """Yield groups of columns named like the entries of a rotation, and the words that read them.

    Of a group with a fourth entry w only the quaternion, not the three angles too.
    """
    for before, found in _families(_BY_LETTER, names):
        group = [found[axis] for axis in "xyzw" if axis in found]
        if len(group) == 4 and before:
            yield group, f"--rotation quaternion {_mapped(QUATERNION_NAMES, group)}"
        elif "w" not in found and len(group) == 3 and _word(before) in _ANGLES:
            form = "rpy" if _word(before) in _EULER else "rotvec"
            yield group, f"--rotation {form} (or its order) {_mapped(EULER_NAMES, group)}"
    for _, found in _families(_BY_WORD, names):
        if all(word in found for word in _TURNS):
            group = [found[word] for word in _TURNS]
            yield group, f"--rotation rpy {_mapped(EULER_NAMES, group)}"
        if all(word in found for word in _GREEK):
            yield [found[word] for word in _GREEK], "--rotation with its order and --map rx=..."
    yield from _numbered(names)


def _numbered(names: Sequence[str]) -> Iterator[tuple[list[str], str]]:
    """Yield quaternions and matrices whose entries are numbered, as `_alike`."""
    for before, found in _families(_BY_NUMBER, names):
        for numbers in ("0123", "1234"):
            # Of more numbers it is an arm's joints.
            if _word(before) in _QUATERNIONS and set(found) == set(numbers):
                group = [found[number] for number in numbers]
                option = f"--rotation quaternion {_mapped(QUATERNION_NAMES, group)} (or qw first)"
                yield group, "--rotation wxyz or xyzw" if tuple(group) in NUMBERED else option
    for before, found in _families(_BY_NUMBERS, names):
        digits = {key[0] + key[-1]: name for key, name in found.items()}
        for three in ("012", "123"):
            wanted = [f"{i}{j}" for i in three for j in three]
            if _word(before) in _MATRICES and set(digits) == set(wanted):
                group = [digits[key] for key in wanted]
                yield group, f"--rotation matrix {_mapped(MATRIX_NAMES[:1], group)} ..."


def _families(
    pattern: re.Pattern[str], names: Sequence[str]
) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield what stands before the entry, in lower case, and each entry's column."""
    families: dict[tuple[str, str], dict[str, str]] = {}
    for name in names:
        found = pattern.fullmatch(name)
        if found is not None:
            key = found["before"].lower(), found["after"].lower()
            families.setdefault(key, {}).setdefault(found["entry"].lower(), name)
    for (before, _), entries in families.items():
        yield before, entries


def _word(before: str) -> str:
    """Return the last word before an entry."""
    return re.split(r"[\W_\d]+", before.rstrip("_.[( -/"))[-1]


def _mapped(ours: Sequence[str], theirs: Sequence[str]) -> str:
    """Return the options that name columns; those that are named as ours are need none."""
    pairs = [(a, b) for a, b in zip(ours, theirs, strict=False) if a != b]
    return " ".join(f"--map {_quoted(f'{a}={b}')}" for a, b in pairs)


def _quoted(text: str) -> str:
    return text if re.fullmatch(r"[\w=.-]+", text) else f"'{text}'"


def _listed(group: Sequence[str]) -> str:
    return ", ".join(group if len(group) <= 4 else [*group[:3], "..."])
