import pytest

from tests.faults import world as simulated
from tests.faults.faults import KINDS
from tests.faults.planted import PLANTED
from tests.faults.runs import COMMANDS, MOVED, draw, generator, run, telling
from tests.faults.world import World

FEW = range(12)
# Of many seeds those that put a kind of fault on its first or second command; make faults has all.
MORE = telling([*range(12, 40), *range(1000, 1160)])


def told(finding):
    return f"seed {finding.seed}: {finding.command}; {finding.faults}; exit {finding.code}\n" + (
        "\n".join(finding.wrong) + "\n" + finding.told
    )


def hold(seeds):
    broken = [finding for finding in map(run, seeds) if finding.wrong]
    assert not broken, "\n".join(map(told, broken))


@pytest.mark.slow
def test_invariants_hold_whatever_fails():
    hold(FEW)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, len(MORE), 15))
def test_invariants_hold_for_every_kind_of_fault_on_many_a_command(first):
    hold(MORE[first : first + 15])


def test_these_seeds_put_on_every_kind_of_fault_and_run_every_command():
    drawn = [draw(seed, generator(seed)) for seed in MORE]
    assert {command for command, _ in drawn} == {MOVED, *COMMANDS}
    assert {kind for _, kinds in drawn for kind in kinds} == set(KINDS)
    assert len({(command, kind) for command, kinds in drawn for kind in kinds}) > 80


@pytest.mark.slow
def test_without_faults_every_command_is_done():
    commands = ("execute", MOVED, "execute felt", "execute pressed", "execute file", "record")
    for command in commands:
        finding = run(7, (), command)
        assert (finding.code, finding.wrong) == (0, []), told(finding)


def test_a_seed_replays_its_run():
    once, again = run(11), run(11)
    assert (once.faults, once.code, once.told) == (again.faults, again.code, again.told)


@pytest.mark.sweep(kept=5)
@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_defect_is_found(name, monkeypatch):
    # One of them never ends; what is well ends within 4 s.
    monkeypatch.setattr(simulated, "LONGEST", 20.0)
    plant, command, kinds = PLANTED[name]
    with plant():
        assert any(run(seed, kinds, command).wrong for seed in range(8)), name


def test_events_happen_in_order_and_sleepers_are_overtaken():
    world, seen = World(0.0), []
    world.at(2.0, lambda: seen.append(("b", world.now())))
    world.at(1.0, lambda: seen.append(("a", world.now())))
    world.at(1.0, lambda: seen.append(("then", world.now())))
    world.sleep_until(1.5)
    assert seen == [("a", 1.0), ("then", 1.0)]
    assert world.now() == 1.5
    assert not world.wait(lambda: len(seen) > 3, 3.0)
    assert (seen[-1], world.now()) == (("b", 2.0), 3.0)


@pytest.mark.thorough
def test_a_bias_that_somebody_sets_moves_the_arm_no_further_than_15_mm_whatever_its_size():
    hold_all = [run(seed, ("sensor_biased",), "record") for seed in range(24)]
    assert not [told(finding) for finding in hold_all if finding.wrong]
    assert {finding.code for finding in hold_all} == {4}
