"""``bench://``: behind the protocols of real instruments, in lock-step, by the command line."""

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from dmpcli.bench import driver, options
from dmpcli.bench.workpiece import Flat, HeightField, Nothing, Round, Traced
from dmpcli.cli import app
from dmpcli.control import workcell
from dmpcli.errors import InputError
from dmpcli.extras import BENCH
from dmpcli.instruments import registry, servo_adapter
from dmpcli.instruments.address import split
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.records import file_io, record, schemas
from dmpcli.records import tool as tool_file
from dmpcli.records.record import Provenance, Record
from tests.bench.descriptions import mjcf
from tests.extras_here import needs
from tests.instruments.instrument_conformance import check_sensor, check_servo

pytestmark = needs(BENCH)

TOOL = "sample_runs/bench_pen.json"
START = (-551.03, 131.399, -17.56)


def instruments(robot="bench://ec66", sensor="bench://ec66", clock=None):
    clock = clock or SimulatedClock()
    arm = driver.robot(split(robot, "robot"), clock)
    return arm, driver.sensor(split(sensor, "sensor"), clock), clock


@pytest.mark.slow
def test_robot_and_sensor_keep_the_protocols():
    tool = tool_file.decode(file_io.read(TOOL))
    for arm in ("ec66", "ur5e"):
        robot, sensor, clock = instruments(f"bench://{arm}?surface=none", f"bench://{arm}")
        servo = servo_adapter.servo(robot, clock, tool)

        def wait(duration, clock=clock):
            clock.sleep_until(clock.now() + duration)

        check_servo(servo, clock, wait)
        check_sensor(sensor, clock, wait)


def test_both_share_one_bench_of_one_clock():
    robot, sensor, clock = instruments("bench://ec66?noise=0&z=10", "bench://ec66?at_z=10")
    robot.connect()
    sensor.open()
    sensor.start(100.0)
    robot.start(0.02)
    joints = robot.state().joints
    bench = driver._BENCHES[clock]
    down = bench.world.joints_of(
        type(bench.world.pose)(bench.world.pose.position - [0, 0, 2.0], bench.world.pose.rotation),
        joints,
    )
    robot.send(down)
    clock.sleep_until(1.0)
    samples = sensor.poll()
    assert [sample.seq for sample in samples] == list(range(1, 101))
    np.testing.assert_allclose([sample.t for sample in samples], 0.01 * np.arange(1, 101))
    # The tool's weight; the pen, which points down, is pushed against the sensor's z.
    assert samples[-1].wrench[2] - 6.0 == pytest.approx(-2.0 * 2.0, rel=0.06)
    assert driver.robot(split("bench://ec66", "robot"), SimulatedClock())._bench is not bench


def test_a_reading_arrives_later_by_the_latency():
    _, sensor, clock = instruments("bench://ec66?latency=0.03")
    sensor.open()
    sensor.start(100.0)
    clock.sleep_until(0.045)
    assert [sample.t for sample in sensor.poll()] == pytest.approx([0.04])


def test_the_registry_knows_it_as_one_that_keeps_to_simulated_time():
    for role in ("robot", "sensor"):
        assert registry.lock_step(split("bench://ec66", role))
    cell = workcell.connect("bench://ec66?seed=2", "bench://ec66", SimulatedClock())
    assert (cell.simulated, cell.lock_step) == (True, True)


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("bench://ec12", "no such arm; it is one of bench://ec66, bench://ur5e"),
        ("bench://ec66?stiffness=0", "stiffness = '0': a number from 0.01 to 1000 N/mm"),
        ("bench://ec66?stifness=2", "stifness: there is no such option; bench has x, y"),
        ("bench://ec66?surface=bowl", "one of plane, cylinder, edge"),
        ("bench://ec66?surface=bowl.stl", "bowl.stl"),
        ("bench://ec66?nx=0&nz=0", "the normal has no length"),
        ("bench://ec66?surface=sample_runs/saddle.stl&collide=sdf", "needs a closed mesh"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_made(url, said):
    with pytest.raises(InputError, match=said.replace("?", r"\?")):
        driver.robot(split(url, "robot"), SimulatedClock())


def test_what_both_urls_say_must_agree():
    with pytest.raises(InputError, match="stiffness differs between --robot and --sensor"):
        instruments("bench://ec66?stiffness=2", "bench://ec66?stiffness=3")
    with pytest.raises(InputError, match="the other instrument is on bench://ec66"):
        instruments("bench://ec66", "bench://ur5e")


def test_the_surface_is_displaced_and_tilted_about_the_point_that_is_named():
    read = options.parameters(
        "ec66", {"at_x": "-600", "at_y": "100", "at_z": "-20", "offset": "2", "tilt": "3"}
    )
    pose = read.workpiece.pose
    np.testing.assert_allclose(pose.position, [-600.0, 100.0, -18.0])
    turn = np.radians(3.0)
    np.testing.assert_allclose(pose.rotation[:, 2], [0.0, -np.sin(turn), np.cos(turn)], atol=1e-12)


def test_surfaces_by_name_and_by_file():
    kinds = {
        "plane": Flat,
        "cylinder": Round,
        "none": Nothing,
        "sample_runs/saddle.stl": Traced,
    }
    for name, kind in kinds.items():
        assert type(options.parameters("ec66", {"surface": name}).workpiece) is kind
    field = options.parameters(
        "ec66",
        {
            "surface": "sample_runs/saddle.stl",
            "collide": "hfield",
            **dict(zip(("at_x", "at_y", "at_z"), ("-600", "0", "0"), strict=True)),
            "grid": "20",
        },
    ).workpiece
    assert isinstance(field, HeightField)


@pytest.fixture
def stroke(tmp_path):
    u = np.linspace(0.0, 1.0, 101)
    u = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    columns = {
        "id": np.full(len(u), "0", dtype=object),
        "t": 0.02 * np.arange(len(u)),
        "x": START[0] - 20.0 * u,
        "y": START[1] + 0.0 * u,
        "z": START[2] + 0.0 * u,
        "rx": np.pi + 0.0 * u,
        "ry": 0.0 * u,
        "rz": 0.0 * u,
    }
    provenance = Provenance("generalize", {}, (), {"tau": 1.0, "normal": [0.0, 0.0, 1.0]})
    path = tmp_path / "stroke.parquet"
    path.write_bytes(record.encode(Record(schemas.TRAJECTORY, columns, provenance)))
    return path


def execute(*arguments, expect=0):
    result = CliRunner().invoke(app, ["execute", *map(str, arguments)])
    assert result.exit_code == expect, (result.exit_code, result.stderr, result.exception)
    return result.stderr


@pytest.mark.slow
def test_execute_draws_on_it_and_keeps_what_truly_happened(stroke, tmp_path):
    contents, truths = [], []
    for name in ("one", "two"):
        out, truth = tmp_path / f"{name}.parquet", tmp_path / f"{name}-truth.parquet"
        robot = f"bench://ec66?seed=7&offset=2.5&truth={truth}"
        execute(stroke, "-o", out, "--robot", robot, "--sensor", "bench://ec66", "--tool", TOOL)
        contents.append(pq.read_table(out))
        truths.append(truth.read_bytes())
    assert contents[0].equals(contents[1])
    assert truths[0] == truths[1]
    kept = record.decode(file_io.read(str(out)), schemas.RUN)
    assert kept.provenance.facts["simulated"]
    true = {
        name: column.to_numpy()
        for name, column in zip(
            pq.read_table(truth).column_names, pq.read_table(truth).columns, strict=True
        )
    }
    # It stands 2.5 mm deep from the first; the pen pushes with what its spring and the arm make.
    assert true["push"][-1] == pytest.approx(2.5 * 1.9, rel=0.02)
    assert true["setpoint"][-1] == pytest.approx(len(kept.t), abs=1)
    felt = kept.columns["fz"][20:-1]
    cycle = np.searchsorted(true["setpoint"], np.arange(21, len(kept.t)))
    # Noise of 0.05 N, averaged over two readings a cycle; the tool's zero is taken in contact.
    assert np.std(felt - true["fz"][cycle]) < 0.1


def test_a_tool_file_that_is_not_the_benchs_tool_is_refused(stroke, tmp_path):
    said = execute(
        stroke,
        "-o",
        tmp_path / "run.parquet",
        "--robot",
        "bench://ec66",
        "--tool",
        "tests/bench/short_pen.json",
        expect=3,
    )
    assert "mm" in said
    assert not (tmp_path / "run.parquet").exists()


@pytest.mark.thorough
def test_a_slow_stroke_over_a_step_on_a_described_arm_finds_the_surface_again(stroke, tmp_path):
    """The ball rolls down the edge, which pushes it on by twice what friction may be."""
    arm, truth, out = tmp_path / "arm.xml", tmp_path / "truth.parquet", tmp_path / "run.parquet"
    arm.write_text(mjcf(d4=0.134))
    robot = (
        f"bench://ur5e?model={arm}&z={START[2] + 12.0}&at_z={START[2]}&truth={truth}"
        "&surface=step&along=240&far=3"
    )
    said = execute(
        stroke, "-o", out, "--robot", robot, "--sensor", "bench://ur5e", "--tool", TOOL,
        "--coupling", "force", "--force-setpoint", 5, "--approach", 20,
    )  # fmt: skip
    assert "bench: ur5e with d4 134 instead of 133.3 mm" in said
    kept = record.decode(file_io.read(str(out)), schemas.RUN)
    push, cycle = (pq.read_table(truth)[name].to_numpy() for name in ("push", "setpoint"))
    drawn = np.flatnonzero(np.asarray(kept.columns["phase"]) == "stroke")
    last = push[(cycle > drawn[-1] - 25) & (cycle <= drawn[-1])]
    assert last.min() > 4.0
    assert last.max() < 6.0
    tip = pq.read_table(truth)["z"].to_numpy()[cycle == drawn[-1]]
    assert tip.max() < START[2] - 2.5  # on the lower side
