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
