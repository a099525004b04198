"""The lines of a text table that count, without copying the text: files may have gigabytes."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Integers
from dmpcli.errors import InputError
from dmpcli.records.file_io import Source

MARK = b"\xef\xbb\xbf"
"""Byte order mark of UTF-8."""
_PASSED_OVER = re.compile(rb"^[ \t]*(?:#[^\n]*)?$", re.MULTILINE)
_NEWLINE = 10
_DOUBTFUL = np.isin(np.arange(256), list(b" \t\n#"))
"""Bytes with which a line that is passed over begins."""
_AT_ONCE = 1 << 20
_TAIL = 1 << 12


@dataclass(frozen=True)
class TextLines:
    """A stretch of a text.

    Attributes
    ----------
    content : bytes
    begin, end : int
        Of the stretch; no line's end stands at its end.
    numbers : array of int, shape (lines,)
        Of each line, counted from 1 in the file.
    """

    content: bytes
    begin: int
    end: int
    numbers: Integers

    @classmethod
    def kept(cls, every: Sequence[str], kept: Sequence[int]) -> "TextLines":
        """Join the lines of these places, counted from 0 in the file."""
        content = "\n".join([every[place] for place in kept]).encode()
        return cls(content, 0, len(content), np.array(kept, dtype=np.int64) + 1)

    def __len__(self) -> int:
        return self.end - self.begin

    def __contains__(self, sign: bytes) -> bool:
        return self.content.find(sign, self.begin, self.end) >= 0

    def search(self, pattern: re.Pattern[bytes]) -> bool:
        """Tell whether a pattern is found."""
        return pattern.search(self.content, self.begin, self.end) is not None

    def text(self, most: int | None = None) -> bytes:
        """Copy of the text, or of its beginning."""
        end = self.end if most is None else min(self.end, self.begin + most)
        return self.content[self.begin : end]

    def first(self) -> bytes:
        """Return the first line."""
        return self.content[self.begin : self._first_end()]

    def _first_end(self) -> int:
        end = self.content.find(b"\n", self.begin, self.end)
        return self.end if end < 0 else end

    def rest(self) -> "TextLines":
        """Return what follows the first line."""
        begin = min(self._first_end() + 1, self.end)
        return replace(self, begin=begin, numbers=self.numbers[1:])

    def of(self, content: bytes) -> "TextLines":
        """Return the same lines, written otherwise."""
        return TextLines(content, 0, len(content), self.numbers)

    def reader(self) -> Any:
        """Return an Arrow file of the text, which copies nothing."""
        return pa.BufferReader(pa.py_buffer(self.content).slice(self.begin, len(self)))


def begins(source: Source, word: bytes) -> bool:
    """Tell whether a text begins with a word, behind its byte order mark or not."""
    return source.content.startswith((word, MARK + word))


def every_line(source: Source) -> list[str]:
    """Lines of a text file, however they end; without the empty ones at its end.

    Raises
    ------
    InputError
        It is not text in UTF-8.
    """
    try:
        text = source.content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source.name}: is not text in UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n").split("\n")


def counted_lines(source: Source) -> TextLines:
    """Return the lines of a text file that count: neither empty nor of comment.

    Raises
    ------
    InputError
        It is not text in UTF-8.
    """
    content = source.content.removeprefix(MARK)
    if not content.isascii():
        try:
            # Only to know that it is text; Arrow takes the bytes.
            content.decode("utf-8")
        except UnicodeDecodeError:
            raise InputError(
                f"{source.name}: is neither a Parquet file nor text in UTF-8; save it as one of "
                "them (in a spreadsheet: CSV UTF-8)"
            ) from None
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    end = _stripped(content)
    count, doubtful = _looked_at(content, end)
    if not doubtful or _PASSED_OVER.search(content, 0, end) is None:
        return TextLines(content, 0, end, np.arange(1, count + 1))
    every = content[:end].split(b"\n")
    kept = [number for number, line in enumerate(every) if not _PASSED_OVER.fullmatch(line)]
    text = b"\n".join([every[number] for number in kept])
    return TextLines(text, 0, len(text), np.array(kept, dtype=np.int64) + 1)


def _stripped(content: bytes) -> int:
    """Length of a text without the line ends at its end."""
    tail = content[-_TAIL:].rstrip(b"\n")
    if tail or not content:
        return max(len(content) - _TAIL, 0) + len(tail)
    return len(content.rstrip(b"\n"))


def _looked_at(content: bytes, end: int) -> tuple[int, bool]:
    """How many lines there are, and whether one begins like a line that is passed over."""
    letters = np.frombuffer(content, dtype=np.uint8)[:end]
    count, doubtful = 1, end == 0 or bool(_DOUBTFUL[letters[0]])
    for first in range(0, end, _AT_ONCE):
        starts = np.flatnonzero(letters[first : first + _AT_ONCE] == _NEWLINE) + first + 1
        count += len(starts)
        # What ends the text is no line's end: a line begins after each.
        doubtful = doubtful or bool(_DOUBTFUL[letters[starts]].any())
    return count, doubtful
