from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from dmpcli.kinematics import chain, inverse, models, path

EC66 = models.model("ec66")
PERIOD = 0.02
DOWN = np.diag([1.0, -1.0, -1.0])
PLAIN = np.array([0.4, -1.1, 1.3, -1.5, -1.5, 0.7])


def swept(*ends, samples=101):
    """Joint angles that move smoothly from one configuration to the next, (T, 6)."""
    at = np.linspace(0, len(ends) - 1, samples)
    return np.column_stack([np.interp(at, range(len(ends)), joint) for joint in np.array(ends).T])


def followed(q, start=None, arm=EC66, period=PERIOD):
    at = chain.forward(EC66, q)
    position, rotation = at.position, at.rotation
    return path.follow(arm, position[None], rotation[None], period, start)


def line(start, goal, samples=101):
    s = np.linspace(0, 1, samples)[:, None]
    return np.asarray(start) + s * (np.asarray(goal, dtype=float) - start)


def pen(position):
    position = np.asarray(position)[None]
    return position, np.broadcast_to(DOWN, (*position.shape, 3))


def test_a_path_made_in_joint_space_is_found_again_from_its_own_start():
    q = swept(PLAIN, PLAIN + [0.3, -0.2, 0.3, 0.1, -0.3, 0.6])
    found = followed(q, PLAIN)
    assert found.passed.all()
    assert found.joints[0] == pytest.approx(q, abs=1e-9)
    assert found.speed.value == pytest.approx([0.6 / 2.0])
    assert found.speed.joint == 5


def test_all_samples_lead_back_to_the_path():
    position, rotation = pen(line([450, -250, 100], [550, 300, 250]))
    found = path.follow(EC66, position, rotation, PERIOD)
    back = chain.forward(EC66, found.joints)
    assert np.abs(back.position - position).max() < 1e-9
    assert np.abs(back.rotation - rotation).max() < 1e-12
    assert np.abs(np.diff(found.joints, axis=1)).max() < 0.05


@pytest.mark.parametrize("samples", [100, 101])
def test_through_the_wrist_singularity_the_branch_that_goes_on_is_taken(samples):
    # Straight through sin φ5 = 0 (offset 180°); with 101 samples one of them lies on it.
    before, after = PLAIN.copy(), PLAIN + [0.1, 0.1, -0.1, 0.1, 0, 0.1]
    before[4], after[4] = -np.pi - 0.3, -np.pi + 0.3
    q = swept(before, after, samples=samples)
    found = followed(q, before)
    assert found.passed.all()
    assert not found.jumps.any()
    assert found.joints[0] == pytest.approx(q, abs=0.01)
    # The branch of the start's number would jump by about half a turn there.
    way = chain.forward(EC66, q)
    numbered = inverse.solve(EC66, way.position, way.rotation)[0]
    apart = np.abs((numbered[0] - before + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
    own = np.unwrap(numbered[:, np.nanargmin(apart)], axis=0)
    assert np.nanmax(np.abs(np.diff(own, axis=0))) > 1.0


def test_a_path_that_lies_in_the_wrist_singularity_keeps_joint_6():
    q = swept(PLAIN, PLAIN + [0.3, 0.2, -0.1, 0.2, 0, 0])
    q[:, 4] = -np.pi
    found = followed(q, q[0])
    assert found.passed.all()
    assert found.joints[0] == pytest.approx(q, abs=1e-6)


def test_joint_angles_go_on_past_half_a_turn_and_over_a_whole_one():
    q = swept(PLAIN, PLAIN + [0, 0, 0, 0, 0, 5.0])
    found = followed(q, PLAIN)
    assert found.joints[0, :, 5] == pytest.approx(q[:, 5], abs=1e-9)
    assert found.passed.all()


def test_without_a_start_the_turn_with_the_largest_margin_is_taken():
    turned = PLAIN + [0, 0, 0, 0, 0, 2 * np.pi - 1.0]
    onward = turned + [0, 0, 0, 0, 0, 1.0]
    q = swept(turned, onward)
    fixed = followed(q, turned)
    assert not fixed.passed.any()
    assert fixed.angle.joint == 5
    assert np.degrees(fixed.angle.value) == pytest.approx(np.degrees(onward[5]))
    assert fixed.angle.sample == 100
    free = followed(q)
    assert free.passed.all()
    assert np.abs(free.joints[0, :, 5]).max() < np.pi


def test_another_branch_is_found_where_the_one_of_the_start_leaves_the_limits():
    # An elbow bent one way only: every branch that bends the other way leaves the limits.
    limits = EC66.limits.copy()
    limits[2] = np.radians([10, 160])
    arm = replace(EC66, limits=limits)
    low = PLAIN.copy()
    low[2] = -1.3
    q = swept(low, low + [0.2, 0.1, -0.1, 0.1, 0.1, 0.1])
    fixed = followed(q, low, arm)
    assert not fixed.passed.any()
    assert fixed.angle.joint == 2
    free = followed(q, arm=arm)
    assert free.passed.all()
    assert (free.joints[0, :, 2] > np.radians(10)).all()
    assert free.margin > 0


def test_the_branch_that_is_taken_has_the_largest_margin_of_all_eight():
    q = swept(PLAIN, PLAIN + [0.2, 0.1, -0.1, 0.1, 0.1, 0.1])
    free = followed(q)
    first = chain.forward(EC66, q[0])
    starts = inverse.solve(EC66, first.position, first.rotation)[0]
    margins = [followed(q, s).margin[0] for s in starts if not np.isnan(s[0])]
    assert np.isfinite(margins).sum() >= 4
    assert free.margin[0] >= np.nanmax(margins) - 1e-9


def test_a_joint_that_must_turn_too_fast_is_told_with_its_sample():
    q = swept(PLAIN, PLAIN + [0.2, 0, 0, 0, 0, 0])
    q[60:, 3] += 0.095  # 272 °/s in one period of 20 ms, of 260
    found = followed(q, PLAIN)
    assert not found.passed.any()
    assert found.speed.joint == 3
    assert found.speed.sample == 60
    assert np.degrees(found.speed.value) == pytest.approx(np.degrees(0.095) / 0.02)
    assert np.degrees(found.speed.limit) == pytest.approx(260)
    assert not found.jumps.any()
    assert followed(q, PLAIN, period=0.04).passed.all()


def test_a_jump_is_told_apart_from_a_fast_motion():
    q = swept(PLAIN, PLAIN + [0.2, 0, 0, 0, 0, 0])
    q[40:, 0] += 1.0
    found = followed(q, PLAIN)
    assert found.jumps.all()
    assert found.leap.sample == 40
    assert found.leap.joint == 0


def test_a_motion_that_is_only_much_too_fast_does_not_jump():
    at = np.linspace(0, 1, 21)[:, None]
    q = PLAIN + (3 * at**2 - 2 * at**3) * [0, 0, 0, 0, 0, 6.0]
    found = followed(q, PLAIN)
    assert found.speed.value * PERIOD > path.JUMP
    assert not found.speed.passed.any()
    assert not found.jumps.any()


def test_near_the_wrist_singularity_the_speed_grows_and_the_singularity_is_told():
    # Past sin φ5 = 0 at 0.02: joints 4 and 6 have to swing round.
    before = PLAIN.copy()
    before[4] = -np.pi + 0.02
    at = chain.forward(EC66, before)
    position, rotation = at.position, at.rotation
    track = position + line([-100, 0, 0], [100, 0, 0], 301)
    found = path.follow(EC66, track[None], np.broadcast_to(rotation, (1, 301, 3, 3)), 0.004, before)
    assert found.nearness.shape == (1, 3)
    assert found.nearness[0].argmin() == inverse.SINGULARITIES.index("wrist")
    assert found.nearness[0].min() == pytest.approx(0.02, abs=1e-3)
    assert found.speed.joint in (3, 5)
    assert not found.speed.passed.any()
    assert not found.jumps.any()


def test_out_of_reach_names_the_worst_sample_and_what_is_missing():
    position, rotation = pen(line([500, 0, 100], [1100, 0, 100]))
    found = path.follow(EC66, position, rotation, PERIOD)
    assert not found.passed.any()
    assert found.missing.sample == 100
    alone = inverse.solve(EC66, position[0, 100], rotation[0, 100])[1].min()
    assert found.missing.value == pytest.approx(alone)
    assert np.isnan(found.joints).all()


@pytest.mark.thorough
def test_reach_agrees_with_a_search_near_the_boundary():
    rng = np.random.default_rng(8)
    agreed = {True: 0, False: 0}
    for _ in range(12):
        azimuth, height = rng.uniform(0, 2 * np.pi), rng.uniform(-200, 500)
        at = np.array([820 * np.cos(azimuth), 820 * np.sin(azimuth), height])
        at[:2] *= rng.uniform(0.9, 1.1)
        position, rotation = pen(at[None])
        found = path.follow(EC66, position, rotation, 1.0)
        reached = bool(found.missing.passed[0])

        def missed(q, at=at):
            flange = chain.forward(EC66, q)
            return np.concatenate([flange.position - at, 100.0 * (flange.rotation - DOWN).ravel()])

        best = min(least_squares(missed, rng.uniform(-np.pi, np.pi, 6)).cost for _ in range(12))
        assert reached == (best < 1e-4)
        agreed[reached] += 1
    assert min(agreed.values()) > 1


def test_many_paths_are_judged_each_as_if_alone(monkeypatch):
    rng = np.random.default_rng(9)
    starts, goals = rng.uniform([-900, -500, 0], [900, 500, 300], (2, 30, 3))
    position = np.array([line(a, b, 40) for a, b in zip(starts, goals, strict=True)])
    rotation = np.broadcast_to(DOWN, (30, 40, 3, 3))
    monkeypatch.setattr(path, "_TOGETHER", 200)
    found = path.follow(EC66, position, rotation, PERIOD)
    assert 0 < found.passed.sum() < 30
    for i in range(30):
        one = path.follow(EC66, position[i : i + 1], rotation[i : i + 1], PERIOD)
        assert one.passed[0] == found.passed[i]
        assert np.array_equal(one.joints[0], found.joints[i], equal_nan=True)
        assert one.missing.sample[0] == found.missing.sample[i]


def test_a_path_of_one_sample_has_no_speed():
    position, rotation = pen(np.array([[500.0, 100.0, 200.0]]))
    found = path.follow(EC66, position, rotation, PERIOD)
    assert found.passed.all()
    assert found.speed.value == 0.0
    assert found.speed.sample == 0


@pytest.mark.slow
def test_the_whole_path_is_what_the_loops_solver_finds_sample_by_sample():
    rng = np.random.default_rng(12)
    compared = 0
    for _ in range(40):
        start = rng.uniform(-1.5, 1.5, 6)
        q = swept(start, start + rng.uniform(-0.8, 0.8, 6), start + rng.uniform(-0.8, 0.8, 6))
        if inverse.singularity(EC66, q).min() < 0.02:
            continue
        found = followed(q, start)
        now = start
        for way, joints in zip(q, found.joints[0], strict=True):
            now = inverse.nearest(EC66, chain.forward(EC66, way), now)
            assert joints == pytest.approx(now, abs=1e-8)
        compared += 1
    assert compared > 10
