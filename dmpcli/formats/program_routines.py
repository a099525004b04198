"""In which order a robot program's routines run: as they stand in the file, or it is not read.

A reader takes moves from top to bottom. That is what the robot does only where every routine with
moves is run once, in the order in which the routines stand.
"""

from dataclasses import dataclass, field

from dmpcli.errors import InputError


@dataclass
class Routine:
    """One routine.

    Attributes
    ----------
    name : str
    moves : bool
        Whether it holds moves of its own.
    calls : list of (int, str)
        Line and name of each routine that it calls, in order.
    """

    name: str
    moves: bool = False
    calls: list[tuple[int, str]] = field(default_factory=list)


class Routines:
    """The routines of one file.

    Parameters
    ----------
    file : str
        For messages.
    entry : str
        Name of the routine that runs first, where there is one of that name; else the first one.
    known : frozenset of str
        Routines of the language that move nothing.
    """

    def __init__(self, file: str, entry: str, known: frozenset[str]) -> None:
        self._file, self._entry, self._known = file, entry, known
        self._all: dict[str, Routine] = {}
        self._open: list[Routine] = []
        self._bare = Routine("")
        self._still: set[str] = set()  # found to move nothing

    def begin(self, line: int, name: str) -> None:
        """A routine begins.

        Raises
        ------
        InputError
            There is one of this name.
        """
        if name.lower() in self._all:
            raise InputError(f"{self._file}: line {line}: routine {name} is there twice")
        routine = self._all[name.lower()] = Routine(name)
        self._open.append(routine)

    def end(self) -> None:
        """The routine that began last ends."""
        if self._open:
            self._open.pop()

    def moved(self) -> None:
        """A move stands here."""
        self._here.moves = True

    def call(self, line: int, name: str) -> None:
        """A routine is called here."""
        self._here.calls.append((line, name))

    @property
    def _here(self) -> Routine:
        return self._open[-1] if self._open else self._bare

    def check(self) -> None:
        """Make sure that moves run as they stand.

        Raises
        ------
        InputError
            A routine is called that the file does not hold; one is run more than once, in another
            order, never, or between moves of the one that calls it.
        """
        for routine in (self._bare, *self._all.values()):
            for line, name in routine.calls:
                if name.lower() not in self._all and name.lower() not in self._known:
                    raise InputError(
                        f"{self._file}: line {line}: routine {name} is not in this file; put it "
                        "there, or take the call out if it moves nothing"
                    )
        moving = [name for name, routine in self._all.items() if routine.moves]
        calls = [name.lower() for each in self._all.values() for _, name in each.calls]
        if len(moving) < 2 and not {*calls} & {*moving} and not self._bare.calls:
            return
        run: list[str] = []
        if self._bare.moves or self._bare.calls or not self._all:
            self._run(self._bare, run, 0)
        else:
            self._run(self._all.get(self._entry, next(iter(self._all.values()))), run, 0)
        if run != moving:
            raise InputError(
                f"{self._file}: its routines with moves stand as {_listed(moving)} and run as "
                f"{_listed(run)}; write each once, in the order in which they run"
            )

    def _run(self, routine: Routine, run: list[str], depth: int) -> None:
        """Append the routines with moves in the order in which they run."""
        if routine.moves:
            run.append(routine.name.lower())
        for line, name in routine.calls:
            called = self._all.get(name.lower())
            if called is None or called.name in self._still:
                continue
            endless = max(depth, len(run)) > len(self._all)
            if endless or (routine.moves and called.moves):
                raise InputError(
                    f"{self._file}: line {line}: {name} is called between moves, or by itself; "
                    "write the moves in the order in which they run"
                )
            before = len(run)
            self._run(called, run, depth + 1)
            if len(run) == before:
                self._still.add(called.name)  # else a few lines could take for ever


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:6])
    return (shown + (", ..." if len(names) > 6 else "")) or "none"
