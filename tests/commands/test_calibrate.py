"""calibrate at the command line, against the mock lab, whose truth is known."""

import json
import signal
import subprocess

import jsonschema
import numpy as np
import pytest

from dmpcli.records import json_schema, record, schemas, static_poses
from dmpcli.records import tool as tool_file
from dmpcli.records.file_io import Source, read
from dmpcli.simulation.mock import PEN
from tests.commands.running import ended as run
from tests.commands.terminal import DMPCLI, Terminal


def calibrate(*arguments, expect=0):
    return run("calibrate", *arguments, expect=expect)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """One calibration with its poses."""
    folder = tmp_path_factory.mktemp("calibration")
    said = calibrate("-o", folder / "tool.json", "--save", folder / "poses.parquet").stderr
    return folder, said


def assert_truth(tool):
    assert abs(tool.weight - PEN.weight) < 0.05
    assert np.linalg.norm(tool.centre - PEN.centre) < 1.0
    assert np.degrees(np.linalg.norm(tool.inclination)) < 0.3


@pytest.mark.slow
def test_the_mocks_truth_comes_back_within_the_bounds(lab, tmp_path):
    calibrate("-o", tmp_path / "tool.json", "--robot", "mock:?seed=1", "-q")
    for file in (tmp_path / "tool.json", lab[0] / "tool.json"):
        assert_truth(tool_file.decode(read(file)))


def test_it_says_what_it_found(lab):
    folder, said = lab
    for words in ("weight", "centre of mass", "inclination", "residual", "drift", "12 of 12 poses"):
        assert words in said
    assert str(folder) + "/tool.json: 12 of 12 poses used, condition numbers 3." in said


def test_the_file_obeys_its_schema_and_names_no_time_host_or_path(lab):
    folder, _ = lab
    text = (folder / "tool.json").read_text()
    document = json.loads(text)
    jsonschema.validate(document, json_schema.schema("tool"))
    assert str(folder) not in text
    assert document["calibration"]["sensor"]["make"] == "mock"
    assert document["calibration"]["poses"] == 12
    assert document["calibration"]["options"]["tilt"] == pytest.approx(np.pi / 4)
    assert tool_file.decode(Source("t", text.encode())).sensor == "mock"


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(lab, tmp_path):
    calibrate("-o", tmp_path / "tool.json", "--save", tmp_path / "poses.parquet", "-q")
    for name in ("tool.json", "poses.parquet"):
        assert (tmp_path / name).read_bytes() == (lab[0] / name).read_bytes()


def test_saved_poses_give_the_same_payload_again(lab, tmp_path):
    folder, _ = lab
    calibrate("-o", tmp_path / "again.json", "--from", folder / "poses.parquet")
    first, again = (
        json.loads(f.read_text()) for f in (folder / "tool.json", tmp_path / "again.json")
    )
    assert again["calibration"]["inputs"][0]["role"] == "poses"
    assert again["calibration"]["sensor"] == first["calibration"]["sensor"]
    assert again["payload"]["weight"] == pytest.approx(first["payload"]["weight"], abs=1e-9)
    for half in ("force", "torque"):
        zeros = again["payload"]["zero"][half], first["payload"]["zero"][half]
        np.testing.assert_allclose(*zeros, atol=1e-9)


def test_the_dash_is_standard_output(lab):
    result = calibrate("-o", "-", "--from", lab[0] / "poses.parquet", "-q")
    assert_truth(tool_file.decode(Source("stdin", result.stdout_bytes)))
    assert result.stderr == ""


def test_a_pose_that_was_touched_is_left_out_by_name(lab, tmp_path):
    source = read(lab[0] / "poses.parquet")
    taken, _ = static_poses.decode(source)
    taken[4].wrench[0] += 3.0
    kept = record.decode(source, schemas.POSES).provenance
    (tmp_path / "p.parquet").write_bytes(static_poses.encode(taken, kept))
    result = calibrate("-o", tmp_path / "t.json", "--from", tmp_path / "p.parquet")
    assert "pose 5 is left out: it contradicts the others by 3 N" in result.stderr
    tool = tool_file.decode(read(tmp_path / "t.json"))
    assert_truth(tool)
    assert json.loads((tmp_path / "t.json").read_text())["calibration"]["rejected"] == [5]


def expected_drift(tool):
    """What the drifted zero leaves of a pen that points straight down, base axes, N."""
    return np.diag([1.0, -1.0, -1.0]) @ (PEN.zero - tool_file.decode(read(tool)).zero)[:3]


@pytest.mark.slow
def test_record_and_execute_take_the_tool(lab, tmp_path):
    tool = lab[0] / "tool.json"
    run("record", "-o", tmp_path / "d.parquet", "--tool", tool, "--duration", 3, "-q")
    run("fit", tmp_path / "d.parquet", "-o", tmp_path / "s.json", "-q")
    ends = ["--start", -551, 131, -17, "--goal", -640, 131, -17]
    eased = ["--ease-in", 0.5, "--ease-out", 0.5, "--duration", 6]
    run("generalize", tmp_path / "s.json", "-o", tmp_path / "t.parquet", *ends, *eased, "-q")
    out = tmp_path / "r.parquet"
    run("execute", tmp_path / "t.parquet", "-o", out, "--sensor", "mock:", "--tool", tool, "-q")
    force = record.decode(read(out), schemas.RUN).stack(schemas.FORCE)
    # The file's zero is that of the calibration's end; each command opens a lab that drifts anew.
    assert np.linalg.norm(force.mean(axis=0)) < 0.2
    assert np.linalg.norm(force.mean(axis=0) - expected_drift(tool)) < 0.03


def other(lab, tmp_path, **payload):
    document = json.loads((lab[0] / "tool.json").read_text())
    document["payload"] |= payload
    file = tmp_path / "other.json"
    file.write_text(json.dumps(document))
    return file


def stroke(tmp_path):
    run("record", "-o", tmp_path / "d.parquet", "--duration", 3, "-q")
    run("fit", tmp_path / "d.parquet", "-o", tmp_path / "s.json", "-q")
    ends = ["--start", -551, 131, -17, "--goal", -640, 131, -17]
    eased = ["--ease-in", 0.5, "--ease-out", 0.5, "--duration", 6]
    run("generalize", tmp_path / "s.json", "-o", tmp_path / "t.parquet", *ends, *eased, "-q")
    return tmp_path / "t.parquet"


@pytest.mark.slow
@pytest.mark.parametrize("command", ["record", "execute"])
@pytest.mark.parametrize("weight", [2.0, 9.0])
def test_the_calibration_of_another_tool_is_refused_before_anything_moves(
    lab, tmp_path, command, weight
):
    file = other(lab, tmp_path, weight=weight)
    out = tmp_path / "out.parquet"
    arguments = ["-o", out, "--tool", file]
    if command == "execute":
        arguments = [stroke(tmp_path), *arguments, "--sensor", "mock:"]
    result = run(command, *arguments, expect=3)
    last = result.stderr.strip().splitlines()[-1]
    assert "N·m of the reading at rest, over 1.5 N" in last
    assert "calibrated for another tool (dmpcli calibrate)" in last
    assert not out.exists()


def test_a_tool_check_as_wide_as_the_difference_lets_it_pass(lab, tmp_path):
    file = other(lab, tmp_path, weight=8.0)
    arguments = ["-o", tmp_path / "out.parquet", "--tool", file, "--duration", 2]
    run("record", *arguments, expect=3)
    run("record", *arguments, "--tool-check", 3)


def test_a_pen_that_presses_at_the_start_is_refused_and_can_be_let_pass(lab, tmp_path):
    tool, out = lab[0] / "tool.json", tmp_path / "out.parquet"
    # The tip stands half a millimetre in the plate, which presses back with 2.5 N.
    robot = "mock:?plate=-17&z=-17.5"
    pressed = ["-o", out, "--tool", tool, "--robot", robot, "--duration", 2]
    result = run("record", *pressed, expect=3)
    assert "something touches this one (lift it clear" in result.stderr
    run("record", *pressed, "--tool-check", 4)


def test_the_calibration_of_another_sensor_is_refused(lab, tmp_path):
    document = json.loads((lab[0] / "tool.json").read_text())
    document["calibration"]["sensor"] = {"make": "ATI", "product": "Mini45", "serial": "FT1"}
    file = tmp_path / "other.json"
    file.write_text(json.dumps(document))
    result = run("record", "-o", tmp_path / "d.parquet", "--tool", file, expect=3)
    assert "calibrated with the sensor ATI Mini45 FT1, and mock is connected" in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--tilt", 8], 3, "condition number"),
        (["--poses", 2], 2, "--poses"),
        (["--tilt", 120], 2, "--tilt"),
        (["--by-hand"], 2, "--by-hand waits for Enter, and standard input is no terminal"),
        (["--from", "missing.parquet"], 2, "missing.parquet: no such file"),
        (["--from", "p.parquet", "--save", "q.parquet"], 2, "--from: reads poses"),
        (["--robot", "mock:?estop_at=10"], 3, "emergency stop"),
        (["--sensor", "mock:?silent_at=10"], 4, "silent"),
        (["--sensor", "mock:?silent_at=0"], 4, "sends nothing"),
        (["--workspace", 0, 1, 0, 1, 0, 1], 3, "leaves the workspace"),
        (["--tool", "missing.json"], 2, "missing.json: no such file"),
        (["--sensor", "netft://192.0.2.1"], 2, "beside a mock robot"),
    ],
)
def test_what_cannot_be_done_is_one_message_and_no_file(
    tmp_path, monkeypatch, options, code, words
):
    monkeypatch.chdir(tmp_path)
    result = calibrate("-o", "tool.json", *options, expect=code)
    assert words in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "tool.json").exists()


def test_a_robot_that_only_plays_whole_plans_is_refused_before_it_is_connected(tmp_path):
    result = calibrate(
        *("-o", tmp_path / "tool.json", "--robot", "elite://192.0.2.1?mode=file"),
        *("--allow-mixed", "--period", "0.02"),
        expect=2,
    )
    assert "mode=file only plays whole plans; leave it out" in result.output


def test_poses_taken_before_a_failure_are_kept(tmp_path):
    save = tmp_path / "poses.parquet"
    silent = ["--sensor", "mock:?silent_at=20"]
    calibrate("-o", tmp_path / "tool.json", "--save", save, *silent, expect=4)
    taken, _ = static_poses.decode(read(save))
    assert 2 <= len(taken) < 6


@pytest.mark.slow
@pytest.mark.parametrize("save", [True, False])
def test_poses_of_real_instruments_are_kept_though_nobody_asked(save, tmp_path, monkeypatch):
    from dmpcli.control import workcell
    from dmpcli.instruments import clock

    monkeypatch.setattr(workcell, "repeatable", lambda _: False)
    monkeypatch.setattr(clock, "MonotonicClock", clock.SimulatedClock)
    monkeypatch.setattr("dmpcli.control.watchdog.watched", lambda robot: robot)
    out, silent = tmp_path / "tool.json", ["--sensor", "mock:?silent_at=20"]
    asked = ["--save", tmp_path / "poses.parquet"] if save else []
    result = calibrate("-o", out, *asked, *silent, expect=4)
    kept = tmp_path / ("poses.parquet" if save else "tool.json.poses.parquet")
    assert 2 <= len(static_poses.decode(read(kept))[0]) < 6
    assert ("poses kept in" in result.stderr) is not save
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.slow
def test_by_hand_enter_takes_a_pose_and_one_orientation_is_not_enough(tmp_path):
    options = ["--by-hand", "--dwell", 0.2, "--save", "p.parquet"]
    with Terminal("calibrate", "-o", "tool.json", *options, cwd=tmp_path) as person:
        person.wait_for("Enter takes the pose, q and Enter ends")
        for number in (1, 2):
            person.type()
            person.wait_for(f"pose {number} taken")
        person.type("q")
        assert person.end() == 3
    assert "1 different orientation is not enough" in person.said
    assert len(static_poses.decode(read(tmp_path / "p.parquet"))[0]) == 2
    assert not (tmp_path / "tool.json").exists()


@pytest.mark.slow
def test_by_hand_a_refused_set_is_kept_though_nobody_asked(tmp_path):
    with Terminal("calibrate", "-o", "tool.json", "--by-hand", "--dwell", 0.2, cwd=tmp_path) as one:
        one.wait_for("Enter takes the pose, q and Enter ends")
        one.type()
        one.wait_for("pose 1 taken")
        one.type("q")
        assert one.end() == 3
    assert "1 pose kept in tool.json.poses.parquet: calibrate --from reads them" in one.said
    assert len(static_poses.decode(read(tmp_path / "tool.json.poses.parquet"))[0]) == 1


def interrupted(folder, patience):
    """Interrupt a calibration after so many seconds; return its exit code and what it said."""
    command = [DMPCLI, "calibrate", "-o", "tool.json", "--realtime"]
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)
    try:
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=patience)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60.0)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    return process.returncode, said


@pytest.mark.slow
def test_ctrl_c_decelerates_and_ends_with_its_exit_code(tmp_path):
    # A busy machine may still be importing after 3 s: then there is no motion to stop, nor a word.
    for patience in (3.0, 12.0, 40.0):
        code, said = interrupted(tmp_path, patience)
        assert code == 130
        if said:
            break
    assert "SIGINT" in said
    assert "Traceback" not in said
    assert not (tmp_path / "tool.json").exists()
