"""What a caller gives is read as it is meant, or refused by name: never silently something else."""

import copy
import dataclasses
import logging
import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dmpcli

T = np.linspace(0.0, 4.0, 201)
S = 10.0 * (T / 4.0) ** 3 - 15.0 * (T / 4.0) ** 4 + 6.0 * (T / 4.0) ** 5
P = np.column_stack([100.0 * S, 30.0 * np.sin(2.0 * np.pi * S), 0.0 * S])
NUMBER: Any = 3
TURN = Rotation.from_euler("XYZ", np.column_stack([np.full(201, np.pi), 0.0 * S, 0.5 * S]))
R = TURN.as_matrix()
HERE, THERE = (0.0, 0.0, 0.0), (120.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def skill():
    return dmpcli.fit(dmpcli.Demonstration(T, P, R))


@pytest.fixture(scope="module")
def drawn(skill):
    return dmpcli.generalize(skill, HERE, THERE)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"rotation": TURN.as_quat()}, r"\(201, 4\).*from_quat"),
        ({"rotation": TURN.as_euler("XYZ")}, r"\(201, 3\).*from_euler"),
        ({"rotation": R.reshape(201, 9)}, r"\(201, 9\).*reshape\(-1, 3, 3\)"),
        ({"rotation": R[:200]}, r"\(200, 3, 3\) is not \(201, 3, 3\)$"),
        ({"rotation": np.moveaxis(R, 0, -1)}, r"\(3, 3, 201\) is not"),
        ({"rotation": 1.1 * R}, r"rotation\[0\]: is no rotation matrix"),
        ({"rotation": -R}, r"rotation\[0\]: is no rotation matrix"),
        ({"rotation": np.where(np.arange(201)[:, None, None] == 7, 2.0 * R, R)}, r"rotation\[7\]"),
        ({"position": P.T}, r"\(201,\) and \(3, 201\)"),
        ({"position": P[:, :2]}, r"\(201,\) and \(201, 2\)"),
        ({"position": np.stack([P, P])}, r"\(2, 201, 3\)"),
        ({"position": P + 1j}, "position: holds complex128"),
        ({"position": P.astype(str)}, "position: holds <U"),
        ({"position": [*P[:-1].tolist(), [1.0, 2.0]]}, "position: .*rows differ in length"),
        ({"t": (1e9 * T).astype("datetime64[ns]")}, "t: holds datetime64"),
        ({"t": None}, "t: holds object"),
        ({"t": T[:, None]}, r"t and position: shapes \(201, 1\)"),
    ],
)
def test_arrays_that_are_no_stroke_are_refused_where_they_are_given(said, message):
    with pytest.raises(dmpcli.InputError, match=message):
        dmpcli.Demonstration(**{"t": T, "position": P} | said)


def test_what_is_masked_is_missing():
    hidden = np.ma.masked_array(P, mask=np.zeros_like(P, dtype=bool))
    hidden.mask[11, 0] = True
    with pytest.raises(dmpcli.InputError, match="column 'x', row 12: no value"):
        dmpcli.fit(dmpcli.Demonstration(T, hidden))


@pytest.mark.parametrize(
    "given",
    [
        (T.tolist(), P.tolist()),
        (T.astype(object), P.astype(object)),
        (np.asfortranarray(T), np.asfortranarray(P)),
        (T, np.ma.masked_array(P)),
    ],
    ids=["lists", "objects", "columns first", "masked nowhere"],
)
def test_numbers_in_any_dress_are_the_same_stroke(given):
    one, other = dmpcli.fit(dmpcli.Demonstration(*given)), dmpcli.fit(dmpcli.Demonstration(T, P))
    np.testing.assert_array_equal(one.weights, other.weights)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda _: dmpcli.fit("demo.csv"), "str is no Demonstration; `read` a file"),
        (lambda _: dmpcli.fit(one for one in P), "ndarray is no Demonstration"),
        (lambda _: dmpcli.fit([]), "at least one"),
        (lambda _: dmpcli.fit(dmpcli.Demonstration(T, P), regresion="ridge"), "mean regression"),
        (lambda _: dmpcli.fit(dmpcli.Demonstration(T, P), basis=-3), "auto or 1 to 2000"),
        (lambda one: dmpcli.fit(one), "no Demonstration; .*position, rotation"),
        (lambda _: dmpcli.generalize("skill.json", HERE, THERE), "str is no skill"),
        (lambda one: dmpcli.generalize(one, HERE, THERE), "is no skill"),
        (lambda _: dmpcli.wave_heights(P), "ndarray is no trajectory"),
        (lambda _: dmpcli.execute(NUMBER), "int is no trajectory"),
        (lambda _: dmpcli.report([1]), "list is no demonstration"),
        (lambda _: dmpcli.read("t.parquet", sep=";"), "sep: no such option"),
        (lambda _: dmpcli.read("sample_runs/bench.stl"), "is a mesh; `read_surface`"),
    ],
)
def test_what_is_another_thing_is_told_as_that(drawn, call, message):
    with pytest.raises(dmpcli.InputError, match=message):
        call(drawn)


def test_of_a_skill_only_points_and_surfaces_are_drawn_on(skill):
    for said, message in (
        ({"goal": "120,0,0"}, "goal: holds <U"),
        ({"goal": (1.0, 2.0)}, r"shape \(2,\)"),
        ({"surface": "part.stl"}, "part.stl is a name; `read_surface`"),
        ({"orientaton": "keep"}, "orientaton: no such option; did you mean orientation"),
        ({"start_rotation": -np.eye(3)}, "start_rotation: is no rotation matrix"),
    ):
        with pytest.raises(dmpcli.InputError, match=message):
            dmpcli.generalize(skill, **{"start": HERE, "goal": THERE} | said)


def test_of_many_pairs_each_has_its_own_status_and_one_point_stands_for_all(skill, drawn):
    goals = np.array([THERE, (np.nan, 0.0, 0.0), (0.0, 1e9, 0.0), (0.0, 90.0, 0.0)])
    many = dmpcli.generalize(skill, HERE, goals)
    assert many.status[0] == many.status[3] == "ok"
    assert many.status[1] == "goal[1]: nan is not a finite number"
    assert many.status[2].startswith("goal[2]: 1e+09 is beyond")
    assert list(many.length > 0) == [True, False, False, True]
    np.testing.assert_array_equal(many[0].position, drawn.position)


def test_a_file_is_never_written_under_the_suffix_of_another_kind(skill, drawn, tmp_path):
    for value, name in ((drawn, "t.docx"), (drawn, "t.json"), (skill, "s.parquet")):
        with pytest.raises(dmpcli.InputError, match="is not its suffix"):
            dmpcli.write(value, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_recording_of_another_program_is_written_as_one_of_ours(tmp_path):
    rows = [f"{t:.4f},{x:.6f},{y:.6f},{z:.6f}" for t, (x, y, z) in zip(T, P / 1e3, strict=True)]
    text = "\n".join(["t,x,y,z", *rows])
    (tmp_path / "theirs.csv").write_text(text)
    read = dmpcli.read(tmp_path / "theirs.csv", length_unit="m")
    dmpcli.write(read, tmp_path / "ours.parquet")
    again = dmpcli.read(tmp_path / "ours.parquet")
    np.testing.assert_array_equal(again.position, read.position)
    assert dmpcli.inspect(tmp_path / "ours.parquet")["schema"].startswith("demonstration")


def test_values_go_to_other_processes_and_threads_as_they_are(skill, drawn):
    for other in (pickle.loads(pickle.dumps(skill)), copy.deepcopy(skill)):
        np.testing.assert_array_equal(
            dmpcli.generalize(other, HERE, THERE).position, drawn.position
        )
    with ThreadPoolExecutor(4) as threads:
        for one in threads.map(lambda _: dmpcli.generalize(skill, HERE, THERE), range(8)):
            np.testing.assert_array_equal(one.position, drawn.position)


def test_what_a_caller_gives_and_gets_is_the_callers_own(skill, drawn):
    t, position = T.copy(), P.copy()
    dmpcli.fit(dmpcli.Demonstration(t, position))
    np.testing.assert_array_equal(t, T)
    np.testing.assert_array_equal(position, P)
    one = dmpcli.generalize(skill, HERE, THERE)
    one.position[:] = 0.0
    np.testing.assert_array_equal(dmpcli.generalize(skill, HERE, THERE).position, drawn.position)


def test_the_callers_logging_is_not_touched():
    root = logging.getLogger()
    before = root.handlers[:], root.level, logging.root.manager.disable
    dmpcli.fit(dmpcli.Demonstration(T, P))
    assert (root.handlers[:], root.level, logging.root.manager.disable) == before
    assert not [one for one in logging.getLogger("dmpcli").handlers if one.level == 0 and one.name]


@pytest.mark.parametrize("change", ["in place", "a copy"])
def test_arrays_that_were_changed_are_what_is_learned_written_and_drawn(change, tmp_path, skill):
    def shifted(one):
        if change == "a copy":
            return dataclasses.replace(one, position=one.position + [0.0, 0.0, 5.0])
        one.position[:] += [0.0, 0.0, 5.0]
        return one

    dmpcli.write(dmpcli.Demonstration(T, P), tmp_path / "demo.parquet")
    read = shifted(dmpcli.read(tmp_path / "demo.parquet"))
    dmpcli.write(read, tmp_path / "moved.parquet")
    np.testing.assert_allclose(dmpcli.read(tmp_path / "moved.parquet").position, P + [0, 0, 5.0])
    assert dmpcli.fit(read).sha256 != dmpcli.fit(dmpcli.Demonstration(T, P)).sha256
    drawn = shifted(dmpcli.generalize(skill, HERE, THERE))
    dmpcli.write(drawn, tmp_path / "drawn.parquet")
    again = dmpcli.read(tmp_path / "drawn.parquet")
    assert again.position[0] == pytest.approx([0.0, 0.0, 5.0], abs=1e-9)
    [plan] = dmpcli.execute(drawn, dry_run=True, approach=20.0)
    assert plan.plan.position[plan.plan.last][2] == pytest.approx(5.0, abs=1e-6)


def test_a_batch_is_taken_as_it_was_drawn_or_refused(skill, tmp_path):
    many = dmpcli.generalize(skill, HERE, np.array([THERE, (0.0, 90.0, 0.0)]))
    with pytest.raises(ValueError, match="read-only"):
        many.position[0] += 5.0
    moved = dataclasses.replace(many, position=many.position + 5.0)
    for take in (lambda: dmpcli.write(moved, tmp_path / "b"), lambda: dmpcli.report(moved)):
        with pytest.raises(dmpcli.InputError, match="arrays were changed"):
            take()
    assert not (tmp_path / "b").exists()
    np.testing.assert_allclose(moved[0].position, many[0].position + 5.0)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_of_a_batch_is_taken_as_it_was_drawn_and_cannot_be_edited(skill, tmp_path, copied):
    many = copied(dmpcli.generalize(skill, HERE, np.array([THERE, (0.0, 90.0, 0.0)])))
    with pytest.raises(ValueError, match="read-only"):
        many.position[0] += 5.0
    dmpcli.write(many, tmp_path / "b")
    again = dmpcli.read(tmp_path / "b")
    np.testing.assert_allclose(again[1].position, many[1].position)


@pytest.mark.parametrize("name", ["t", "position"])
def test_a_batch_of_which_any_array_is_another_is_refused(skill, name):
    many = dmpcli.generalize(skill, HERE, np.array([THERE, (0.0, 90.0, 0.0)]))
    with pytest.raises(dmpcli.InputError, match="arrays were changed"):
        dmpcli.report(dataclasses.replace(many, **{name: getattr(many, name) + 1.0}))
