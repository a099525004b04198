"""What a file's strokes are: role, ends, plane, place, and the errors that name what is wrong."""

import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.records import schemas
from dmpcli.records.record import Provenance, Record
from dmpcli.reporting.strokes import labels_of, pairs_of, strokes_of
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests.reporting.example_files import (
    GOAL,
    NEW_GOAL,
    NEW_START,
    START,
    circle,
    demonstrated,
    demonstration,
    run,
    trajectory,
    wave,
)


def shown(record, normal=None):
    recording = Trajectory(record.t, record.position())
    return demonstrated(recording, "demo", normal, record.provenance)


def test_a_demonstration_keeps_its_wave_through_smoothing():
    stroke = shown(demonstration(noise=0.02))
    assert stroke.role == "demonstration"
    assert stroke.simulated
    assert not stroke.intended
    assert stroke.wave.heights == pytest.approx([49.979], abs=0.03)
    assert len(stroke.raw) == len(stroke.position) == len(stroke.t)
    assert np.abs(stroke.raw - stroke.position).max() > 0.02


def test_idle_ends_of_a_demonstration_are_cut_off_from_smoothed_and_raw_alike():
    path = np.vstack([np.repeat(wave()[:1], 200, 0), wave(), np.repeat(wave()[-1:], 150, 0)])
    stroke = shown(demonstration(path))
    assert 501 <= len(stroke.t) < 600
    assert stroke.raw == pytest.approx(stroke.position, abs=0.01)


def test_the_curve_that_was_dragged_along_is_rebuilt_from_the_facts():
    said = {"shape": "sine", "start": START.tolist(), "goal": GOAL.tolist()}
    said |= {"wave_height": 49.979, "periods": 1}
    stroke = shown(demonstration(facts={"reference": said}))
    assert np.abs(stroke.guide[::2] - wave()).max() < 1e-3
    assert shown(demonstration()).guide is None
    assert shown(demonstration(facts={"reference": {"shape": "polyline"}})).guide is None


def test_a_trajectory_takes_its_ends_and_plane_from_the_facts():
    (stroke,) = strokes_of(trajectory(wave(), goal=(GOAL + 0.5).tolist()), "t")
    assert stroke.label == "t"
    assert stroke.role == "modified"
    assert stroke.intended
    assert stroke.goal == pytest.approx(GOAL + 0.5)
    assert stroke.axes[:, 2] @ (GOAL + 0.5 - START) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("scale", ["axis", "distance"])
def test_an_original_trajectory_says_how_it_was_scaled(scale):
    (stroke,) = strokes_of(trajectory(wave(), model="original", forcing_scale=scale), "t")
    assert stroke.role == f"original {scale}"


def test_a_given_normal_turns_to_the_side_that_the_file_says():
    tilted = np.array([0.0, 0.1, -1.0])
    (stroke,) = strokes_of(trajectory(wave()), "t", normal=tilted)
    assert stroke.axes[2, 2] > 0.9
    assert stroke.axes[1, 2] < 0


def test_several_ids_are_several_strokes_in_order_of_appearance():
    both = np.vstack([wave(), wave(NEW_START, NEW_GOAL, 30.0)])
    known = {
        "b": {"start": START},
        "a": {"start": NEW_START, "goal": NEW_GOAL, "normal": [0, 0, 1]},
    }
    first, second = strokes_of(trajectory(both, ids=["b", "a"]), "t", pairs=known)
    assert (first.label, second.label) == ("t[b]", "t[a]")
    assert not first.intended
    assert second.intended
    assert first.wave.mean == pytest.approx(49.979, abs=1e-3)
    assert second.wave.mean == pytest.approx(30.0, abs=1e-3)


def test_a_run_is_what_the_arm_did_during_the_stroke():
    (stroke,) = strokes_of(run(trajectory(wave())), "r")
    assert len(stroke.t) == 501
    assert stroke.t[0] == 0.0
    assert stroke.role == "run"
    assert stroke.simulated
    assert np.linalg.norm(stroke.position[-1] - GOAL) > 1e-9


def test_a_closed_stroke_has_a_plane_but_no_wave():
    stroke = shown(demonstration(circle()))
    assert stroke.closed
    assert stroke.wave.mean is None
    (carried,) = strokes_of(trajectory(circle(), closed=True), "t")
    assert carried.wave.mean is None


def test_a_curved_surface_has_neither_plane_nor_wave():
    record = trajectory(wave())
    turning = np.linspace(0, 0.3, 501)
    record.columns.update(nx=np.sin(turning), ny=0 * turning, nz=np.cos(turning))
    del record.provenance.facts["normal"]
    (stroke,) = strokes_of(record, "t")
    assert stroke.axes is None
    assert stroke.wave.mean is None
    assert shown(demonstration()).carried_to(stroke) is None


def test_the_demonstration_carried_to_a_rigidly_moved_stroke_lies_on_it():
    R = rotations.exp(np.array([0.2, -0.1, 0.7]))
    path = wave() @ R.T + 50.0
    (stroke,) = strokes_of(trajectory(path, normal=R[:, 2].tolist()), "t")
    assert np.abs(shown(demonstration()).carried_to(stroke) - path).max() < 0.05


def test_short_backward_and_pairs_files_are_refused():
    with pytest.raises(InputError, match="4 samples"):
        strokes_of(trajectory(wave(n=4)), "t")
    record = trajectory(wave())
    record.columns["t"][7] = record.columns["t"][6]
    with pytest.raises(InputError, match="column 't', row 8"):
        strokes_of(record, "t")
    with pytest.raises(InputError, match="give the folder"):
        strokes_of(Record(schemas.PAIRS, {"id": np.array(["a"])}, Provenance("")), "p")


def test_pairs_tell_ends_normals_and_states():
    columns = {
        "id": np.array(["a", "b"], dtype=object),
        "status": np.array(["ok", "no"], dtype=object),
    }
    columns |= {f"{n}{e}": np.array([1.0, 2.0]) for n in "xyz" for e in "0g"}
    columns |= {n: np.array([float(n == "nz"), np.nan]) for n in ("nx", "ny", "nz")}
    known, states = pairs_of(Record(schemas.PAIRS, columns, Provenance("")))
    assert states == {"ok": 1, "no": 1}
    assert known["a"]["normal"].tolist() == [0, 0, 1]
    assert "normal" not in known["b"]
    assert known["b"]["goal"].tolist() == [2, 2, 2]


def test_labels_are_short_where_that_keeps_files_apart():
    assert labels_of(["a/demo.parquet", "b/run.parquet", "-"]) == ["demo", "run", "standard input"]
    assert labels_of(["a/x.parquet", "b/x.parquet"]) == ["a/x.parquet", "b/x.parquet"]
