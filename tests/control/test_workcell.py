import contextlib
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.control import workcell
from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments import registry, servo_adapter
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.simulation.mock import MockSensor, Plate, Scene
from dmpcli.spatial.rotations import from_euler


def lab(robot="mock:", sensor="mock:", scene=None):
    return workcell.connect(robot, sensor, SimulatedClock(), scene=scene).lab


def test_a_plain_mock_is_the_scene_that_was_asked_for():
    scene = Scene(position=np.array([1.0, 2.0, 3.0]), plate=Plate(point=np.zeros(3)), seed=4)
    made = lab(scene=scene).scene
    assert made.position.tolist() == [1.0, 2.0, 3.0]
    assert made.plate.point.tolist() == [0.0, 0.0, 0.0]
    assert made.seed == 4


def test_options_of_both_urls_arrange_the_one_lab():
    robot = "mock:?x=1&y=-2&z=3.5&rx=0.1&rz=0.3&lag=0.06&speed=400&estop_at=2&refuse_at=5"
    scene = lab(robot, "mock:?plate=-17.5&stiffness=7&friction=0.1&seed=9&silent_at=3").scene
    assert scene.position.tolist() == [1.0, -2.0, 3.5]
    np.testing.assert_allclose(scene.rotation, from_euler(np.array([0.1, 0.0, 0.3])))
    assert (scene.servo.lag, scene.servo.speed, scene.seed) == (0.06, 400.0, 9)
    assert (scene.plate.point[2], scene.plate.stiffness, scene.plate.friction) == (-17.5, 7, 0.1)
    faults = scene.faults
    assert (faults.estop_at, faults.silent_at, faults.refuse_at) == (2.0, 3.0, 5.0)


def test_there_need_not_be_a_plate():
    assert lab("mock:?plate=none", scene=Scene(plate=Plate(point=np.zeros(3)))).scene.plate is None


@pytest.mark.parametrize(
    ("url", "role", "words"),
    [
        ("mock", "robot", "elite://HOST"),
        ("serial:/dev/tty", "sensor", "netft://HOST"),
        ("netft://10.0.0.1", "robot", "no such instrument"),
        ("elite://10.0.0.1", "sensor", "no such instrument"),
        ("netft:", "sensor", "needs a host"),
        ("elite://", "robot", "needs a host"),
        ("elite://h:port", "robot", "Port could not be cast"),
        ("elite://h:70000", "robot", "out of range"),
        ("elite://h:0", "robot", "only a host"),
        ("elite://h/arm", "robot", "only a host"),
        ("elite://me@h", "robot", "only a host"),
        ("elite://[::1", "robot", "Invalid IPv6"),
        ("elite://h?x", "robot", "key=value"),
        ("elite://h?x=1&x=2", "robot", "x: is given twice"),
        ("mock://lab", "robot", "no host"),
        ("mock:?colour=red", "robot", "colour: the mock has no such option; it has x, y"),
        ("mock:?x", "robot", "key=value"),
        ("mock:?x=", "robot", "x = '': a finite number"),
        ("mock:?x=near", "robot", "x = 'near': a finite number"),
        ("mock:?x=nan", "robot", "finite"),
        ("mock:?x=1&x=2", "robot", "x: is given twice"),
        ("mock:?stiffness=0", "robot", "stiffness = 0: must be 1e-06 or more"),
        ("mock:?x=1e300", "robot", "x = 1e300: must lie within"),
        ("mock:?lag=11", "robot", "lag = 11: must lie within ±10"),
        ("mock:?lag=-1", "robot", "lag = -1: must not be negative"),
        ("mock:?seed=1.5", "sensor", "whole number"),
        ("mock:?stiffness=none", "robot", "finite number"),
    ],
)
def test_a_wrong_url_is_refused_with_what_would_do(url, role, words):
    with pytest.raises(InputError) as error:
        workcell.parse(url, role)
    assert words in str(error.value)
    assert f"--{role} {url}" in str(error.value)


@pytest.mark.slow
@given(st.text(max_size=30))
def test_any_text_is_an_address_or_an_input_error(text):
    for url in (text, "mock:?" + text, "elite://" + text):
        with contextlib.suppress(InputError):
            assert workcell.parse(url, "robot").role == "robot"


def test_a_real_instrument_beside_a_mock_one_needs_to_be_meant():
    with pytest.raises(InputError, match=r"beside a mock sensor.*--allow-mixed"):
        workcell.check("elite://10.0.0.1", "mock:")
    with pytest.raises(InputError, match=r"beside a mock robot.*--allow-mixed"):
        workcell.check("mock:", "netft://10.0.0.1")


class Driver:
    """A robot of a make that a test installs."""

    def __init__(self, address, clock):
        self.address, self.clock = address, clock


class Gauge(Driver):
    """A sensor of such a make."""

    def close(self):
        self.closed = True


@pytest.fixture
def installed(monkeypatch):
    """Register `Driver` and `Gauge` as the drivers of ``brand:`` URLs."""
    points = [
        EntryPoint("brand", f"{__name__}:Driver", "dmpcli.robots"),
        EntryPoint("brand", f"{__name__}:Gauge", "dmpcli.sensors"),
        EntryPoint("broken", "no_such_package:make", "dmpcli.robots"),
        EntryPoint("twice", f"{__name__}:Driver", "dmpcli.robots"),
        EntryPoint("twice", f"{__name__}:Gauge", "dmpcli.robots"),
    ]
    monkeypatch.setattr(metadata, "entry_points", lambda **only: EntryPoints(points).select(**only))


def test_drivers_are_found_by_their_entry_points(installed):
    bench = workcell.connect(
        "brand://arm.local:99?gain=2&name=a%20b", "brand://[fe80::1]", clock := SimulatedClock()
    )
    sensor = bench.sensor
    assert (sensor.address.host, sensor.address.port, sensor.clock) == ("fe80::1", None, clock)
    assert bench.lab is None
    assert not bench.simulated
    assert isinstance(bench.robot, servo_adapter.PoseServo)
    assert "no --tool FILE" in bench.note
    address = workcell.parse("brand://arm.local:99?gain=2&name=a%20b", "robot")
    assert (address.host, address.port) == ("arm.local", 99)
    assert address.options == {"gain": "2", "name": "a b"}
    assert str(address) == "--robot brand://arm.local:99"


def test_what_is_installed_is_looked_up_once_for_many_urls(installed, monkeypatch):
    looked, entry_points = [], metadata.entry_points
    monkeypatch.setattr(
        metadata, "entry_points", lambda **only: looked.append(only) or entry_points(**only)
    )
    for _ in range(3):
        workcell.connect("brand://h", "brand://h", SimulatedClock())
    assert looked == [{"group": "dmpcli.robots"}, {"group": "dmpcli.sensors"}]


def test_an_unknown_scheme_names_those_that_are_installed(installed):
    with pytest.raises(InputError, match="one of mock:, brand://HOST, broken://HOST, twice://HO"):
        workcell.check("elite://10.0.0.1")


@pytest.mark.parametrize(
    ("scheme", "words"), [("broken", "no_such_package"), ("twice", "both claim it")]
)
def test_a_driver_that_cannot_be_had_is_one_line(installed, scheme, words):
    with pytest.raises(InputError, match=words) as error:
        workcell.connect(f"{scheme}://h", None, SimulatedClock())
    assert "\n" not in str(error.value)


def test_the_makes_of_this_package_are_installed():
    assert {"elite", "ur"} <= set(registry.schemes("robot"))
    assert "netft" in registry.schemes("sensor")


def test_a_mock_one_beside_a_real_one_has_its_own_lab_in_which_nobody_draws(installed):
    bench = workcell.connect("brand://h", "mock:?seed=3", SimulatedClock(), allow_mixed=True)
    assert isinstance(bench.sensor, MockSensor)
    assert (bench.lab, bench.simulated) == (None, True)
    bench = workcell.connect("mock:?x=5", "brand://h", SimulatedClock(), allow_mixed=True)
    assert isinstance(bench.sensor, Gauge)
    assert bench.robot.state().position[0] == 5.0
    assert (bench.lab, bench.simulated) == (None, True)


def test_a_real_robot_needs_no_sensor(installed):
    assert len(workcell.check("brand://h", None)) == 1
    bench = workcell.connect("brand://h", None, SimulatedClock())
    bench.sensor.close()
    assert bench.sensor.poll() == []
    assert not bench.simulated
    with pytest.raises(InstrumentError, match="--sensor URL"):
        bench.sensor.open()


def test_two_urls_that_disagree_on_the_one_lab_are_refused():
    assert lab("mock:?seed=1", "mock:?seed=1").scene.seed == 1
    with pytest.raises(InputError, match="seed differs"):
        lab("mock:?seed=1", "mock:?seed=2")


def test_a_file_keeps_all_of_a_mocks_url_and_of_a_real_one_the_scheme_alone():
    assert workcell.in_provenance("mock:?plate=-17.5") == "mock:?plate=-17.5"
    assert workcell.in_provenance("netft://ft-7.plant.example/x") == "netft"
    assert workcell.in_provenance(None) is None


def test_one_real_instrument_makes_a_run_unrepeatable():
    mock, real = workcell.parse("mock:", "robot"), workcell.parse("netft://h", "sensor")
    assert workcell.repeatable([mock, workcell.parse("mock:", "sensor")])
    assert not workcell.repeatable([mock, real])


def test_a_real_sensor_needs_its_tool():
    real = workcell.parse("netft://h", "sensor")
    workcell.need_tool(real, given=True)
    workcell.need_tool(workcell.parse("mock:", "sensor"), given=False)
    with pytest.raises(InputError, match="--tool FILE"):
        workcell.need_tool(real, given=False)


def test_a_mixed_bench_is_simulated_in_part_and_keeps_no_step_with_a_clock(installed):
    mixed = workcell.connect("brand://h", "mock:", SimulatedClock(), allow_mixed=True)
    assert (mixed.simulated, mixed.lock_step) == (True, False)
    whole = workcell.connect("mock:", "mock:", SimulatedClock())
    assert (whole.simulated, whole.lock_step, whole.note) == (True, True, None)
    real = workcell.connect("brand://h", "brand://f", SimulatedClock())
    assert (real.simulated, real.lock_step) == (False, False)
