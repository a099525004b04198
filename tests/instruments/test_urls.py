import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.instruments import urls
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.mock import Plate, Scene
from dmpcli.rotations import from_euler


def lab(robot="mock:", sensor="mock:", scene=None):
    return urls.connect(robot, sensor, SimulatedClock(), scene=scene).lab


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
        urls.parse(url, role)
    assert words in str(error.value)
    assert f"--{role} {url}" in str(error.value)


@given(st.text(max_size=30))
def test_any_text_is_an_address_or_an_input_error(text):
    for url in (text, "mock:?" + text):
        with contextlib.suppress(InputError):
            assert urls.parse(url, "robot").role == "robot"


def test_a_real_instrument_beside_a_mock_one_needs_to_be_meant():
    with pytest.raises(InputError, match=r"beside a mock sensor.*--allow-mixed"):
        urls.check("elite://10.0.0.1", "mock:")
    with pytest.raises(InputError, match=r"beside a mock robot.*--allow-mixed"):
        urls.check("mock:", "netft://10.0.0.1")


@pytest.mark.parametrize(
    ("robot", "sensor", "mixed"),
    [
        ("elite://10.0.0.1", "netft://10.0.0.2", False),
        ("ur://10.0.0.1", "mock:", True),
        ("mock:", "netft://10.0.0.2", True),
    ],
)
def test_real_instruments_are_refused_in_one_line(robot, sensor, mixed):
    with pytest.raises(InputError, match=r"speaks mock: only") as error:
        urls.check(robot, sensor, mixed)
    assert "\n" not in str(error.value)


def test_two_urls_that_disagree_on_the_one_lab_are_refused():
    assert lab("mock:?seed=1", "mock:?seed=1").scene.seed == 1
    with pytest.raises(InputError, match="seed differs"):
        lab("mock:?seed=1", "mock:?seed=2")


def test_a_file_keeps_all_of_a_mocks_url_and_of_a_real_one_the_scheme_alone():
    assert urls.in_provenance("mock:?plate=-17.5") == "mock:?plate=-17.5"
    assert urls.in_provenance("netft://ft-7.plant.example/x") == "netft"
    assert urls.in_provenance(None) is None


def test_one_real_instrument_makes_a_run_unrepeatable():
    mock, real = urls.parse("mock:", "robot"), urls.parse("netft://h", "sensor")
    assert urls.repeatable([mock, urls.parse("mock:", "sensor")])
    assert not urls.repeatable([mock, real])


def test_a_real_sensor_needs_its_tool():
    real = urls.parse("netft://h", "sensor")
    urls.need_tool(real, given=True)
    urls.need_tool(urls.parse("mock:", "sensor"), given=False)
    with pytest.raises(InputError, match="--tool FILE"):
        urls.need_tool(real, given=False)
