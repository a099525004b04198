from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dmpcli.control.drag_loop import Recorder
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.metrics.motion import log_dimensionless_jerk, spectral_arc_length
from dmpcli.metrics.wave_height import stroke_wave
from dmpcli.settings import record as record_settings
from dmpcli.simulation.mock import PEN, Lab, MockSensor, MockServo, Plate, Scene
from tests.control.drag_fakes import drag_settings, positions, rehearse

# The zero takes 0.5 s; then the hand sets the pen down within 1 s.
BEGAN = 1.5
START, GOAL = np.array([-551.030, 131.399, -17.560]), np.array([-660.021, 130.034, -17.538])


def deviation(stroke, p):
    """Distances to the nearest point of the reference stroke, mm."""
    return cKDTree(stroke.at(np.linspace(0.0, 10.0, 20001), 10.0)).query(p)[0]


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_the_papers_stroke_is_drawn_at_its_wave_height(seed):
    stroke, recorder, ending = rehearse(seed=seed)
    t, p = positions(recorder)
    assert ending.reason == "duration"
    assert t[-1] == 10.8
    (height,) = stroke_wave(p, START, GOAL, stroke.normal).heights
    assert abs(height - 49.979) < 0.3
    (own,) = stroke_wave(p, p[0], p[-1], stroke.normal).heights
    assert abs(own - 49.979) < 0.3
    assert np.linalg.norm(p[0] - START) < 0.2
    assert np.linalg.norm(p[-1] - GOAL) < 0.2
    assert np.linalg.norm(p[t < 0.3] - p[0], axis=1).max() < 0.1
    assert np.linalg.norm(p[t > 10.5] - p[-1], axis=1).max() < 0.1
    # All the time the pen is in contact, pressed by about 2 N into 5 N/mm.
    surface = START + 2.0 / 5.0 * stroke.normal
    depth = (surface - p) @ stroke.normal
    np.testing.assert_allclose(5.0 * depth, 2.0, atol=0.5)


def test_the_same_seed_draws_the_same_and_another_another():
    one, same, other = (positions(rehearse(seed=s, duration=3.0)[1])[1] for s in (5, 5, 6))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 1e-3


def rougher(measure, t, one, other):
    values = measure(t, np.stack([one, other]).transpose(2, 0, 1))
    return values[0] < values[1] - 0.5


@pytest.mark.thorough
def test_the_built_in_drag_is_further_off_and_rougher_for_the_same_hand():
    for seed in range(3):
        stroke, ours, _ = rehearse(seed=seed)
        _, theirs, _ = rehearse(seed=seed, drag="builtin")
        t, p = positions(ours)
        _, q = positions(theirs)
        off, far_off = deviation(stroke, p), deviation(stroke, q)
        assert np.sqrt(np.mean(far_off**2)) > 5.0 * np.sqrt(np.mean(off**2))
        assert far_off.max() > 3.0
        assert rougher(spectral_arc_length, t, q, p)
        assert rougher(log_dimensionless_jerk, t, q, p)
        # It sticks on the way: an axis stands still while the hand goes on pulling.
        middle = (t > 3.0) & (t < 8.0)
        assert (np.diff(q[middle, 0]) == 0.0).sum() > 20
        assert (np.diff(p[middle, 0]) == 0.0).sum() == 0
        assert "x_ref" not in theirs.log.columns()


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["line", "circle"])
def test_other_strokes_are_followed_too(shape):
    stroke, recorder, _ = rehearse(reference=shape, seed=1)
    _, p = positions(recorder)
    assert deviation(stroke, p).max() < 1.0


def test_the_duration_holds_the_stroke_and_its_rests():
    _, recorder, _ = rehearse(duration=6.0)
    t, p = positions(recorder)
    assert t[-1] == 6.0
    assert np.linalg.norm(p[-1] - GOAL) < 0.5


@pytest.mark.slow
def test_until_rest_ends_after_the_stroke():
    _, recorder, ending = rehearse(until_rest=0.8)
    _, p = positions(recorder)
    assert ending.reason == "rest"
    assert np.linalg.norm(p[-1] - GOAL) < 0.5
    assert 10.0 < recorder.log.duration < 12.0


def test_a_silent_sensor_and_an_emergency_stop_keep_what_was_recorded():
    _, recorder, ending = rehearse(sensor="mock:?silent_at=3")
    assert isinstance(ending.failure, InstrumentError)
    assert recorder.log.duration == pytest.approx(3.0 - BEGAN + 0.1, abs=0.05)
    _, recorder, ending = rehearse(robot="mock:?estop_at=3")
    assert isinstance(ending.failure, RefusedError)
    assert recorder.log.duration == pytest.approx(3.0 - BEGAN, abs=0.05)


def test_a_pen_far_from_the_stroke_is_not_tugged_there():
    with pytest.raises(InputError, match=r"stands 5.* mm from the start"):
        rehearse(robot="mock:?x=-500")


def test_the_built_in_drag_stays_in_the_workspace_too():
    box = (-600.0, -500.0, 0.0, 300.0, -100.0, 100.0)
    _, recorder, ending = rehearse(drag="builtin", workspace=box)
    assert isinstance(ending.failure, RefusedError)
    assert "the tool at x" in ending.reason
    assert positions(recorder)[1][:, 0].min() >= -600.0


class Press:
    """A hand that presses the pen into the plate with one force, from the beginning on."""

    def __init__(self, force):
        self.force = force
        self.began = np.inf

    def begin(self, t):
        self.began = t

    def wrench(self, t, position, rotation, velocity):
        force = -self.force if t > self.began else 0.0
        return np.array([0.0, 0.0, force, 0.0, 0.0, 0.0])


def pressed(noticed=True, **options):
    """Depth over time, mm, of a pen pressed with 10 N on a plate of 5 N/mm for 8 s.

    With `noticed`, a drag that chatters is made heavier.
    """
    clock = SimulatedClock()
    lab = Lab(clock, Scene(position=np.zeros(3), plate=Plate(point=np.zeros(3), stiffness=5.0)))
    lab.hand = hand = Press(10.0)
    recorder = Recorder(
        MockServo(lab),
        MockSensor(lab),
        clock,
        PEN.with_zero(None),
        drag_settings(**options),
        8.0,
        begin=hand.begin,
    )
    if not noticed:
        recorder.chatter.feel = lambda *_: False
    recorder.run()
    return -recorder.log.columns()["z"]


def test_the_default_drag_is_stable_on_a_plate_behind_the_servos_lag():
    depth = pressed()
    assert 5.0 * depth.max() < 1.2 * 10.0
    late = depth[-100:]
    # At rest within the dead-band of 1 N.
    assert np.ptp(late) < 0.01
    assert abs(5.0 * late.mean() - 10.0) < 1.1


def test_a_much_lighter_damping_along_the_normal_hammers_on_the_plate_until_it_is_noticed():
    light = (0.08, 0.08, 0.1, 3.0, 3.0, 3.0)
    depth = pressed(noticed=False, damping=light)
    assert np.ptp(depth[-100:]) > 5.0
    assert depth[-100:].min() < 0.0  # it leaves the plate again and again
    assert np.ptp(pressed(damping=light)[-100:]) < 0.1


@pytest.mark.slow
def test_a_tool_let_go_stays_where_it_is_in_spite_of_noise_and_drift():
    clock = SimulatedClock()
    lab = Lab(clock, Scene(position=np.zeros(3)))
    recorder = Recorder(
        MockServo(lab), MockSensor(lab), clock, PEN.with_zero(None), drag_settings(), 20.0
    )
    recorder.run()
    np.testing.assert_array_equal(positions(recorder)[1], 0.0)


def test_a_wrong_weight_in_the_tool_file_makes_the_tool_sink():
    clock = SimulatedClock()
    lab = Lab(clock, Scene(position=np.zeros(3)))
    heavy = replace(PEN, weight=PEN.weight - 3.0)
    settings = drag_settings(tool_check=5.0)
    recorder = Recorder(MockServo(lab), MockSensor(lab), clock, heavy, settings, 5.0)
    recorder.run()
    assert positions(recorder)[1][-1, 2] < -5.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mass": (0.005, 0.005, 0.0, 0.1, 0.1, 0.1)}, "z: mass = 0"),
        ({"damping": (0.08, 0.08, 0.4, 3.0, -3.0, 3.0)}, "rotation y: damping = -3"),
        ({"stiffness": (0.0, -1.0, 0.0, 0.0, 0.0, 0.0)}, "y: stiffness = -1"),
        ({"damping": (0.08, 0.08, 0.4, 3.0, 3.0, 10.0)}, "rotation z: unstable"),
        ({"control_rate": 10.0}, "x: unstable|z: unstable"),
        ({"sensor_rate": 40.0}, "sensor_rate = 40 Hz is below control_rate"),
        ({"low_pass": 50.0}, "low_pass = 50 Hz: must be below half"),
    ],
)
def test_settings_that_do_not_go_together_are_refused_by_name(options, words):
    with pytest.raises(InputError, match=words):
        record_settings.check(drag_settings(**options))


@pytest.mark.parametrize("preset", ["drag", "paper"])
def test_the_presets_are_stable(preset):
    from dmpcli.settings import layers

    record_settings.check(layers.resolve(record_settings.RecordSettings, {}, preset))
