"""fit at the command line: what it says, writes and refuses."""

import json
from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.commands.running import invoke
from tests.dmp.strokes import paper_stroke

run = partial(invoke, "fit")


@pytest.fixture
def recording(tmp_path):
    import pandas as pd

    stroke = paper_stroke()
    frame = pd.DataFrame(np.column_stack([stroke.t, stroke.position]), columns=list("txyz"))
    frame.to_csv(tmp_path / "demo.csv", index=False)
    return tmp_path / "demo.csv"


def test_it_prints_reproduction_rms_and_wave_height(recording, tmp_path):
    done = run(recording, "-o", tmp_path / "s.json")
    assert done.exit_code == 0
    assert "reproduction RMS 0.0219" in done.stderr
    assert "wave height 49.979 mm demonstrated, 49.935 mm reproduced" in done.stderr
    assert done.stdout == ""


def test_quiet_says_nothing(recording, tmp_path):
    assert run(recording, "-o", tmp_path / "s.json", "-q").stderr == ""


def test_the_same_input_gives_the_same_bytes_and_no_path_or_time(recording, tmp_path):
    run(recording, "-o", tmp_path / "a.json")
    moved = recording.rename(tmp_path / "moved.csv")
    run(moved, "-o", tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert str(tmp_path) not in (tmp_path / "a.json").read_text()


def test_options_beat_the_preset_and_are_kept(recording, tmp_path):
    run(recording, "-o", tmp_path / "s.json", "--preset", "paper", "--basis", "33")
    document = json.loads((tmp_path / "s.json").read_text())
    assert document["basis"] == 33
    assert document["alpha_1"] == 1.7
    assert document["options"]["widths"] == "power"


def test_the_original_model_says_which_axes_go_without_the_factor(recording, tmp_path):
    done = run(recording, "-o", tmp_path / "s.json", "--model", "original")
    assert "g - x0 is nearly zero in z" in done.stderr


def test_other_recorders_are_read_by_layout(recording, tmp_path):
    import pandas as pd

    frame = pd.read_csv(recording)
    frame[["x", "y", "z"]] /= 1000.0
    frame.columns = ["timestamp", *(f"actual_TCP_pose_{i}" for i in range(3))]
    for i in range(3, 6):
        frame[f"actual_TCP_pose_{i}"] = [3.0, 0.1, 0.0][i - 3]
    frame.to_csv(tmp_path / "ur.csv", sep=" ", index=False)
    assert run(tmp_path / "ur.csv", "-o", tmp_path / "ur.json", "--layout", "ur").exit_code == 0
    a = json.loads((tmp_path / "ur.json").read_text())
    assert a["task_frame"]["start"][0] == pytest.approx(-551.03, abs=0.01)
    assert a["options"]["layout"]["length"] == "m"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--basis", "0"], "--basis = 0"),
        (["--damping", "nan"], "--damping = nan"),
        (["--tau", "-1"], "--tau = -1.0"),
        (["--cutoff", "0"], "--cutoff = 0.0"),
        (["--regression", "magic"], "--regression = 'magic'"),
        (["--model", "newest"], "--model = 'newest'"),
        (["--preset", "none"], "--preset none: no such preset"),
        (["--layout", "abacus"], "--layout abacus: no such layout; there are ur, tum"),
        (["--map", "x"], "--map x: must be OURS=THEIRS"),
        (["--map", "x=tool_x"], "column 'tool_x' is missing"),
        (["--config", "none.toml"], "none.toml: no such file"),
    ],
)
def test_wrong_options_are_refused_by_name_and_touch_nothing(recording, tmp_path, options, message):
    output = tmp_path / "s.json"
    output.write_text("old")
    done = run(recording, "-o", output, *options)
    assert done.exit_code == 2
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) <= 2
    assert output.read_text() == "old"


def test_outputs_and_inputs_that_cannot_be_are_refused(recording, tmp_path):
    for args, message in (
        ([recording, "-o", tmp_path / "no" / "s.json"], "does not exist"),
        ([recording, "-o", tmp_path], "is a directory"),
        ([tmp_path, "-o", tmp_path / "s.json"], "is a directory"),
        ([tmp_path / "none", "-o", tmp_path / "s.json"], "no such file"),
        (["-", "-", "-o", tmp_path / "s.json"], "standard input can be read only once"),
    ):
        done = run(*args)
        assert done.exit_code == 2
        assert message in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["demo.csv"]


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    row=st.integers(0, 60),
    column=st.integers(0, 3),
    cell=st.sampled_from(["nan", "inf", "-inf", "", "left", "1e999", "0x12", "1;2", "--"]),
)
def test_any_bad_cell_is_refused_with_its_line_and_column(tmp_path, row, column, cell):
    stroke = paper_stroke(61)
    rows = [[repr(float(v)) for v in line] for line in np.column_stack([stroke.t, stroke.position])]
    rows[row][column] = cell
    (tmp_path / "bad.csv").write_text("\n".join(["t,x,y,z", *(",".join(r) for r in rows)]))
    done = run(tmp_path / "bad.csv", "-o", tmp_path / "s.json")
    assert done.exit_code == 2
    assert f"bad.csv: column '{'txyz'[column]}', line {row + 2}" in done.stderr
    assert not (tmp_path / "s.json").exists()


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(order=st.permutations(range(12)))
def test_time_that_repeats_or_runs_backward_is_refused(tmp_path, order):
    stroke = paper_stroke(12)
    rows = np.column_stack([stroke.t[list(order)], stroke.position])
    lines = [",".join(repr(float(v)) for v in row) for row in rows]
    (tmp_path / "back.csv").write_text("\n".join(["t,x,y,z", *lines]))
    done = run(tmp_path / "back.csv", "-o", tmp_path / "s.json")
    ordered = list(order) == sorted(order)
    assert done.exit_code == (0 if ordered else 2)
    assert ordered or "time runs backward" in done.stderr


NUMBERS = ["--basis", "--damping", "--tau", "--alpha-1", "--cutoff"]


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(option=st.sampled_from(NUMBERS), value=st.floats() | st.integers(-(10**9), 10**9))
def test_any_number_fits_or_is_refused_in_a_line(recording, tmp_path, option, value):
    if option == "--basis":
        value = int(value) if abs(value) < 1e12 else 10**12
    done = run(recording, "-o", tmp_path / "s.json", option, value)
    assert done.exit_code in (0, 2)
    if done.exit_code == 2:
        assert f"{option} = " in done.stderr or "alpha_1 / tau" in done.stderr


@pytest.mark.sweep(kept=8)
@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        ["--basis", 1], ["--basis", 1000], ["--damping", 0.01], ["--damping", 1000],
        ["--cutoff", 0.01], ["--cutoff", 100000], ["--tau", 0.05], ["--tau", 100],
        ["--alpha-1", 0.01], ["--alpha-1", 10], ["--alpha-1", 0.1, "--tau", 0.01],
    ],
)  # fmt: skip
@pytest.mark.parametrize("regression", ["lwr", "ridge"])
def test_the_ends_of_every_range_fit_to_finite_weights(recording, tmp_path, options, regression):
    done = run(recording, "-o", tmp_path / "s.json", "--regression", regression, *options)
    assert done.exit_code == 0, done.stderr


@pytest.fixture
def pressed(tmp_path):
    """A stroke of 10 s drawn in contact, pressed from 3 to 8 N and back by a pen of 2 N/mm."""
    import pandas as pd

    stroke = paper_stroke()
    force = 3.0 + 5.0 * np.sin(np.pi * stroke.t / 10.0) ** 2
    frame = pd.DataFrame(np.column_stack([stroke.t, stroke.position]), columns=list("txyz"))
    frame["z"] -= force / 2.0
    frame["rx"], frame["ry"], frame["rz"] = np.pi, 0.0, 0.0
    for name in ("fx", "fy", "fz"):
        frame[f"{name} [N]"] = 0.0
    frame["fz [N]"] = force
    for name in ("tx", "ty", "tz"):
        frame[f"{name} [N·m]"] = 0.0
    frame.to_csv(tmp_path / "pressed.csv", index=False)
    return tmp_path / "pressed.csv", force


def test_a_force_profile_goes_from_the_recording_through_the_skill_into_the_trajectory(
    pressed, tmp_path
):
    import pandas as pd

    file, force = pressed
    skill, out = tmp_path / "s.json", tmp_path / "t.parquet"
    normal = ("--normal", 0, 0, 1)
    done = run(file, "-o", skill, "--force-profile", *normal)
    assert done.exit_code == 0, done.stderr
    assert "force along the normal 3.00 to 8.00 N" in done.stderr
    document = json.loads(skill.read_text())
    assert document["version"] == 3
    assert document["force_profile"]["start"] == pytest.approx(3.0, abs=0.01)
    ends = ("--start", 0, 0, 0, "--goal", 100, 0, 0)
    done = invoke("generalize", skill, "-o", out, *ends)
    assert done.exit_code == 0, done.stderr
    assert "fn is the force that was taught" in done.stderr
    fn = pd.read_parquet(out)["fn"]
    np.testing.assert_allclose(fn, force, atol=0.05)
    invoke("generalize", skill, "-o", out, *ends, "--force-setpoint", 4)
    assert set(pd.read_parquet(out)["fn"]) == {4.0}
    assert run(file, "-o", tmp_path / "plain.json", *normal).exit_code == 0
    plain = json.loads((tmp_path / "plain.json").read_text())
    assert plain["version"] == 2
    assert "force_profile" not in plain
    assert "force_profile" not in plain["options"]


@pytest.mark.parametrize("named", ["normal", "surface"])
def test_report_takes_the_pens_spring_off_a_recording_whose_force_was_taught(
    pressed, named, tmp_path
):
    file, _ = pressed
    plane = tmp_path / "plane.json"
    level = {"point": paper_stroke().position[0].tolist(), "normal": [0, 0, 1]}
    plane.write_text(json.dumps(level))
    where = ("--normal", 0, 0, 1) if named == "normal" else ("--surface", plane)
    skill, out = tmp_path / "s.json", tmp_path / "t.parquet"
    assert run(file, "-o", skill, "--force-profile", *where).exit_code == 0
    on = () if named == "normal" else where
    assert invoke("generalize", skill, "-o", out, "--reproduce", *on).exit_code == 0
    done = invoke("report", file, out, *on, "--json")
    assert done.exit_code == 0, done.stderr
    [recorded], [drawn] = (one["strokes"] for one in json.loads(done.stdout)["files"])
    assert drawn["deviation"]["nearest_max"] < 0.06  # 4 mm deep in its spring
    if on:
        assert drawn["surface"]["distance_max"] < 1e-6
    assert abs(recorded["wave"]["mean"] - drawn["wave"]["mean"]) < 0.05


def test_a_recording_without_a_wrench_teaches_no_force(recording, tmp_path):
    done = run(recording, "-o", tmp_path / "s.json", "--force-profile")
    assert done.exit_code != 0
    assert "--force-profile: holds no wrench in every row" in done.stderr
    assert not (tmp_path / "s.json").exists()
