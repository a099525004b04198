"""Names of outputs: a file is never written under the suffix of another kind."""

from collections.abc import Mapping

from dmpcli.errors import InputError
from dmpcli.records.file_io import DASH
from dmpcli.records.storage import Location, located

PARQUET: Mapping[str, tuple[str, ...]] = {"Parquet": (".parquet", ".pq")}
JSON: Mapping[str, tuple[str, ...]] = {"JSON": (".json",)}
CSV: Mapping[str, tuple[str, ...]] = {"CSV": (".csv", ".txt")}


def check(path: str | Location, kind: Mapping[str, tuple[str, ...]]) -> None:
    """Refuse an output whose suffix is not one of its kind; no suffix will do.

    Parameters
    ----------
    path : str, Path or ObjectPath
        ``-`` and devices have none.
    kind : mapping of str to tuple of str
        One of those above.

    Raises
    ------
    InputError
    """
    [(word, wanted)] = kind.items()
    place = located(path)
    suffix, stem = place.suffix, place.stem
    if str(path) == DASH or not suffix or suffix.lower() in wanted:
        return
    text = f"-o {path}: this command writes {word}, and {suffix!r} is not its suffix; name it "
    text += f"{stem}{wanted[0]}"
    if kind is PARQUET:
        text += f", from which 'dmpcli export {stem}{wanted[0]} -o FILE' makes other formats"
    raise InputError(text)
