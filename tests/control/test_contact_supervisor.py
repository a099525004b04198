from itertools import pairwise

import numpy as np
import pytest

from dmpcli.admittance.force_law import ForceGains, by_rule
from dmpcli.control.contact_policy import ContactEvent, course
from tests.control.contact_plant import PERIOD, Plant, Rig


def rms(pairs):
    return float(np.sqrt(np.mean((pairs[:, 0] - pairs[:, 1]) ** 2)))


def wavy(height, amplitude=0.4, period=6.0, rig=None):
    """A surface that is still until the stroke begins."""
    begun = []

    def surface(t):
        if not begun and rig and rig[0].supervisor.settled:
            begun.append(t)
        return height + (amplitude * np.sin(2 * np.pi * (t - begun[0]) / period) if begun else 0.0)

    return surface


def drawn(stiffness, cycles, seed=0, height=-1.5, **policy):
    rig = []
    surface = wavy(height, rig=rig)
    rig.append(Rig(Plant(stiffness, cycles, surface=surface, seed=seed), **policy))
    return rig[0], rig[0].land().draw(12.0)


@pytest.mark.sweep(kept=4)
@pytest.mark.slow
@pytest.mark.parametrize("cycles", [0, 1, 2, 4])
@pytest.mark.parametrize("stiffness", [0.5, 2.0, 5.0, 20.0])
def test_the_force_is_held_and_the_contact_measured_at_any_stiffness_and_delay(stiffness, cycles):
    rig, pairs = drawn(stiffness, cycles)
    found = rig.supervisor
    assert not found.failure
    assert found.stiffness == pytest.approx(stiffness, rel=0.05)
    lag = PERIOD * cycles + rig.plant.lag + 0.03  # with half the filter, a period's half, the mean
    assert found.delay == pytest.approx(lag, abs=0.02)
    assert rms(pairs) < (0.16 if stiffness <= 5.0 else 0.55)
    assert pairs[:, 0].min() > 2.5
    assert found.landing_peak < (1.5 * 5.0 if stiffness <= 15.0 else 9.0)


def test_the_felt_inertia_of_a_heavy_tool_on_a_soft_contact_does_not_make_it_swing():
    """3 kg on 0.5 N/mm: from 2 Hz on the sensor feels more of the tool than of the contact."""
    for told, steady in ((3.0, True), (0.0, False)):
        rig = Rig(Plant(0.5, 0, mass=3.0), tool_mass=told)
        pairs = rig.land().draw(6.0)
        swung = "oscillating" in {event.state for event in rig.supervisor.events}
        assert (not rig.supervisor.failure and not swung and rms(pairs[-100:]) < 0.1) == steady


def test_chosen_gains_that_swing_by_the_tools_inertia_are_refused_at_the_landing():
    gains = ForceGains(PERIOD * 0.06, 0.06, 0.0, np.inf, PERIOD)
    rig = Rig(Plant(0.5, 0, mass=3.0), gains=gains, tool_mass=3.0).land()
    assert "unstable on a contact of" in rig.supervisor.failure
    assert "with a tool of 3 kg, whose inertia is felt too" in rig.supervisor.failure


@pytest.mark.parametrize("height", [-5.0, -2.0, 0.0, 2.0, 5.0])
@pytest.mark.parametrize("stiffness", [2.0, 15.0])
def test_a_surface_off_the_plan_is_landed_on_gently(height, stiffness):
    rig = Rig(Plant(stiffness, 1, surface=lambda t: height))
    rig.land()
    assert rig.supervisor.settled
    assert rig.supervisor.landing_peak <= 1.5 * 5.0
    assert rig.states == ["free", "seeking", "landing", "drawing"]


@pytest.mark.sweep(kept=6)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("stiffness", [0.5, 2.0, 10.0])
@pytest.mark.parametrize("wanted", [0.5, 1.0, 2.0])
def test_a_small_force_is_landed_on_as_surely_whatever_the_noise(wanted, stiffness, seed):
    """A slope of what has risen by no more than the noise would press anywhere, or nowhere."""
    rig = Rig(Plant(stiffness, 1, seed=seed, surface=lambda t: -1.0), setpoint=wanted).land(90.0)
    assert rig.supervisor.settled
    assert rig.peak <= 1.5 * wanted
    # Beside a noise of 0.05 N.
    assert rig.supervisor.stiffness == pytest.approx(stiffness, rel=0.15 if wanted > 0.7 else 0.4)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("noise", [0.2, 0.5])
@pytest.mark.parametrize("stiffness", [0.5, 2.0, 10.0])
def test_a_sensor_that_scatters_is_judged_by_its_own_noise(stiffness, noise, seed):
    """Half a newton, as of sensors that arms have built in, is no touch, no swing and no loss."""
    rig = Rig(Plant(stiffness, 1, seed=seed, noise=noise, surface=lambda t: -1.0)).land()
    pairs = rig.draw(4.0)
    assert rig.states[-1] == "drawing"
    assert set(rig.states) == {"free", "seeking", "landing", "drawing"}
    assert rig.supervisor.noise == pytest.approx(noise, rel=0.5)
    assert rig.supervisor.stiffness == pytest.approx(stiffness, rel=0.25)
    assert rig.peak <= 1.5 * 5.0
    assert abs(pairs[:, 0].mean() - 5.0) < noise


def test_a_set_point_within_the_noise_is_refused_before_anything_touches():
    rig = Rig(Plant(2.0, noise=0.5), setpoint=1.0).land()
    assert "too much to feel 1 N by" in rig.supervisor.failure
    assert rig.peak == 0.0


@pytest.mark.parametrize("bias", [-1.2, 1.2])
def test_a_zero_that_is_off_is_taken_anew_before_contact(bias):
    rig = Rig(Plant(2.0, 1, bias=bias))
    pairs = rig.land().draw(6.0)
    assert abs(pairs[:, 0].mean() - 5.0) < 0.05


def test_a_zero_that_is_far_off_is_refused():
    rig = Rig(Plant(2.0, bias=3.0)).land()
    assert "coupling_zero_limit" in rig.supervisor.failure


def test_a_tool_that_is_still_pressed_when_lifted_is_no_zero():
    rig = Rig(Plant(0.5, surface=lambda t: 9.0), zero_limit=100.0).land()
    assert "still pressed" in rig.supervisor.failure


def test_without_a_surface_it_says_how_far_it_has_looked():
    rig = Rig(Plant(2.0, surface=lambda t: None)).land()
    assert "no contact within 6 mm of the plan" in rig.supervisor.failure
    assert rig.peak == 0.0


def test_an_offset_that_comes_while_it_seeks_is_no_contact():
    plant = Plant(2.0, surface=lambda t: None)
    rig = Rig(plant)
    while rig.supervisor.state != "seeking":
        rig.cycle()
    plant.bias = 1.0
    rig.land()
    assert not rig.supervisor.settled
    assert "no contact" in rig.supervisor.failure


def test_a_zero_that_jumps_far_in_the_air_is_no_contact_either():
    plant = Plant(2.0, surface=lambda t: None)
    rig = Rig(plant)
    while rig.supervisor.state != "seeking":
        rig.cycle()
    plant.bias = 4.0
    rig.land()
    assert not rig.supervisor.settled
    assert "no contact" in rig.supervisor.failure


def after(rig, change):
    """A surface that changes some seconds into the stroke."""
    begun = []

    def surface(t):
        if rig and rig[0].supervisor.settled and not begun:
            begun.append(t)
        return change(t - begun[0]) if begun else 0.0

    return surface


def changing(stiffness, change, cycles=1, **policy):
    rig = []
    rig.append(Rig(Plant(stiffness, cycles, surface=after(rig, change)), **policy))
    return rig[0], rig[0].land().draw(8.0)


def test_a_step_down_is_found_again():
    rig, pairs = changing(2.0, lambda t: 0.0 if t < 2.0 else -3.0)
    assert not rig.supervisor.failure
    assert np.mean(pairs[150:, 0] > 0.5) >= 0.995
    assert abs(pairs[-100:, 0].mean() - 5.0) < 0.1


def test_after_a_step_down_the_tool_goes_on_at_once_as_fast_as_a_landing_may_be():
    """5 N on 2 N/mm: its spring gives 2.5 mm at once, and 0.5 mm are left.

    They take the loop's delay, and the way at the speed after which half of 5 N more are felt.
    """
    rig, pairs = changing(2.0, lambda t: 0.0 if t < 2.0 else -3.0)
    felt, delay = pairs[:, 0], rig.supervisor.delay
    speed = 0.5 * 5.0 / (2.0 * (delay + 2.0 * PERIOD))
    assert (felt == 0.0).sum() * PERIOD <= delay + PERIOD + 0.5 / speed
    assert felt.max() < 1.5 * 5.0
    assert "lost" not in rig.states
    # Where a loss stops it, or is waited out, nothing leads into the air.
    for on_loss in ("stop", "hold"):
        held, _ = changing(2.0, lambda t: 0.0 if t < 2.0 else None, on_loss=on_loss)
        assert held.supervisor.e > -2.5 - 0.3


@pytest.mark.parametrize("stiffness", [0.5, 2.0, 5.0, 15.0])
def test_a_surface_that_is_found_again_is_met_below_one_and_a_half_times_the_set_point(stiffness):
    """Deeper by what the spring gives, and by 2 mm more."""
    deep = 5.0 / stiffness + 2.0
    rig, pairs = changing(stiffness, lambda t: 0.0 if t < 2.0 else -deep)
    assert not rig.supervisor.failure
    assert pairs[round(2.2 / PERIOD) :, 0].max() <= 1.5 * 5.0
    assert abs(pairs[-50:, 0].mean() - 5.0) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("cycles", [2, 4])
@pytest.mark.parametrize("stiffness", [5.0, 15.0])
@pytest.mark.parametrize("deep", [1.0, 3.0])
def test_nor_does_a_late_loop_sum_up_what_has_stepped(deep, stiffness, cycles):
    """A step by as much as the spring gives, or more: the integral follows slopes, not steps."""
    told = PERIOD * (1 + cycles) + 0.025
    rig, pairs = changing(
        stiffness, lambda t: 0.0 if t < 2.0 else -deep, cycles=cycles, told_delay=told
    )
    assert not rig.supervisor.failure
    assert pairs[105:, 0].max() <= 1.5 * 5.0


def test_the_end_of_the_part_stops_it_and_is_named():
    rig, _ = changing(2.0, lambda t: 0.0 if t < 2.0 else None)
    assert "was lost and not found again within 6 mm" in rig.supervisor.failure
    assert rig.supervisor.state == "lost"
    assert "seeking" in rig.states[4:]


def test_where_asked_a_loss_stops_at_once_or_is_waited_out():
    rig, _ = changing(2.0, lambda t: 0.0 if t < 2.0 else None, on_loss="stop")
    assert "--on-contact-loss stop" in rig.supervisor.failure
    rig, pairs = changing(2.0, lambda t: 0.0 if not 2.0 < t < 4.0 else None, on_loss="hold")
    assert not rig.supervisor.failure
    assert "lost" in rig.states
    assert abs(pairs[-50:, 0].mean() - 5.0) < 0.2


@pytest.mark.parametrize("stiffness", [2.0, 10.0])
def test_a_ramp_steeper_than_it_can_follow_stops_it_near_the_set_point(stiffness):
    rig, pairs = changing(stiffness, lambda t: min(max(t - 2.0, 0.0) * 8.7, 3.0))
    peak = pairs[:, 0].max()
    if rig.supervisor.failure:
        assert rig.supervisor.urgent
        assert rig.supervisor.state == "too hard"
    # What the loop's reaction makes unavoidable beyond the limit of 10 N.
    assert peak < 10.0 + 8.7 * stiffness * 0.12
    assert stiffness < 5.0 or rig.supervisor.failure


def test_a_side_force_that_is_no_friction_is_a_wall():
    rig = Rig(Plant(2.0, 1))
    rig.land()
    rig.supervisor.step(rig.t, 5.0, 3.9, 5.0)
    assert not rig.supervisor.failure
    rig.supervisor.step(rig.t, 5.0, 4.1, 5.0)
    assert rig.supervisor.urgent
    assert "wall" in rig.supervisor.failure


@pytest.mark.parametrize(("friction", "stops"), [(0.0, True), (0.2, True), (0.5, False)])
def test_where_much_friction_was_felt_more_of_it_is_no_wall(friction, stops):
    rig = Rig(Plant(2.0, 1)).land()
    rig.supervisor.step(rig.t, 5.0, 4.3, 5.0, friction)
    assert bool(rig.supervisor.failure) == stops
    rig.supervisor.step(rig.t, 5.0, 5.6, 5.0, friction)
    assert rig.supervisor.urgent


def test_chosen_gains_that_the_contact_would_make_swing_are_refused_at_the_landing():
    gains = ForceGains(PERIOD * 0.1, 0.1, 0.0, np.inf, PERIOD)
    rig = Rig(Plant(5.0, 2), gains=gains).land()
    assert "unstable on a contact of" in rig.supervisor.failure
    assert not rig.supervisor.urgent


@pytest.mark.parametrize(("factor", "stops"), [(1.7, False), (5.0, True)])
def test_a_force_that_swings_has_the_gains_softened_once_and_then_stops(factor, stops):
    """On the way the surface becomes stiffer than what the landing has measured."""
    rig = Rig(Plant(4.0, 2, surface=lambda t: 0.0))
    rig.land().draw(1.0)
    plant = rig.plant
    plant.stiffness *= factor
    height = plant.height + plant.force / plant.stiffness
    plant.surface = lambda t: height
    rig.draw(12.0)
    states = [event.state for event in rig.supervisor.events]
    assert ("oscillating" in states) or rig.supervisor.urgent
    assert bool(rig.supervisor.failure) == stops
    assert rig.peak < 20.0
    if not stops:
        assert states.count("oscillating") == 1
        assert np.ptp([row[3] for row in rig.rows[-150:]]) < 1.0


def test_the_clamp_counts_where_the_surface_is_and_not_the_tools_compression():
    """A spring of 0.5 N/mm stands 10 mm deep in itself: that is no displacement of the surface."""
    rig = Rig(Plant(0.5, 0, surface=lambda t: -2.0), clamp=4.0, reach=4.0)
    pairs = rig.land().draw(4.0)
    assert abs(pairs[-50:, 0].mean() - 5.0) < 0.1
    assert rig.supervisor.e == pytest.approx(-12.0, abs=0.3)


def test_saturation_is_told_as_it_happens():
    rig, _ = changing(2.0, lambda t: -max(t - 1.0, 0.0) * 1.0, clamp=4.0, reach=3.0)
    said = [event.detail for event in rig.supervisor.events]
    assert any("saturated" in words and "coupling_clamp" in words for words in said)


def test_a_lifted_part_is_a_retreat_and_a_landing_and_no_loss():
    begun = []

    def height(t):
        """The plan lifts the tool by 5 mm: seen from it the surface falls away."""
        if rig.supervisor.settled and not begun:
            begun.append(t)
        past = t - begun[0] if begun else 0.0
        return 0.3 - (5.0 if 2.0 < past < 4.0 else 0.0)

    rig = Rig(Plant(2.0, 1, surface=height))
    rig.land()
    start = rig.t
    rig.draw(8.0, lambda t: 0.0 if 1.9 < t - start < 4.1 else 5.0)
    states = rig.states
    assert "lost" not in states
    assert "retreating" in states
    assert states[-1] == "drawing"
    assert abs(np.mean([row[3] for row in rig.rows[-100:]]) - 5.0) < 0.1
    assert rig.peak < 7.5


def test_a_stroke_that_begins_lifted_only_takes_its_zero():
    rig = Rig(Plant(2.0, bias=0.8, surface=lambda t: -30.0))
    rig.supervisor.begin(airborne=True)
    while not rig.supervisor.settled:
        rig.cycle(0.0)
    assert rig.t < 2.0
    rig.cycle(0.0)
    assert rig.zero == pytest.approx(0.8, abs=0.05)
    assert np.all([row[2] == 0.0 for row in rig.rows])


def test_after_the_stroke_it_comes_clear_of_the_work():
    rig = Rig(Plant(2.0, 1, surface=lambda t: 2.0))
    rig.land()
    rig.draw(1.0)
    e = rig.supervisor.e
    while not rig.supervisor.retreated:
        rig.plant.step(rig.supervisor.retreat(rig.t))
    assert rig.supervisor.e > e + 6.0
    for _ in range(20):
        rig.plant.step(rig.supervisor.e)
    assert rig.plant.force == 0.0


def test_a_second_landing_on_what_is_known_is_quicker():
    rig = Rig(Plant(2.0, 0))
    rig.land()
    first = rig.t
    rig.supervisor.begin()
    rig.supervisor.lifted(6.0)
    begun = rig.t
    while not rig.supervisor.settled:
        rig.cycle()
    assert rig.t - begun < 0.75 * first


def at_work(setpoint=5.0, **policy):
    """A supervisor that draws on 2 N/mm, told forces directly."""
    rig = Rig(Plant(2.0, noise=0.0), setpoint, **policy).land()
    assert rig.supervisor.state == "drawing"
    return rig.supervisor, rig.t


@pytest.mark.parametrize(
    ("force", "wanted", "fails"),
    [(10.0, 5.0, False), (10.01, 5.0, True), (2.0, 0.6, False), (2.01, 0.6, True)],
)
def test_twice_the_set_point_or_four_times_the_threshold_is_too_hard(force, wanted, fails):
    """A light set-point is let swing up to twice that of twice the threshold, 0.5 N."""
    supervisor, t = at_work()
    supervisor.step(t, force, 0.0, wanted)
    assert supervisor.urgent is fails
    assert bool(supervisor.failure) is fails


@pytest.mark.parametrize(("force", "fails"), [(15.0, False), (15.01, True)])
def test_a_landing_may_meet_half_as_much_again(force, fails):
    rig = Rig(Plant(2.0, noise=0.0))
    while rig.supervisor.state != "landing":
        rig.cycle()
    rig.supervisor.step(rig.t, force, 0.0, 5.0)
    assert rig.supervisor.urgent is fails


@pytest.mark.parametrize("lost", [3, 4])
def test_contact_is_lost_after_more_than_its_patience(lost):
    """60 ms: three cycles without a force are waited out, a fourth is not."""
    supervisor, t = at_work(on_loss="hold", patience=0.061)
    e = supervisor.e
    for k in range(lost):
        supervisor.step(t + 0.02 * k, 0.5, 0.0, 5.0)
    assert (supervisor.state == "lost") is (lost > 3)
    # Meanwhile the tool is held where it is.
    assert supervisor.e == e
    supervisor.step(t, 5.0, 0.0, 5.0)
    supervisor.step(t, 0.5, 0.0, 5.0)
    assert supervisor.state != "seeking"


def test_two_cycles_with_a_force_are_a_contact_again_and_one_is_not():
    supervisor, t = at_work(on_loss="hold", patience=0.0)
    supervisor.step(t, 0.0, 0.0, 5.0)
    assert supervisor.state == "lost"
    for force in (1.0, 0.2, 1.0):
        supervisor.step(t, force, 0.0, 5.0)
        assert supervisor.state == "lost"
    supervisor.step(t, 1.0, 0.0, 5.0)
    assert supervisor.state == "landing"
    supervisor.step(t, 2.5, 0.0, 5.0)
    assert supervisor.state == "drawing"


def test_lost_it_is_sought_downwards_by_so_much_and_no_further():
    supervisor, t = at_work(again=1.5, patience=0.0)
    supervisor.step(t, 0.0, 0.0, 5.0)
    assert supervisor.state == "seeking"
    lost = supervisor.e
    for k in range(200):
        supervisor.step(t + 0.02 * k, 0.0, 0.0, 5.0)
        if supervisor.failure:
            break
    assert "not found again within 1.5 mm" in supervisor.failure
    assert not supervisor.urgent
    # Within a cycle's way of looking for it.
    assert lost - 1.5 - 0.17 <= supervisor.e <= lost - 1.5 + 1e-9


def test_how_fast_a_surface_is_looked_for():
    """At the guarded speed, by 0.4 of a light set-point in a second, or by what its delay costs."""
    for setpoint, policy, speed in (
        (5.0, {}, 2.0),
        (2.5, {}, 1.0),
        (5.0, {"stiffness": 10.0, "whole_delay": 0.1}, 1.0),
        (5.0, {"stiffness": 0.5, "whole_delay": 0.1}, 8.0),
        (5.0, {"stiffness": 2.0, "whole_delay": 0.1}, 5.0),
        (5.0, {"stiffness": 50.0, "whole_delay": 0.1, "seek": 0.1}, 0.2),
    ):
        supervisor = Rig(Plant(2.0), setpoint, **policy).supervisor
        assert supervisor._speed == pytest.approx(speed), (setpoint, policy)


def test_gains_are_those_of_the_rule_for_what_was_measured_said_or_usual():
    def rule(k, delay, *more):
        return by_rule(k, delay + PERIOD / 2.0, PERIOD, *more)

    rig = Rig(Plant(2.0, noise=0.0), spring=0.3, tool_mass=2.0).land()
    found = rig.supervisor
    assert found.gains == rule(found.stiffness, found.delay, 0.3, 2e-3)
    rig = Rig(Plant(2.0, noise=0.0), stiffness=3.0, whole_delay=0.09).land()
    assert rig.supervisor.gains == rule(3.0, 0.09)
    assert rig.supervisor.stiffness == pytest.approx(2.0, rel=0.02)
    bare = Rig(Plant(2.0), told_delay=0.04).supervisor
    bare._choose()
    assert bare.gains == rule(5.0, 0.04)
    heavy = Rig(Plant(2.0), told_delay=0.04, tool_mass=9.0).supervisor
    heavy._choose()
    wanted = rule(5.0, 0.04, 0.0, 9e-3)
    assert heavy.gains.damping == pytest.approx(wanted.damping)
    assert heavy.gains.damping > 1.1 * bare.gains.damping


def test_the_lifted_tool_may_read_its_zero_limit_and_no_more():
    for size, fails in ((2.0, False), (2.01, True)):
        supervisor = Rig(Plant(2.0), zero_limit=2.0).supervisor
        supervisor.zero_is(1.0, size)
        assert bool(supervisor.failure) is fails
        assert not supervisor.urgent


def test_a_force_that_falls_as_the_tool_is_lifted_is_a_contact():
    """On a spring that is still pressed: 0.15 N over the last millimetre are allowed."""
    for stiffness, fails in ((0.14, False), (0.16, True)):
        rig = Rig(Plant(stiffness, noise=0.0, surface=lambda t: 9.0), zero_limit=100.0)
        for _ in range(150):
            rig.cycle()
            if rig.supervisor.state != "free" or rig.supervisor.failure:
                break
        assert bool(rig.supervisor.failure) is fails


def test_a_saturation_is_told_once_it_lasts_a_tenth_of_a_second():
    supervisor, t = at_work(rate=1.0)
    told = len(supervisor.events)
    for k in range(4):
        supervisor.step(t + 0.02 * k, 9.9, 0.0, 5.0)
        assert supervisor.saturated
    assert len(supervisor.events) == told
    for k in range(4, 7):
        supervisor.step(t + 0.02 * k, 9.9, 0.0, 5.0)
    [event] = supervisor.events[told:]
    assert event.detail == "saturated: the correction has reached 1 mm/s (coupling_rate)"


def test_after_a_stroke_it_is_lifted_by_the_reach_above_where_it_would_be_unpressed():
    supervisor, t = at_work(reach=4.0, free=10.0)
    e, k = supervisor.e, supervisor.stiffness
    assert not supervisor.retreated
    way = [e]
    while not supervisor.retreated:
        way.append(supervisor.retreat(t))
    assert way[-1] == pytest.approx(e + 5.0 / k + 4.0)
    assert max(b - a for a, b in pairwise(way)) <= 10.0 * PERIOD + 1e-9
    assert supervisor.retreat(t) == way[-1]
    assert [event.state for event in supervisor.events].count("retreating") == 1
    supervisor.leaves(t)
    assert [event.state for event in supervisor.events].count("retreating") == 1


def swung(spacing, size=2.0, wanted=5.0):
    """Forces that alternate by a size about the set-point: whether the loop is said to swing."""
    supervisor, t = at_work(wanted, whole_delay=0.08, limit=9.0)
    for k in range(1, 14):
        supervisor.step(t + spacing * k, wanted + 0.5 * size * (-1) ** k, 0.0, wanted)
    return "oscillating" in {event.state for event in supervisor.events}


def test_six_alternations_within_twenty_delays_are_a_swing():
    """Of a loop of 0.08 s and a period of 0.02 s: within 2 s."""
    assert swung(0.39)
    assert not swung(0.41)


@pytest.mark.parametrize(
    ("wanted", "size", "swings"),
    [(5.0, 1.52, True), (5.0, 1.48, False), (1.5, 0.52, True), (1.5, 0.48, False)],
)
def test_a_swing_is_three_tenths_of_the_set_point_or_half_a_newton(wanted, size, swings):
    assert swung(0.2, size, wanted) is swings


def test_each_change_is_named_with_its_time_and_many_are_counted():
    rig, _ = changing(2.0, lambda t: 0.0 if t < 2.0 else None)
    said = course(rig.supervisor.events)
    states = [words.split(" at ")[0] for words in said.split(", ")]
    assert states == ["seeking", "landing", "drawing", "lost", "seeking", "lost"]
    assert said.endswith(f"lost at {rig.supervisor.events[-1].t:.2f} s")
    some = [ContactEvent(0.1 * n, ("seeking", "drawing")[n % 2]) for n in range(14)]
    limits = ContactEvent(1.35, "drawing", "saturated: the correction has reached 10 mm/s")
    assert course([*some, limits]) == "7 × seeking, 7 × drawing"


def test_after_a_touch_that_was_none_two_cycles_with_a_force_are_needed_again():
    rig = Rig(Plant(2.0, surface=lambda t: None, noise=0.0))
    while rig.supervisor.state != "seeking":
        rig.cycle()
    supervisor = rig.supervisor
    states = []
    for k, force in enumerate([0.6, 0.6, 0.26, 0.25, 0.6, 0.4, 0.6, 0.6]):
        supervisor.step(rig.t + PERIOD * k, force, 0.0, 5.0)
        states.append(supervisor.state)
    # Half of the threshold of 0.5 N is no contact any more.
    assert states == ["seeking", "landing", "landing", *["seeking"] * 4, "landing"]


def test_a_force_that_has_not_settled_after_a_minute_never_will():
    for clock, fails in ((59.97, False), (59.99, True)):
        rig = Rig(Plant(2.0, noise=0.0))
        while rig.supervisor.state != "landing":
            rig.cycle()
        rig.supervisor._clock = clock
        rig.cycle()
        assert bool(rig.supervisor.failure) is fails
        if fails:
            assert rig.supervisor.failure == "the force does not settle at 5 N"
            assert not rig.supervisor.urgent
    slow = Rig(Plant(2.0, noise=0.0), told_delay=0.2)
    while slow.supervisor.state != "landing":
        slow.cycle()
    slow.supervisor._clock = 60.0
    slow.cycle()
    assert slow.supervisor.failure.endswith(" behind a delay of 0.2 s")


def test_a_force_that_stays_however_deep_it_is_followed_ends_the_run():
    supervisor, t = at_work(clamp=30.0)
    for k in range(1000):
        supervisor.step(t + PERIOD * k, 1.0, 0.0, 5.0)
        if supervisor.state != "drawing":
            break
    assert supervisor.state == "lost"
    assert supervisor.failure == (
        "1.00 N that does not rise with displacement: it is no contact; check the tool's zero"
    )
    assert not supervisor.urgent


@pytest.mark.parametrize(("force", "state"), [(0.5, "lost"), (0.51, "landing")])
def test_found_again_the_surface_must_push_by_more_than_the_threshold(force, state):
    supervisor, t = at_work(on_loss="hold", patience=0.0)
    for felt in (0.0, 1.0, 1.0):
        supervisor.step(t, felt, 0.0, 5.0)
    assert supervisor.state == "landing"
    supervisor.step(t, force, 0.0, 5.0)
    assert supervisor.state == state
