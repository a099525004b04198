"""LeRobot datasets, version 3: Parquet of float32 on an even grid, one episode per stroke.

``observation.state`` holds x, y, z in m and, where the tool's orientation is known, its quaternion
x, y, z, w; ``action`` is the state that comes next. A wrench stands in ``observation.wrench``,
joint angles in rad in ``observation.joints``, each where every stroke has them.
Layout: LeRobotDataset v3.0 (huggingface.co/docs/lerobot), codebase_version ``v3.0``.
"""

import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from dmpcli.arrays import AnyArray, Floats
from dmpcli.errors import InputError
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.records import parquet, untrusted
from dmpcli.records.columns import LARGEST
from dmpcli.records.rotation_forms import wrong
from dmpcli.spatial.rotations import from_quaternion, to_quaternion

INFO = Path("meta") / "info.json"
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_PLACE, _TURN = ["x_m", "y_m", "z_m"], ["qx", "qy", "qz", "qw"]
_FELT = ["fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"]
_STATE, _ACTION, _WRENCH = "observation.state", "action", "observation.wrench"
_JOINTS = "observation.joints"
_QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}


def write(motion: Motion, folder: Path, fps: int, task: str) -> None:
    """Write a dataset whole, or not at all; an older one of that name is replaced.

    Parameters
    ----------
    motion : Motion
        On an even grid; see `workflows.motions.evenly`.
    folder : Path
    fps : int
        Samples per second of that grid.
    task : str

    Raises
    ------
    InputError
        The folder holds something else or cannot be written.
    """
    if folder.is_dir() and any(folder.iterdir()) and not (folder / INFO).is_file():
        raise InputError(f"{folder}: holds something else than a dataset; choose another folder")
    columns = [_columns(motion, one) for one in motion.strokes]
    lengths = [len(one) for one in motion.strokes]
    temporary = folder.absolute().with_name(f".{folder.name}.{os.getpid()}.tmp")
    try:
        (temporary / "data" / "chunk-000").mkdir(parents=True)
        (temporary / "meta" / "episodes" / "chunk-000").mkdir(parents=True)
        table = _data(columns, lengths, fps)
        pq.write_table(table, temporary / _DATA.format(chunk_index=0, file_index=0))
        stats = [_statistics(_rows(table, number)) for number in range(len(lengths))]
        pq.write_table(
            _episodes(lengths, stats, task),
            temporary / "meta" / "episodes" / "chunk-000" / "file-000.parquet",
        )
        pq.write_table(_tasks(task), temporary / "meta" / "tasks.parquet")
        _json(temporary / "meta" / "stats.json", _statistics(_rows(table, None)))
        _json(temporary / INFO, _info(columns[0], lengths, fps))
        if folder.is_dir():
            shutil.rmtree(folder)
        temporary.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _columns(motion: Motion, one: MotionStroke) -> dict[str, AnyArray]:
    parts = [one.position / 1000.0]
    if motion.oriented:
        q = to_quaternion(np.asarray(one.rotation))
        # Both signs are one rotation: that of the sample before, so that nothing leaps.
        flips = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0))
        parts.append(q * np.concatenate([[1.0], flips])[:, None])
    state = np.hstack(parts).astype(np.float32)
    found = {_STATE: state, _ACTION: np.concatenate([state[1:], state[-1:]])}
    if all(stroke.wrench is not None for stroke in motion.strokes):
        found[_WRENCH] = np.asarray(one.wrench, dtype=np.float32)
    widths = {0 if stroke.joints is None else stroke.joints.shape[1] for stroke in motion.strokes}
    if len(widths) == 1 and 0 not in widths:
        found[_JOINTS] = np.asarray(one.joints, dtype=np.float32)
    return found


def _data(columns: list[dict[str, AnyArray]], lengths: list[int], fps: int) -> Any:
    frames = [np.arange(n) for n in lengths]
    arrays: dict[str, Any] = {}
    for name in columns[0]:
        values = np.concatenate([part[name] for part in columns])
        flat = pa.array(np.ascontiguousarray(values).ravel())
        arrays[name] = pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
    arrays["timestamp"] = pa.array(
        np.concatenate([frame / fps for frame in frames]).astype(np.float32)
    )
    arrays["frame_index"] = pa.array(np.concatenate(frames))
    arrays["episode_index"] = pa.array(np.repeat(np.arange(len(lengths)), lengths))
    arrays["index"] = pa.array(np.arange(sum(lengths)))
    arrays["task_index"] = pa.array(np.zeros(sum(lengths), dtype=np.int64))
    return pa.table(arrays)


def _rows(table: Any, episode: int | None) -> dict[str, AnyArray]:
    """Columns of one episode, or of all, as arrays of shape (n, k)."""
    episodes = np.asarray(table.column("episode_index"))
    rows = slice(None) if episode is None else episodes == episode
    found = {}
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        if pa.types.is_fixed_size_list(column.type):
            values = np.asarray(column.flatten()).reshape(-1, column.type.list_size)
        else:
            values = np.asarray(column)[:, None]
        found[name] = values[rows]
    return found


def _statistics(columns: dict[str, AnyArray]) -> dict[str, dict[str, list[float]]]:
    found = {}
    for name, values in columns.items():
        wide = values.astype(float)
        found[name] = {
            "min": wide.min(axis=0).tolist(),
            "max": wide.max(axis=0).tolist(),
            "mean": wide.mean(axis=0).tolist(),
            "std": wide.std(axis=0).tolist(),
            "count": [len(wide)],
        } | {word: np.quantile(wide, share, axis=0).tolist() for word, share in _QUANTILES.items()}
    return found


def _episodes(lengths: list[int], stats: list[dict[str, dict[str, list[float]]]], task: str) -> Any:
    ends = np.cumsum(lengths)
    count, nothing = len(lengths), [0] * len(lengths)
    columns: dict[str, Any] = {
        "episode_index": pa.array(range(count), pa.int64()),
        "tasks": pa.array([[task]] * count),
        "length": pa.array(lengths, pa.int64()),
        "data/chunk_index": pa.array(nothing, pa.int64()),
        "data/file_index": pa.array(nothing, pa.int64()),
        "dataset_from_index": pa.array(ends - lengths),
        "dataset_to_index": pa.array(ends),
        "meta/episodes/chunk_index": pa.array(nothing, pa.int64()),
        "meta/episodes/file_index": pa.array(nothing, pa.int64()),
    }
    for name, by_word in stats[0].items():
        for word in by_word:
            columns[f"stats/{name}/{word}"] = pa.array([one[name][word] for one in stats])
    return pa.table(columns)


def _tasks(task: str) -> Any:
    """Tasks as pandas writes them, by their text as index: LeRobot reads them so."""
    pandas = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {
                "name": "task_index",
                "field_name": "task_index",
                "pandas_type": "int64",
                "numpy_type": "int64",
                "metadata": None,
            },
            {
                "name": "task",
                "field_name": "task",
                "pandas_type": "unicode",
                "numpy_type": "object",
                "metadata": None,
            },
        ],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": "2.3.0",
    }
    table = pa.table({"task_index": pa.array([0], pa.int64()), "task": pa.array([task])})
    return table.replace_schema_metadata({b"pandas": json.dumps(pandas).encode()})


def _info(columns: dict[str, AnyArray], lengths: list[int], fps: int) -> dict[str, Any]:
    width = columns[_STATE].shape[1]
    names = _PLACE + (_TURN if width > 3 else [])
    features: dict[str, Any] = {
        name: {"dtype": "float32", "shape": [values.shape[1]], "names": names}
        for name, values in columns.items()
    }
    if _WRENCH in features:
        features[_WRENCH]["names"] = _FELT
    if _JOINTS in features:
        features[_JOINTS]["names"] = [f"q{i + 1}_rad" for i in range(columns[_JOINTS].shape[1])]
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    for name in ("frame_index", "episode_index", "index", "task_index"):
        features[name] = {"dtype": "int64", "shape": [1], "names": None}
    return {
        "codebase_version": "v3.0",
        "robot_type": "dmpcli",
        "total_episodes": len(lengths),
        "total_frames": sum(lengths),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": fps,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": _DATA,
        "video_path": None,
        "features": features,
    }


def _json(path: Path, document: Any) -> None:
    path.write_text(json.dumps(document, indent=4, allow_nan=False) + "\n", encoding="utf-8")


def read(folder: Path, episode: str | None) -> tuple[MotionStroke, list[str]]:
    """Read one episode of a dataset whose state names its coordinates as ours do.

    Parameters
    ----------
    folder : Path
    episode : str, optional
        Its number; the only one where it is not said.

    Raises
    ------
    InputError
        Damaged, of another state, or with several episodes and none chosen.
    """
    with untrusted.decoding(str(folder)):
        return _read(folder, episode)


def _read(folder: Path, episode: str | None) -> tuple[MotionStroke, list[str]]:
    names, episodes = _described(folder)
    number = _number(folder, episode, episodes)
    files = sorted((folder / "data").rglob("*.parquet"))
    if not files:
        raise InputError(f"{folder}: has no data/*.parquet; the dataset is not whole")
    there = pq.read_schema(files[0]).names if _readable(files[0]) else []
    more = [name for name in (_WRENCH, _JOINTS) if name in there]
    wanted = [_STATE, "timestamp", "episode_index", *more]
    parts = [part for file in files if (part := _part(file, number, wanted)) is not None]
    if not parts:
        raise InputError(f"{folder}: holds no samples of episode {number}")
    known = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    state, t = known[_STATE], known["timestamp"]
    _check_width(folder, _STATE, state, len(names))
    if _WRENCH in known:
        _check_width(folder, _WRENCH, known[_WRENCH], len(_FELT))
    if len(t) < 2 or not all((np.abs(each) <= LARGEST).all() for each in known.values()):
        raise InputError(
            f"{folder}: episode {number} holds a value that is not a number or beyond "
            f"{LARGEST:g}, or nothing"
        )
    if (np.diff(t) <= 0.0).any():
        raise InputError(f"{folder}: episode {number}: its time does not increase")
    place = [names.index(name) for name in _PLACE]
    told = [f"episode {number}, {_STATE} in m"]
    R = None
    if all(name in names for name in _TURN):
        q = state[:, [names.index(name) for name in _TURN]]
        bad = wrong("quaternion", q)
        if bad is not None:
            raise InputError(f"{folder}: episode {number}, frame {bad[0]}: {bad[1]}")
        R = from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True))
    felt, joints = known.get(_WRENCH), known.get(_JOINTS)
    position = state[:, place] * 1000.0
    return MotionStroke(t, position, R, id=str(number), wrench=felt, joints=joints), told


def _check_width(folder: Path, name: str, values: Floats, width: int) -> None:
    if values.shape[1] != width:
        raise InputError(
            f"{folder}: {name} holds {values.shape[1]} numbers a sample, {width} are described; "
            "the dataset is damaged"
        )


def _described(folder: Path) -> tuple[list[str], int]:
    """Return the names of the state's numbers, and how many episodes there are."""
    try:
        info = json.loads((folder / INFO).read_text(encoding="utf-8"))
        version, state = str(info["codebase_version"]), info["features"][_STATE]
        names, episodes = state.get("names"), int(info["total_episodes"])
    except (
        OSError,
        ArithmeticError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        RecursionError,
    ):
        raise InputError(f"{folder}: {INFO} is missing or damaged; no LeRobot dataset") from None
    if isinstance(names, dict) and len(names) == 1:
        [names] = names.values()
    if not version.startswith("v3"):
        raise InputError(
            f"{folder}: is a dataset of {version}; LeRobot's own script converts it to v3.0"
        )
    if not isinstance(names, list) or not all(name in names for name in _PLACE):
        raise InputError(
            f"{folder}: its {_STATE} is {str(names)[:80]}, not {', '.join(_PLACE)}: say what it "
            f"is, as in import DATA/file-000.parquet --layout lerobot --map x={_STATE}[0]"
        )
    return names, episodes


def _number(folder: Path, episode: str | None, episodes: int) -> int:
    if episode is None:
        if episodes == 1:
            return 0
        raise InputError(
            f"{folder}: holds {episodes} episodes, 0 to {episodes - 1}; choose one with --episode N"
        )
    if not episode.isdecimal() or int(episode) >= episodes:
        raise InputError(f"--episode {episode}: {folder} has 0 to {episodes - 1}")
    return int(episode)


def _readable(file: Path) -> bool:
    try:
        pq.read_schema(file)
    except (pa.ArrowException, OSError, ValueError):
        return False
    return True


def _part(file: Path, number: int, wanted: list[str]) -> dict[str, Floats] | None:
    """Columns of an episode in one file, but for its number; None where it holds none of it."""
    # Group by group: Arrow's own filtering, which works in threads, never returns from some files.
    whole = parquet.opened(file, "fetch it again", text=())
    parquet.judge(str(file), whole, file.stat().st_size)
    with untrusted.decoding(str(file)), whole, np.errstate(invalid="ignore"):
        groups = [
            group.filter(pc.equal(group.column("episode_index"), number))
            for group in (
                whole.read_row_group(i, columns=wanted, use_threads=False)
                for i in range(whole.num_row_groups)
            )
        ]
        if not sum(map(len, groups)):
            return None
        table = pa.concat_tables(groups)
        found = {"timestamp": np.asarray(table.column("timestamp"), dtype=float)}
        for name in wanted:
            if name.startswith("observation."):
                column = table.column(name).combine_chunks()
                flat = np.asarray(column.flatten(), dtype=float)
                found[name] = flat.reshape(len(table), -1)
    return found
