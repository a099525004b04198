"""Deprecated import paths: what drivers of other packages imported in version 0.1 still loads.

A module that has moved leaves a file behind which says where to::

    __getattr__ = names_of("dmpcli.rotations", "dmpcli.spatial.rotations")
"""

import importlib
import warnings
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

_NONE: Mapping[str, str] = MappingProxyType({})


def names_of(old: str, new: str, renamed: Mapping[str, str] = _NONE) -> Callable[[str], Any]:
    """Return a module's ``__getattr__`` that takes its names from another, with a warning.

    Parameters
    ----------
    old, new : str
        Modules.
    renamed : mapping of str to str
        Old names and what they are called now.
    """
    news = "".join(f", and its {was} {now}" for was, now in renamed.items())

    def found(name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(f"module {old!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(new), renamed.get(name, name))
        warnings.warn(
            f"{old} is {new} now{news}; the old names will go", DeprecationWarning, stacklevel=2
        )
        return value

    return found
