"""``dmpcli report``: by how much do the drawn strokes differ from the taught one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.figures.document import Part
    from dmpcli.figures.measured import Row

_WIDTH = 80


def command(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE...",
            help="Demonstrations, trajectories, batch folders, runs and skills; - is standard "
            "input. The first demonstration is what the others are compared with.",
            show_default=False,
        ),
    ],
    surface: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="plane.json that the strokes lie on."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="DIR", help="Also write report.json, CSV and figures here."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of the tables.")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No messages.")] = False,
) -> None:
    """Compare strokes: wave heights, deviation, smoothness, ends, deadlines."""
    from dmpcli.commands.messages import tell
    from dmpcli.figures import document, stroke
    from dmpcli.records import streams

    if files.count("-") > 1:
        raise InputError("-: standard input can be read only once; name the other files")
    if output is not None and output.exists() and not output.is_dir():
        raise InputError(f"{output}: is a file, -o needs the name of a folder")
    normal = None if surface is None else _normal(surface)
    labels = stroke.labels_of(files)
    parts = [_part(name, label, normal) for name, label in zip(files, labels, strict=True)]
    report = document.document(parts)
    if output is not None:
        _make_folder(output)
        written = _write(output, report, parts)
        tell(f"{output}: wrote {', '.join(written)}", quiet)
    if as_json:
        streams.say(document.as_json(report))
    else:
        streams.say(document.as_text(report, _width()).encode())


def _part(name: str, label: str, normal: "Floats | None") -> "Part":
    """Read one input, whatever it is."""
    from dmpcli.commands.messages import about
    from dmpcli.figures.document import Part
    from dmpcli.figures.stroke import demonstrated, strokes_of
    from dmpcli.records import record, recordings, schemas, skill, streams

    if name != streams.DASH and Path(name).is_dir():
        return _batch(Path(name), label, normal)
    source = streams.read(name)
    if source.content.lstrip()[:1] == b"{":
        return Part(label, source.sha256, skill.SCHEMA, skill=skill.decode(source)[1])
    found = record.decode(source) if record.is_ours(source) else None
    if found is None or found.schema is schemas.DEMONSTRATION:
        recording = recordings.stroke(source)
        kind, origin = ("recording", None) if found is None else ("demonstration", found.provenance)
        with about(source.name):
            return Part(
                label, source.sha256, kind, [demonstrated(recording, label, normal, origin)]
            )
    run = found if found.schema is schemas.RUN else None
    with about(source.name):
        return Part(label, source.sha256, found.schema.name, strokes_of(found, label, normal), run)


def _batch(folder: Path, label: str, normal: "Floats | None") -> "Part":
    """Read a batch: the pairs, and the parts that they name."""
    from dmpcli.commands.messages import about
    from dmpcli.figures.document import Part
    from dmpcli.figures.stroke import pairs_of, strokes_of
    from dmpcli.records import record, schemas, streams

    source = streams.read(folder / "pairs.parquet")
    pairs = record.decode(source, schemas.PAIRS)
    known, states = pairs_of(pairs)
    strokes = []
    for name in dict.fromkeys(part for part in pairs.columns.get("part", ()) if part):
        part = record.decode(streams.read(folder / name), schemas.TRAJECTORY)
        with about(part.name):
            strokes += strokes_of(part, label, normal, known)
    return Part(label, source.sha256, schemas.PAIRS.name, strokes, states=states)


def _normal(surface: Path) -> "Floats":
    from dmpcli.records import plane, streams

    return plane.decode(streams.read(surface)).normal


def _make_folder(output: Path) -> None:
    """Make the folder of the report, or say why not."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{output}: is a file, -o needs the name of a folder") from None
    except OSError as error:
        raise InputError(f"{output}: cannot be made: {error.strerror}") from None


def _write(output: Path, report: "Row", parts: "list[Part]") -> list[str]:
    """Write each file whole; return their names."""
    from dmpcli.figures import document
    from dmpcli.figures.gallery import gallery
    from dmpcli.records import streams

    strokes = [stroke for part in parts for stroke in part.strokes]
    files = {
        "report.json": document.as_json(report),
        "wave_heights.csv": document.as_csv(parts),
        **gallery(strokes),
    }
    # Figures of an earlier report that this one does not draw would be taken for its own.
    for old in output.glob("fig[0-9]_*.*"):
        if old.name not in files:
            old.unlink()
    for name, content in files.items():
        streams.write(output / name, content)
    return list(files)


def _width() -> int:
    """Columns to print in: the terminal's, and always the same into a file or a pipe."""
    import shutil
    import sys

    if sys.stdout is None or not sys.stdout.isatty():
        return _WIDTH
    return max(shutil.get_terminal_size().columns, _WIDTH)
