"""Recordings of other programs at the command line: fit and report take the same options."""

import json

import numpy as np
import pytest

from tests.commands.running import invoke as run
from tests.records.foreign import QUATERNION, XYZ, R, T, table

METRES = XYZ / 1000
TUM = table("", T + 1.7e9, *METRES.T, *QUATERNION.T, sep=" ", digits=6)
UR = table(
    "timestamp " + " ".join(f"actual_TCP_pose_{i}" for i in range(6)),
    *(T, *METRES.T, *R.as_rotvec().T),
    sep=" ",
)
PLAIN = table("t,x,y,z", T, *XYZ.T)

READ = {
    "mocap.tum": (TUM, ["--layout", "tum"]),
    "ur.csv": (UR, ["--layout", "ur"]),
    "no_time.csv": (table("x,y,z", *XYZ.T), ["--sample-rate", "25"]),
    "no_header.csv": (table("", T, *METRES.T), ["--columns", "t,x,y,z", "--length-unit", "m"]),
    "comma.csv": (PLAIN.replace(",", ";").replace(".", ","), []),
    "comma_said.csv": (PLAIN.replace(",", ";").replace(".", ","), ["--decimal", ","]),
    "units.csv": (table("t [s],x [m],y [m],z [m]", T, *METRES.T), []),
    "ms.csv": (table("t,x,y,z", 1000 * T, *XYZ.T), ["--time-unit", "ms"]),
    "twice.csv": (
        table("t,x,y,z", np.r_[T[:9], T[8], T[9:]], *np.r_[XYZ[:9], XYZ[8:9], XYZ[9:]].T),
        ["--repeated-stamps", "first"],
    ),
    "rpy.csv": (
        table("t,x,y,z,rx,ry,rz", T, *XYZ.T, *R.as_euler("xyz").T),
        ["--rotation", "rpy"],
    ),
    "mapped.csv": (
        table("zeit,px,y,z", T, *XYZ.T),
        ["--map", "t=zeit", "--map", "x=px"],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
def test_fit_and_report_read_the_same_stroke_by_the_same_options(tmp_path, name):
    text, options = READ[name]
    path = tmp_path / name
    path.write_text(text)
    fitted = run("fit", path, "-o", tmp_path / "s.json", *options)
    assert fitted.exit_code == 0, fitted.stderr
    frame = json.loads((tmp_path / "s.json").read_text())["task_frame"]
    np.testing.assert_allclose(frame["start"], XYZ[0], atol=0.01)
    reported = run("report", path, "--json", *options)
    assert reported.exit_code == 0, reported.stderr
    (stroke,) = json.loads(reported.stdout)["files"][0]["strokes"]
    assert stroke["duration"] == pytest.approx(8.0, abs=1e-6)
    assert stroke["wave"]["mean"] == pytest.approx(48.0, abs=0.05)


def test_report_applies_the_options_to_recordings_of_other_programs_alone(tmp_path):
    (tmp_path / "mocap.tum").write_text(TUM)
    (tmp_path / "demo.csv").write_text(PLAIN)
    skill = tmp_path / "s.json"
    assert run("fit", tmp_path / "demo.csv", "-o", skill).exit_code == 0
    drawn = tmp_path / "stroke.parquet"
    made = run("generalize", skill, "-o", drawn, "--start", *XYZ[0], "--goal", *XYZ[-1])
    assert made.exit_code == 0, made.stderr
    done = run("report", tmp_path / "mocap.tum", drawn, skill, "--layout", "tum", "--json")
    assert done.exit_code == 0, done.stderr
    first, second, _ = json.loads(done.stdout)["files"]
    assert first["strokes"][0]["wave"]["mean"] == pytest.approx(48.0, abs=0.05)
    assert second["strokes"][0]["wave"]["mean"] == pytest.approx(48.0, abs=0.2)


def test_how_a_recording_was_read_is_told_and_hushed_but_doubts_are_not(tmp_path):
    path = tmp_path / "slow.csv"
    path.write_text(table("t,x,y,z,rx,ry,rz", 1000 * T, *XYZ.T, *R.as_euler("XYZ").T))
    told = run("fit", path, "-o", tmp_path / "s.json").stderr.splitlines()
    assert told[0].endswith(
        "rx, ry, rz read as X-Y-Z intrinsic Euler angles (assumed; --rotation says otherwise); "
        "the tool leans 0.0° from straight down at the start"
    )
    (doubt,) = run("fit", path, "-o", tmp_path / "s.json", "-q").stderr.splitlines()
    assert doubt.startswith("dmpcli: ")
    assert doubt.endswith("--time-unit ms")
    (same,) = run("report", path, "-q").stderr.splitlines()
    assert same == doubt


def test_a_stroke_of_a_tenth_of_a_millimetre_is_refused_by_both_naming_the_unit(tmp_path):
    path = tmp_path / "metres.csv"
    path.write_text(table("t,x,y,z", T, *METRES.T))
    for command in (("fit", path, "-o", tmp_path / "s.json"), ("report", path)):
        done = run(*command)
        assert done.exit_code == 2
        assert "is 0.12 mm large" in done.stderr
        assert "--length-unit m;" in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1


def test_inspect_names_the_option_that_reads_a_table(tmp_path):
    for name, text, told in (
        ("mocap.tum", TUM, "--layout tum"),
        ("ur.csv", UR, "--layout ur"),
        ("no_header.csv", table("", T, *XYZ.T), "--columns t,x,y,z"),
        ("no_time.csv", table("x,y,z", *XYZ.T), "--sample-rate HZ"),
        ("units.csv", table("t [s],x [m],y [m],z [m]", T, *METRES.T), "-o skill.json"),
        (
            "comma.csv",
            PLAIN.replace(",", ";").replace(".", ","),
            "commas between digits read as decimal signs",
        ),
    ):
        (tmp_path / name).write_text(text)
        done = run("inspect", tmp_path / name)
        assert done.exit_code == 0, name
        assert told in " ".join(done.stdout.split()), name


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--columns", "t,,x"], "--columns t,,x: must be names"),
        (["--columns", "t,x,x"], "--columns t,x,x: must be names"),
        (["--rotation", "up"], "--rotation up: must be one of euler, rpy"),
        (["--sample-rate", "-3"], "--sample-rate -3: must be a number of Hz"),
        (["--decimal", "x"], "--decimal x: must be one of ., ,"),
        (["--repeated-stamps", "last"], "--repeated-stamps last: must be one of"),
    ],
)
def test_wrong_options_are_refused_by_both(tmp_path, options, message):
    path = tmp_path / "a.csv"
    path.write_text(PLAIN)
    for command in (["fit", path, "-o", tmp_path / "s.json"], ["report", path]):
        done = run(*command, *options)
        assert done.exit_code == 2
        assert message in done.stderr
