"""Recordings as people have them through fit and generalize: right, or told with the remedy."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.metrics.deviation import nearest_distance
from dmpcli.metrics.wave_height import stroke_wave
from dmpcli.records import file_io, record
from tests import cases
from tests.dmp import recordings
from tests.records import meshes
from tests.surfaces import fields

UP = np.array([0.0, 0.0, 1.0])
PATH = cases.wave(np.linspace(0.0, 1.0, 6001))
"""What most recordings draw: 300 mm along x, a wave of 50 mm."""
WAVE = cases.wave(cases.U6)
"""Likewise, at the times of their samples."""
WALL = {"point": [0, 0, 0], "normal": [0, -1, 0]}
PLATE = {"point": [0, 0, 0], "normal": [0, 0, 1]}


class Lab:
    """Runs commands in a folder, each fit once."""

    def __init__(self, folder):
        self.folder, self._fitted, self._surfaces = folder, {}, 0

    def run(self, *args):
        done = CliRunner().invoke(cli.app, [str(a) for a in args])
        assert done.exit_code in (0, 2, 3), done.output
        return done

    def fit(self, name, *options, tables):
        """Skill file and what was said."""
        key = (name, *map(str, options))
        if key not in self._fitted:
            files = [
                cases.write(self.folder / f"{name}_{i}.csv", table)
                for i, table in enumerate(tables)
            ]
            skill = self.folder / f"{name}_{len(self._fitted)}.json"
            done = self.run("fit", *files, "-o", skill, *options)
            assert done.exit_code == 0, done.stderr
            self._fitted[key] = skill, done.stderr
        return self._fitted[key]

    def draw(self, skill, *options):
        """Trajectory record and what was said."""
        done = self.run("generalize", skill, "-o", self.folder / "drawn", *options)
        assert done.exit_code == 0, done.stderr
        return record.decode(file_io.read(self.folder / "drawn")), done.stderr

    def refusal(self, skill, *options):
        """What is said where it is refused."""
        done = self.run("generalize", skill, "-o", self.folder / "refused", *options)
        assert done.exit_code == 3, (done.exit_code, done.stderr)
        assert len(done.stderr.strip().splitlines()) <= 2
        return done.stderr

    def surface(self, document):
        """Write a surface document."""
        self._surfaces += 1
        path = self.folder / f"surface_{self._surfaces}.json"
        path.write_text(json.dumps(document))
        return path


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    return Lab(tmp_path_factory.mktemp("cases"))


def pair(start, goal):
    return ["--start", *start, "--goal", *goal]


def learned(lab, name, *options, table=None, seed=None):
    """Skill, its document, what was said, and the demonstrated pair drawn densely (T, 3)."""
    make = getattr(cases, name)
    if table is None:
        table = make() if seed is None else make(np.random.default_rng(seed))
    skill, said = lab.fit(name, *options, tables=[table])
    # The more samples a polyline has, the dearer are distances to it.
    rate = 100 if table[-1, 0] < 100.0 else 20
    drawn, _ = lab.draw(skill, "--reproduce", "--rate", rate)
    return json.loads(skill.read_text()), said, drawn.position(), table[:, 1:4]


def deviation(points, path):
    """RMS and largest distance of points to the nearest of a path."""
    points = points[:: max(1, len(points) // 3000)]
    distance = nearest_distance(points, path)
    return np.sqrt(np.mean(distance**2)), distance.max()


def ends(position, truth):
    return np.linalg.norm(position[[0, -1]] - truth[[0, -1]], axis=1).max()


def height(position):
    return stroke_wave(position, position[0], position[-1], UP).mean


def warnings(said):
    return [line for line in said.splitlines() if line.startswith("dmpcli: ")]


# Repetitive strokes, letters, corners: as many functions as they take.


@pytest.mark.slow
@pytest.mark.parametrize("regression", ["lwr", "ridge"])
def test_twenty_loops_keep_their_height(lab, regression):
    _, said, drawn, recorded = learned(lab, "loops", "--regression", regression)
    assert abs(height(drawn) - 30.0) <= 0.1
    assert deviation(recorded, drawn)[0] <= 0.1
    assert ends(drawn, recorded) <= 0.05
    assert not warnings(said)


@pytest.mark.slow
def test_two_hundred_waves_keep_their_height_by_ridge(lab):
    document, _, drawn, recorded = learned(lab, "waves", "--regression", "ridge")
    assert abs(height(drawn) - 40.0) <= 0.2
    assert deviation(recorded, drawn)[0] <= 0.1
    assert document["basis"] <= 2000


@pytest.mark.slow
def test_two_hundred_waves_keep_their_height_by_lwr_or_ridge_is_named(lab):
    _, said, drawn, _ = learned(lab, "waves")
    told = re.search(r"--regression ridge reaches RMS .* with N = \d+", said)
    assert abs(height(drawn) - 40.0) <= 0.2 or told


@pytest.mark.slow
@pytest.mark.parametrize("regression", ["lwr", "ridge"])
def test_thirty_letters_are_legible(lab, regression):
    _, _, drawn, recorded = learned(lab, "letters", "--regression", regression)
    assert deviation(recorded, drawn)[0] <= 0.1
    assert ends(drawn, recorded) <= 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("regression", "largest"), [("lwr", 1.0), ("ridge", 0.6)])
def test_thirty_corners_stay_sharp(lab, regression, largest):
    _, _, drawn, recorded = learned(lab, "corners", "--regression", regression)
    rms, most = deviation(recorded, drawn)
    assert rms <= 0.15
    assert most <= largest


@pytest.mark.parametrize("regression", ["lwr", "ridge"])
def test_eleven_samples_are_their_spline(lab, regression):
    _, _, drawn, recorded = learned(lab, "few", "--regression", regression)
    assert deviation(recorded, drawn)[1] <= 0.1
    assert deviation(drawn, cases.wave(np.linspace(0, 1, 2001), 100, 20))[1] <= 0.1
    assert ends(drawn, recorded) <= 0.05


# What it was taught on: walls, lifts, leaning tools.


@pytest.mark.parametrize("lean", [-3, -1, 1, 3])
def test_a_wall_that_leans_gives_the_same_wave(lab, lean):
    skill, _ = lab.fit(f"wall{lean}", tables=[cases.wall(lean)])
    at = pair([500, 0, 0], [800, 0, 0])
    drawn, _ = lab.draw(skill, *at, "--surface", lab.surface(WALL))
    position = drawn.position()
    assert position[: len(position) // 2, 2].max() == pytest.approx(40.0, abs=0.1)
    assert position[: len(position) // 2, 2].min() >= -0.01
    np.testing.assert_allclose(position[:, 1], 0.0, atol=1e-6)


@pytest.mark.slow
def test_two_walls_that_lean_either_way_are_one_wave(lab):
    skill, said = lab.fit("walls", tables=[cases.wall(-3), cases.wall(3)])
    at = pair([500, 0, 0], [800, 0, 0])
    drawn, _ = lab.draw(skill, *at, "--surface", lab.surface(WALL))
    position = drawn.position()
    # The mean of two walls leaning by 3° is cos 3° of each.
    assert np.ptp(position[:, 2]) == pytest.approx(80.0 * np.cos(np.radians(3.0)), abs=0.2)
    assert position[len(position) // 4, 2] > 0.0
    assert not warnings(said)


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize("leans", [(-3,), (-1,), (1,), (3,), (-3, 3), (3, -3)])
def test_a_closed_letter_on_a_wall_that_leans_is_the_same_letter(lab, leans):
    skill, _ = lab.fit(f"letter{leans}", tables=[cases.wall_letter(lean) for lean in leans])
    at = pair([500, 0, 0], [500, 0, 0])
    drawn, _ = lab.draw(skill, *at, "--surface", lab.surface(WALL))
    position = drawn.position() - [500.0, 0.0, 0.0]
    letter = cases.wall_letter(0.0)[:, 1:4]
    assert deviation(position, letter)[0] <= 0.1
    np.testing.assert_allclose(np.ptp(position, axis=0), [70.0, 0.0, 100.0], atol=0.3)
    # Upwards first, as taught.
    assert position[len(position) // 4, 2] > 20.0


@pytest.mark.slow
@pytest.mark.parametrize("oriented", [False, True])
def test_a_lifted_pen_writes_on_the_plate_and_is_lifted_between(lab, oriented):
    skill, _ = lab.fit(f"lift{oriented}", tables=[cases.pen_lift(oriented)])
    plate = lab.surface(PLATE | {"point": [0, 0, -17]})
    here, there = pair([0, 0, 0], [90, 20, 0]), pair([200, 100, -17], [230, 160, -17])
    for options in (["--reproduce"], here, there, [*there, "--surface", plate]):
        drawn, _ = lab.draw(skill, *options, "--rate", "100")
        z = drawn.position()[:, 2] - drawn.position()[0, 2]
        lift = np.interp(drawn.t, cases.T9, cases.LIFT)
        assert np.abs(z[lift == 0.0]).max() <= 0.1
        assert z.max() == pytest.approx(8.0, abs=0.2)


@pytest.mark.parametrize("goal", [[200, 0, 0], [500, 300, 0]])
def test_a_seam_over_a_hump_rises_wherever_it_leads(lab, goal):
    skill, _ = lab.fit("seam", tables=[cases.seam()])
    drawn, _ = lab.draw(skill, *pair([500, 0, 0], goal))
    z = drawn.position()[:, 2]
    assert z.min() >= -0.01
    assert z.max() == pytest.approx(1.2, abs=0.02)


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("degrees", [-30, 30])
def test_a_tool_held_aslant_tilts_no_plane_and_is_told(lab, degrees, axis):
    skill, said = lab.fit(f"aslant{axis}{degrees}", tables=[cases.aslant(degrees, axis)])
    drawn, _ = lab.draw(skill, *pair([500, 300, 0], [400, 500, 0]))
    np.testing.assert_allclose(drawn.position()[:, 2], 0.0, atol=1e-6)
    assert "leans 30.0° from the normal" in said


def test_a_hop_tilts_no_plane_and_stays_a_hop(lab):
    skill, said = lab.fit("hop", tables=[cases.hop()])
    drawn, _ = lab.draw(skill, *pair([0, 0, 0], [-100, 280, 0]))
    z, t = drawn.position()[:, 2], drawn.t
    down = (t < 2.2) | (t > 3.8)
    assert np.abs(z[down]).max() <= 0.1
    assert z.max() == pytest.approx(5.0, abs=0.2)
    assert not warnings(said)


def test_a_tcp_whose_z_lies_in_the_plate_is_told_with_the_remedy(lab):
    _, said = lab.fit("tip", tables=[cases.tool_in_plate()])
    [line] = warnings(said)
    assert "90° from the tool's axis" in line
    assert "--normal" in line
    named, said = lab.fit("tip", "--normal", 0, 0, 1, tables=[cases.tool_in_plate()])
    drawn, _ = lab.draw(named, *pair([0, 0, 0], [0, 300, 0]))
    assert height(drawn.position()) == pytest.approx(50.0, abs=0.1)
    np.testing.assert_allclose(drawn.position()[:, 2], 0.0, atol=1e-6)
    assert not warnings(said)


def test_a_stroke_taught_just_off_the_surface_is_drawn_in_contact_and_told(lab):
    plate = lab.surface(PLATE)
    skill, said = lab.fit("above", "--surface", plate, tables=[cases.above(0.3)])
    assert "w 0.30 to 0.30 mm" in said
    at = [*pair([0, 0, 0], [300, 0, 0]), "--surface", plate]
    drawn, said = lab.draw(skill, *at)
    np.testing.assert_allclose(drawn.position()[:, 2], 0.0, atol=1e-9)
    assert "taught 0.30 mm off its surface, which is taken off" in said
    drawn, _ = lab.draw(skill, *at, "--contact", 0)
    np.testing.assert_allclose(drawn.position()[:, 2], 0.3, atol=1e-6)


# Timing, rests, noise.


@pytest.mark.slow
def test_one_path_at_four_timings_is_that_path(lab):
    tables = [cases.timing(name) for name in cases.TIMINGS]
    skill, said = lab.fit("timing", tables=tables)
    drawn, _ = lab.draw(skill, "--reproduce")
    assert height(drawn.position()) == pytest.approx(50.0, abs=0.2)
    assert deviation(drawn.position(), PATH)[0] <= 0.2
    assert "timing_3.csv: rests from" in said


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("seed", [7, 8])
def test_idle_ends_are_trimmed_at_any_noise(lab, noise, seed):
    table = cases.idle(noise, np.random.default_rng(seed))
    skill, said = lab.fit(f"idle{noise}{seed}", tables=[table])
    assert json.loads(skill.read_text())["duration"] == pytest.approx(6.0, abs=0.4)
    assert re.search(r"trimmed [67]\.\d+ s and [67]\.\d+ s", said)


@pytest.mark.slow
def test_noise_is_not_drawn(lab):
    share = np.linspace(0.0, 1.0, 2001)
    true = cases.wave(cases.jerk(share))
    peak = np.linalg.norm(np.gradient(np.gradient(true, 0.003, axis=0), 0.003, axis=0), axis=1)
    missed = []
    for seed in range(8):
        table = cases.noisy(0.5, np.random.default_rng(seed))
        for basis in (80, 300) if seed == 0 else ("auto",):
            skill, _ = lab.fit(f"noisy{seed}", "--basis", basis, tables=[table])
            drawn, _ = lab.draw(skill, "--reproduce", "--rate", "200")
            position = drawn.position()
            acceleration = np.gradient(np.gradient(position, 0.005, axis=0), 0.005, axis=0)
            assert np.linalg.norm(acceleration, axis=1)[2:-2].max() <= 1.5 * peak.max()
            assert deviation(position, PATH)[0] <= 0.15
        missed += list(np.linalg.norm(position[[0, -1]] - PATH[[0, -1]], axis=1))
    assert np.median(missed) <= 0.4
    assert np.quantile(missed, 0.9) <= 0.75
    assert max(missed) <= 1.2


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_uneven_stamps_never_overshoot(lab, seed):
    table = cases.uneven(np.random.default_rng(seed))
    skill, said = lab.fit(f"uneven{seed}", tables=[table])
    drawn, _ = lab.draw(skill, "--reproduce", "--rate", "200")
    assert deviation(drawn.position(), table[:, 1:4])[1] <= 0.4
    assert "stamps come in bursts" in said


MADE = {
    "filtered": lambda: cases.filtered(0.3, 10.0, np.random.default_rng(7)),
    "quantised": lambda: cases.quantised(0.5),
    "interpolated": lambda: cases.interpolated(0.3, np.random.default_rng(7)),
}


@pytest.mark.slow
@pytest.mark.parametrize("made", MADE)
def test_noise_of_part_of_the_band_is_told_and_its_remedy_smooths(lab, made):
    table = MADE[made]()
    _, said = lab.fit(made, tables=[table])
    cutoff = re.search(r"--cutoff (\S+)", said)
    assert cutoff, said
    skill, _ = lab.fit(made, "--cutoff", cutoff[1], tables=[table])
    drawn, _ = lab.draw(skill, "--reproduce", "--rate", "200")
    position = drawn.position()
    acceleration = np.gradient(np.gradient(position, 0.005, axis=0), 0.005, axis=0)
    # The true one is 84 mm/s²; but for the ends, where nothing smooths but what lies beside them.
    inner = len(acceleration) // 20
    assert np.linalg.norm(acceleration, axis=1)[inner:-inner].max() <= 1.5 * 84.0
    assert deviation(position, PATH)[0] <= 0.3


def _told_of_the_band(said):
    """Frequency, RMS and cut-off of the one line that tells what fills a part of the band."""
    words = (
        r"what fills the band up to (\S+) Hz, RMS (\S+) mm, is kept .* --cutoff (\S+) smooths it"
    )
    [line] = [line for line in warnings(said) if "the band" in line]
    return map(float, re.search(words, line).groups())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12, 13])
@pytest.mark.parametrize("frequency", [5.0, 8.0])
def test_filtered_noise_too_large_to_be_believed_is_kept_and_told(lab, frequency, seed):
    """Of 1 % of the extent and more, as handwriting is."""
    table = cases.filtered(12.0, frequency, np.random.default_rng(seed))
    _, said = lab.fit("large", tables=[table])
    up_to, rms, cutoff = _told_of_the_band(said)
    # Within half an octave of where the filter, run twice, passes a half.
    assert 0.7 * frequency <= up_to <= 1.5 * frequency
    noise = table[:, 1:4] - WAVE
    assert rms == pytest.approx(np.sqrt(np.mean(np.sum(noise**2, axis=1))), rel=0.5)
    skill, said = lab.fit("large", "--cutoff", cutoff, tables=[table])
    assert "the band" not in said
    drawn, _ = lab.draw(skill, "--reproduce")
    step = np.diff(drawn.position(), axis=0)
    rough = np.diff(table[:, 1:4], axis=0)
    assert np.linalg.norm(step, axis=1).sum() <= 0.8 * np.linalg.norm(rough, axis=1).sum()


@pytest.mark.sweep(kept=1)
@pytest.mark.parametrize("there", [slice(0, 400), slice(200, None)])
def test_filtered_noise_of_a_part_of_the_recording_is_kept_and_told(lab, there):
    noise = np.zeros((601, 3))
    rng = np.random.default_rng(4)
    noise[there] = (cases.filtered(0.5, 10.0, rng)[:, 1:4] - WAVE)[there]
    noise += rng.normal(0.0, 0.005, noise.shape)
    table = np.column_stack([cases.T6, WAVE + noise])
    skill, said = lab.fit(f"part{there.start}", tables=[table])
    up_to, rms, cutoff = _told_of_the_band(said)
    assert 8.0 <= up_to <= 20.0
    assert 0.1 <= rms <= 0.5
    assert cutoff < up_to
    drawn, _ = lab.draw(skill, "--reproduce")
    assert deviation(table[:, 1:4], drawn.position())[0] <= 0.1
    _, said = lab.fit(f"part{there.start}", "--cutoff", cutoff, tables=[table])
    assert "the band" not in said
    # Above the noise it smooths nothing of it.
    _, said = lab.fit(f"part{there.start}", "--cutoff", 40, tables=[table])
    assert "the band" in said


def test_irregular_handwriting_that_fills_a_band_is_kept_and_told(lab):
    """Its spectrum is that of filtered noise: only who wrote it knows."""
    t, points = recordings.handwriting_and_lines(15, glyphs=40)
    points = recordings.noisy(points, 0.05, 15)
    skill, said = lab.fit("written", tables=[np.column_stack([t, points])])
    assert _told_of_the_band(said)
    drawn, _ = lab.draw(skill, "--reproduce")
    assert deviation(points, drawn.position())[0] <= 0.15


@pytest.mark.parametrize("name", ["letters", "corners", "pen_lift", "seam"])
def test_what_no_stroke_lacks_is_not_told_of_its_band(lab, name):
    _, said = lab.fit(name, tables=[getattr(cases, name)()])
    assert "the band" not in said


# Parts of a recording that belong to no stroke.


@pytest.mark.slow
def test_a_pause_is_told_with_its_times_and_cut_on_request(lab):
    _, said, _, _ = learned(lab, "pause", seed=7)
    [line] = warnings(said)
    begin, end = map(float, re.search(r"rests (\S+) to (\S+) s", line).groups())
    assert begin == pytest.approx(3.0, abs=0.1)
    assert end == pytest.approx(8.0, abs=0.1)
    assert "--cut-pauses" in line
    document, said, drawn, _ = learned(lab, "pause", "--cut-pauses", seed=7)
    assert height(drawn) == pytest.approx(50.0, abs=0.2)
    assert deviation(drawn, PATH)[0] <= 0.1
    assert document["duration"] == pytest.approx(6.0, abs=0.2)
    assert not warnings(said)


@pytest.mark.slow
def test_approach_and_retract_are_told_with_the_times_to_cut_at(lab):
    _, said, _, _ = learned(lab, "approach")
    start = float(re.search(r"--from (\S+) leaves it out", said)[1])
    until = float(re.search(r"--until (\S+) leaves it out", said)[1])
    assert start == pytest.approx(2.0, abs=0.1)
    assert until == pytest.approx(8.0, abs=0.1)
    options = ["--from", start, "--until", until]
    _, said, drawn, _ = learned(lab, "approach", *options)
    assert height(drawn) == pytest.approx(50.0, abs=0.2)
    assert deviation(drawn, PATH)[0] <= 0.1
    assert not warnings(said)


def test_a_retract_alone_is_told(lab):
    _, said, _, _ = learned(lab, "retract")
    assert "approach" not in said
    until = re.search(r"--until (\S+) leaves it out", said)[1]
    _, said, drawn, _ = learned(lab, "retract", "--until", until)
    assert height(drawn) == pytest.approx(50.0, abs=0.2)
    assert not warnings(said)


@pytest.mark.parametrize("after", [1.5, 3600.0])
def test_a_gap_outside_of_what_is_asked_for_is_no_matter(lab, after):
    """A recorder that ran before the stroke, stood still, and ran on after it."""
    before = np.column_stack([np.arange(50) / 100.0, np.zeros((50, 2)), np.full(50, 80.0)])
    stroke = np.column_stack([np.linspace(2.0, 8.0, len(WAVE)), WAVE])
    later = before + [8.0 + after, 0.0, 0.0, 0.0]
    rows = np.concatenate([before, stroke, later])
    file = cases.write(lab.folder / f"gaps_{after}.csv", rows)
    done = lab.run("fit", file, "-o", lab.folder / "gaps.json")
    assert done.exit_code == 2
    assert "nothing was recorded" in done.stderr
    skill, said = lab.fit(f"gaps_{after}", "--from", 2.0, "--until", 8.0, tables=[rows])
    assert not warnings(said)
    drawn, _ = lab.draw(skill, *pair([0, 0, 0], [300, 0, 0]))
    assert deviation(drawn.position(), PATH)[0] <= 0.05
    assert json.loads(skill.read_text())["duration"] == pytest.approx(6.0, abs=0.05)


# Nearly closed.


def test_a_nearly_closed_stroke_tells_its_stretch_and_refuses_twice_of_it(lab):
    table = cases.nearly_closed()
    skill, _ = lab.fit("nearly", tables=[table])
    gap = table[-1, 1:4] - table[0, 1:4]
    drawn, said = lab.draw(skill, *pair([0, 0, 0], gap))
    assert deviation(drawn.position(), table[:, 1:4] - table[0, 1:4])[0] <= 0.1
    assert "stretched" not in said
    _, said = lab.draw(skill, *pair([0, 0, 0], 1.5 * gap))
    assert "stretched along start-goal by 1.5" in said
    for factor in (2.0, 3.0):
        said = lab.refusal(skill, *pair([0, 0, 0], factor * gap))
        assert "--allow-stretch" in said
    _, said = lab.draw(skill, *pair([0, 0, 0], 2 * gap), "--allow-stretch")
    assert "stretched along start-goal by 2" in said


# Taught on a curved part.


SADDLE = fields.saddle()
STEPS = 30
"""Of Runge and Kutta's fourth order: 1e-6 mm on this saddle."""
BOW, CONVEX, DRUM = (
    {"point": [0, 0, z], "axis": [0, 1, 0], "radius": abs(z)} for z in (600, -600, -60)
)


@pytest.fixture(scope="module")
def saddle(lab):
    path = lab.folder / "saddle.stl"
    path.write_bytes(meshes.written(*fields.square(SADDLE, 20_000), "stl"))
    return path


def unrolled(position):
    """Coordinates u, v (T, 2) along and across the saddle's geodesic from first to last point.

    By Newton steps on the strip's own Runge-Kutta walks, none of them ours.
    """
    start, chord = position[0, :2], position[-1] - position[0]
    aim = np.array([np.arctan2(chord[1], chord[0]), np.linalg.norm(chord)])

    def strip(first, uv):
        flat = np.column_stack([uv, 0.0 * uv[:, 0]])
        return SADDLE.strip(start[None], first[None], flat[None], STEPS)[0][0]

    def newton(of, z, goal):
        for _ in range(6):
            here = of(z)
            slopes = np.stack([(of(z + d) - here) / 1e-5 for d in 1e-5 * np.eye(2)], axis=-1)
            z = z + np.linalg.solve(slopes, (goal - here)[..., None])[..., 0]
        return z

    def arrival(z):
        first = np.stack([SADDLE.tangent(start, a) for a in z[:, 0]])
        return SADDLE.walk(np.tile(start, (len(z), 1)), first, z[:, 1], STEPS)[0]

    aim = newton(arrival, aim[None], position[-1:, :2])[0]
    first = SADDLE.tangent(start, aim[0])
    turn = np.array([[np.cos(aim[0]), -np.sin(aim[0])], [np.sin(aim[0]), np.cos(aim[0])]])
    guess = (position[:, :2] - start) @ turn
    return newton(lambda uv: strip(first, uv)[:, :2], guess, position[:, :2])


def on_drum(uv, radius):
    """Points (T, 3) of a strip about the top of a cylinder along y, beginning at angle 0."""
    angle = uv[:, 0] / radius
    return np.column_stack([radius * np.sin(angle), uv[:, 1], radius * np.cos(angle) - radius])


def on_saddle(uv):
    """Points (T, 3) of a strip along the saddle's x axis, which is a geodesic, from x = -50 on."""
    start = np.array([-50.0, 0.0])
    flat = np.column_stack([uv, 0.0 * uv[:, 0]])
    first = SADDLE.tangent(start, 0.0)
    return SADDLE.strip(start[None], first[None], flat[None], STEPS)[0][0]


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("taught", ["on_saddle 0", "on_saddle 40", "on_bow 600", "on_bow -600"])
def test_what_is_taught_on_a_curved_part_is_drawn_on_any(lab, saddle, taught):
    kind, number = taught.split()
    table = getattr(cases, kind)(float(number))
    recorded = table[::3, 1:4]
    if kind == "on_saddle":
        surface, uv = saddle, unrolled(recorded)
    else:
        surface = lab.surface(BOW if number == "600" else CONVEX)
        R, x = 600.0, recorded[:, 0]
        uv = np.column_stack([R * (np.arcsin(x / R) - np.arcsin(x[0] / R)), recorded[:, 1]])
    options = ["--regression", "ridge", "--surface", surface]
    skill, said = lab.fit(taught.replace(" ", ""), *options, tables=[table])
    assert not warnings(said)
    flat = np.column_stack([uv, 0.0 * uv[:, 0]])
    for on, truth in (
        (lab.surface(PLATE), flat),
        (lab.surface(DRUM), on_drum(uv, 60.0)),
        (saddle, on_saddle(uv)),
    ):
        drawn, said = lab.draw(skill, *pair(truth[0], truth[-1]), "--surface", on)
        assert deviation(drawn.position(), truth)[1] <= 0.1
        assert not warnings(said)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["on_saddle 0", "on_saddle 40", "on_bow 600"])
def test_what_would_dig_into_another_surface_is_refused_with_remedies(lab, name):
    kind, number = name.split()
    table = getattr(cases, kind)(float(number))
    skill, said = lab.fit(name.replace(" ", ""), tables=[table])
    assert "lies in one plane: it was taught on a curved part" in said
    at = pair([-50, 0, 0], [59, 0, 0])
    plate = lab.surface(PLATE)
    said = lab.refusal(skill, *at, "--surface", plate)
    depth = float(re.search(r"would go (\S+) mm into", said)[1])
    assert depth > 1.0
    assert all(remedy in said for remedy in ("fit --surface", "--contact", "--offset"))
    lifted, _ = lab.draw(skill, *at, "--surface", plate, "--offset", depth + 0.01)
    assert lifted.position()[:, 2].min() >= 0.0


def test_a_convex_sheet_drawn_on_a_plate_is_told_to_hover(lab):
    skill, said = lab.fit("convex", tables=[cases.on_bow(-600)])
    assert "it was taught on a curved part" in said
    drawn, said = lab.draw(skill, *pair([-50, 0, 0], [59, 0, 0]), "--surface", lab.surface(PLATE))
    assert drawn.position()[:, 2].min() >= -1e-9
    [line] = warnings(said)
    assert "of the stroke touches the surface" in line
    assert "fit --surface" in line


@pytest.mark.slow
@pytest.mark.parametrize("oriented", [True, False])
def test_a_stroke_taught_on_one_flank_of_a_cylinder_is_drawn_on_its_outside_everywhere(
    lab, oriented
):
    drum = lab.surface(DRUM)
    uv = cases.wave(cases.U6, 50.0, 30.0)[:, :2]
    angle = (uv[:, 0] - 90.0) / 60.0
    tool = cases.turned_about_y(angle) if oriented else None
    table = cases.recording(cases.T6, on_drum(uv - [90.0, 0.0], 60.0), tool)
    skill, _ = lab.fit(f"flank{oriented}", "--surface", drum, tables=[table])
    for shift in (-90.0, -20.0, 60.0, 130.0):
        truth = on_drum(uv + [shift, 0.0], 60.0)
        drawn, _ = lab.draw(skill, *pair(truth[0], truth[-1]), "--surface", drum)
        assert deviation(drawn.position(), truth)[1] <= 0.1
        outward = drawn.position() - [0.0, 0.0, -60.0]
        assert np.all(np.sum(outward * drawn.stack(["nx", "ny", "nz"]), axis=1) > 0.0)
