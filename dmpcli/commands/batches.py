"""The options of ``generalize`` that belong to a table of pairs."""

from typing import TYPE_CHECKING

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.settings.batch import BatchOptions
    from dmpcli.settings.options import Given


def check(wanted: "BatchOptions", given: "Given", pairs: bool) -> None:
    """Check the options that belong to ``--pairs``.

    Raises
    ------
    InputError
        One is given without ``--pairs``, or they say nothing together.
    """
    from dmpcli.settings.model import settings_of

    alone = next((one.flag for one in settings_of(type(wanted)) if one.name in given), None)
    if not pairs and alone is not None:
        raise InputError(f"{alone}: belongs to --pairs; leave it out")
    if wanted.cluster is not None and "jobs" in given:
        raise InputError("--jobs and --cluster: the cluster has its own workers; leave --jobs out")
    if wanted.cluster is not None and "://" not in wanted.cluster:
        raise InputError(f"--cluster {wanted.cluster}: must be an address, as in tcp://HOST:8786")


def check_surfaces(wanted: "BatchOptions", given: "Given", many: bool, any_: bool) -> None:
    """Check the options that belong to surfaces.

    Parameters
    ----------
    wanted, given
    many : bool
        Whether the table names them.
    any_ : bool
        Whether there is one at all.

    Raises
    ------
    InputError
        One says nothing.
    """
    if "surfaces_per_part" in given and not many:
        raise InputError("--surfaces-per-part: the table names no surfaces; leave it out")
    if wanted.surface_cache is not None and not any_:
        raise InputError("--surface-cache: there is no surface to keep; leave it out")
