"""Robot programs: what they say by an independent reading, and that ours reads them back."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.formats import gcode, krl, rapid, urscript
from dmpcli.formats.motion import MotionStroke
from dmpcli.formats.toolpath import ProgramOptions, thinned
from dmpcli.records.file_io import Source
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.wrench import Tool
from tests.formats.motions import along, angle_between, motion, wave

LANGUAGES = {"urscript": urscript, "krl": krl, "rapid": rapid}
NUMBER = r"[-+]?\d+\.?\d*"
TOOL = Tool(
    np.array([1.0, -2.0, 150.5]),
    Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]).as_matrix(),
    np.array([0.0, 0.0, 30.0]),
    Rotation.from_euler("z", 90, degrees=True).as_matrix(),
    9.80665,
    np.array([10.0, 0.0, 40.0]),
)


def program(language, options=None, *strokes):
    text = LANGUAGES[language].encode(motion(*strokes), options or ProgramOptions(), "wave")
    return text.decode()


def read(language, text):
    return LANGUAGES[language].decode(Source(f"wave.{language}", text.encode()))


def groups(text, pattern):
    return np.array([[float(v) for v in re.findall(NUMBER, found)] for found in
                     re.findall(pattern, text)])  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("thin", [0.0, 0.005])
def test_a_program_comes_back_within_a_hundredth_of_mm_and_degree(language, thin):
    one = wave()
    (back,) = read(language, program(language, ProgramOptions(tolerance=thin), one))
    assert abs(back.t[-1] - (one.t[-1] - one.t[0])) < 2e-3
    position, R = along(one.t - one.t[0], back)
    np.testing.assert_allclose(position, one.position, atol=0.01)
    assert np.degrees(angle_between(R, one.rotation).max()) < 0.01
    np.testing.assert_allclose(back.position[[0, -1]], one.position[[0, -1]], atol=1e-4)


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_strokes_of_a_program_keep_their_names_and_places(language):
    one, two = wave(samples=40, name="a-1"), wave(samples=50, offset=200.0, name="b")
    back = read(language, program(language, None, one, two))
    assert [s.id for s in back] == ["a-1", "b"]
    np.testing.assert_allclose(back[1].position[0], two.position[0], atol=1e-4)


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_pause_and_a_turn_in_place_keep_their_seconds(language):
    t = np.array([0.0, 1.0, 3.5, 4.0, 5.0])
    x = np.array([0.0, 10.0, 10.0, 10.0, 20.0])
    R = Rotation.from_euler("x", [[180], [180], [180], [170], [170]], degrees=True).as_matrix()
    one = MotionStroke(t, np.column_stack([500 + x, 0 * x, 0 * x]), R)
    (back,) = read(language, program(language, ProgramOptions(tolerance=0.0), one))
    np.testing.assert_allclose(back.t, t, atol=1e-5)
    assert np.degrees(angle_between(back.rotation, R).max()) < 1e-4


SWITCHED = (
    OutputEvent(0.0, "DO1", on=True),
    OutputEvent(1.2345, "DO2", on=True),
    OutputEvent(2.5, "DO1", on=False),
    OutputEvent(2.5, "DO2", on=False),
    OutputEvent(3.9, "DO1", on=True),
    OutputEvent(4.0, "DO1", on=False),
)


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("lines", [1000, 12])
def test_outputs_come_back_at_their_places(language, lines):
    one = replace(wave(), events=SWITCHED)
    (back,) = read(language, program(language, ProgramOptions(lines=lines), one))
    assert [event.deed for event in back.events] == [event.deed for event in SWITCHED]
    there, _ = along([event.t for event in SWITCHED], one)
    found, _ = along([event.t for event in back.events], back)
    np.testing.assert_allclose(found, there, atol=0.01)
    times = [event.t for event in back.events]
    np.testing.assert_allclose(times, [event.t for event in SWITCHED], atol=2e-3)


WORDS = {
    "urscript": (
        r"# stroke 1\n\s+set_standard_digital_out\(1, True\)",
        r"movel\(.*r=[\d.]+\)\n\s+set_standard_digital_out\(2, True\)",
        r"set_standard_digital_out\(1, False\)\n\s+# end of stroke",
    ),
    "krl": (
        r";stroke 1\n\$OUT\[1\]=TRUE",
        r"TRIGGER WHEN DISTANCE=1 DELAY=0 DO \$OUT\[2\]=TRUE\nLIN .*C_DIS",
        r"LIN [^\n]*\}\n\$OUT\[1\]=FALSE\n;end of stroke",
    ),
    "rapid": (
        r"! stroke 1\n\s+SetDO DO1, 1;",
        r"MoveLDO .*, \[[\d.]+,500,5000,1000\], \[FALSE,.*\\WObj:=wobj0, DO2, 1;",
        r"fine, tStroke\\WObj:=wobj0;\n\s+SetDO DO1, 0;\n\s+! end of stroke",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
def test_outputs_are_in_the_words_of_each_language(language):
    text = program(language, None, replace(wave(), events=SWITCHED))
    for pattern in WORDS[language]:
        assert re.search(pattern, text), pattern


@pytest.mark.parametrize(("language", "words"), [("urscript", "URScript"), ("krl", "KRL")])
def test_an_output_that_a_language_cannot_name_is_refused(language, words):
    one = replace(wave(), events=(OutputEvent(0.0, "glue", on=True),))
    with pytest.raises(InputError, match=f"output glue: {words} numbers its outputs"):
        program(language, None, one)


def test_other_spellings_of_outputs_are_read():
    text = program("rapid", None, replace(wave(), events=SWITCHED[:1]))
    (back,) = read("rapid", text.replace("SetDO DO1, 1;", "Set glue;"))
    assert [event.deed for event in back.events] == ["on glue"]
    text = program("urscript", None, replace(wave(), events=SWITCHED[:1]))
    (back,) = read("urscript", text.replace("set_standard_", "set_tool_"))
    assert [event.output for event in back.events] == ["TO1"]


@pytest.mark.parametrize("language", LANGUAGES)
def test_routines_hold_no_more_lines_than_asked_for(language):
    options = ProgramOptions(tolerance=0.0, lines=50)
    text = program(language, options)
    start, end = {
        "urscript": (r"  def part_\d+\(\):\n", "\n  end"),
        "krl": (r"DEF PART_\d+ \( \)\n", "\nEND"),
        "rapid": (r"  PROC Part_\d+\(\)\n", "\n  ENDPROC"),
    }[language]
    routines = [part.partition(end)[0] for part in re.split(start, text)[1:]]
    assert len(routines) >= 5
    assert max(len(routine.splitlines()) for routine in routines) == 50
    (back,) = read(language, text)
    assert len(back) == 201


def test_urscript_is_metres_and_scipys_rotation_vector():
    one = wave()
    text = program("urscript", ProgramOptions(tolerance=0.0, lift=0.0))
    poses = groups(text, r"p\[([^\]]*)\]")
    np.testing.assert_allclose(poses[:, :3], one.position / 1000, atol=6e-8)
    R = Rotation.from_rotvec(poses[:, 3:]).as_matrix()
    assert angle_between(R, one.rotation).max() < 1e-7
    speeds = groups(text, r"v=(\S+?)[,)]")[1:, 0] * 1000
    legs = np.linalg.norm(np.diff(one.position, axis=0), axis=1) / np.diff(one.t)
    np.testing.assert_allclose(speeds, legs, rtol=1e-3)


def test_krl_is_mm_and_degrees_about_z_y_x():
    one = wave()
    text = program("krl", ProgramOptions(tolerance=0.0, lift=0.0))
    frames = groups(text, r"LIN \{([^}]*)\}")
    np.testing.assert_allclose(frames[:, :3], one.position, atol=6e-5)
    R = Rotation.from_euler("ZYX", frames[:, 3:], degrees=True).as_matrix()
    assert angle_between(R, one.rotation).max() < 1e-6


def test_rapid_is_mm_and_a_quaternion_with_the_scalar_first():
    one = wave()
    text = program("rapid", ProgramOptions(tolerance=0.0, lift=0.0))
    targets = groups(text, r"MoveL \[(\[[^\]]*\],\[[^\]]*\])")
    np.testing.assert_allclose(targets[:, :3], one.position, atol=6e-5)
    R = Rotation.from_quat(targets[:, 3:], scalar_first=True).as_matrix()
    assert angle_between(R, one.rotation).max() < 1e-7


@pytest.mark.parametrize("level", [90.0, -90.0])
def test_krl_survives_its_singular_orientation(level):
    R = Rotation.from_euler("ZYX", [20.0, level, 10.0], degrees=True).as_matrix()
    angles = krl.euler(R[None])
    np.testing.assert_allclose(
        Rotation.from_euler("ZYX", angles[0], degrees=True).as_matrix(), R, atol=1e-9
    )


@pytest.mark.slow
def test_tool_data_stand_in_the_program():
    options = ProgramOptions(tool=TOOL, payload=True)
    # The centre of mass in flange axes: 10 mm along the sensor's x, which is the flange's y.
    (tcp,) = groups(program("urscript", options), r"set_tcp\(p\[([^\]]*)\]")
    np.testing.assert_allclose(tcp[:3], TOOL.tcp_position / 1000)
    np.testing.assert_allclose(
        Rotation.from_rotvec(tcp[3:]).as_matrix(), TOOL.tcp_rotation, atol=1e-7
    )
    assert "set_payload(1, [0, 0.01, 0.07])" in program("urscript", options)
    (frame,) = groups(program("krl", options), r"\$TOOL=\{([^}]*)\}")
    R = Rotation.from_euler("ZYX", frame[3:], degrees=True).as_matrix()
    np.testing.assert_allclose(R, TOOL.tcp_rotation, atol=1e-6)
    assert "$LOAD.M=1\n" in program("krl", options)
    assert "$LOAD.CM={X 0,Y 10,Z 70,A 0,B 0,C 0}" in program("krl", options)
    (data,) = groups(program("rapid", options), r"tooldata tStroke := \[TRUE,(.*)\];")
    np.testing.assert_allclose(data[:3], TOOL.tcp_position)
    R = Rotation.from_quat(data[3:7], scalar_first=True).as_matrix()
    np.testing.assert_allclose(R, TOOL.tcp_rotation, atol=1e-7)
    np.testing.assert_allclose(data[7:11], [1, 0, 10, 70], atol=1e-9)


@pytest.mark.parametrize("language", LANGUAGES)
def test_blends_never_meet_on_a_leg(language):
    text = program(language, ProgramOptions(blend=50.0, tolerance=0.0, lift=0.0), wave(41))
    one = wave(41)
    legs = np.linalg.norm(np.diff(one.position, axis=0), axis=1)
    if language == "krl":
        return  # its radius stands before the move, and only where it changes
    pattern = {"urscript": r", r=(\S+)\)", "rapid": r"z1\\Z:=([\d.]+)"}[language]
    radii = groups(text, pattern)[:, 0] * (1000 if language == "urscript" else 1)
    assert len(radii) == len(legs) - 1
    assert (radii < np.minimum(legs[:-1], legs[1:]) / 2).all()


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_stroke_without_orientation_is_refused_with_the_option(language):
    bare = MotionStroke(np.arange(3.0), np.eye(3))
    with pytest.raises(InputError, match="--orientation"):
        program(language, None, bare)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("language", "line", "words"),
    [
        ("urscript", "movej([0,0,0,0,0,0], a=1)", "movej"),
        ("urscript", "while True:", "while"),
        ("krl", "CIRC {X 1,Y 2,Z 3}, {X 2,Y 3,Z 4}", "CIRC"),
        ("krl", "LIN {X 1,Y 2,Z 3}", "lacks A, B, C"),
        ("rapid", "MoveC p1, p2, v100, z10, tool0;", "MoveC"),
        ("rapid", r"MoveL [[1,2,3],[1,1,0,0],[0,0,0,0],[9E9,9E9]], v100, fine, t;", "norm 1.41"),
    ],
)
def test_a_program_that_does_more_is_refused_with_its_line(language, line, words):
    text = program(language)
    with pytest.raises(InputError, match=rf"line \d+: .*{re.escape(words)}"):
        read(language, text.replace("\n", f"\n{line}\n", 1))


HUGE = {
    "urscript": "movel(p[{0}, 0, 0, 0, 0, 0], a=1, v={1})",
    "krl": "$VEL.CP={1}\nLIN {{X {0},Y 0,Z 0,A 0,B 0,C 0}}",
    "rapid": "MoveL [[{0},0,0],[1,0,0,0],[0,0,0,0],[0,0,0,0,0,0]], v1000\\V:={1}, fine, tool0;",
}


@pytest.mark.parametrize(("place", "speed"), [("1e300", "1"), ("5", "1e-320"), ("5", "1e300")])
@pytest.mark.parametrize("language", LANGUAGES)
def test_numbers_that_are_no_quantities_are_refused_before_anything_overflows(
    language, place, speed
):
    lines = [HUGE[language].format(0, 1), HUGE[language].format(place, speed)]
    text = "\n".join(lines)
    with pytest.raises(InputError, match=rf"line {text.count(chr(10)) + 1}: .* 1e\+30"):
        read(language, text)


@pytest.mark.slow
@given(st.integers(3, 60), st.floats(0.001, 1.0), st.integers(0, 2**32 - 1))
def test_thinning_leaves_nothing_further_off_than_its_tolerance(samples, tolerance, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.01, 0.1, samples))
    position = np.cumsum(rng.normal(0.0, 0.3, (samples, 3)), axis=0)
    R = Rotation.from_rotvec(np.cumsum(rng.normal(0.0, 0.01, (samples, 3)), axis=0)).as_matrix()
    one = MotionStroke(t, position, R)
    kept = thinned(one, tolerance)
    less = MotionStroke(t[kept], position[kept], R[kept])
    at, turned = along(t, less)
    assert np.linalg.norm(at - position, axis=1).max() <= tolerance + 1e-12
    assert 50.0 * angle_between(turned, R).max() <= tolerance + 1e-6


def gprogram(*strokes, **options):
    return gcode.encode(motion(*strokes), ProgramOptions(**options)).decode()


def gread(text, **options):
    return gcode.decode(Source("wave.ngc", text.encode()), **options)


def test_gcode_comes_back_within_a_hundredth_of_a_mm():
    one = wave(turning=False)
    (back,) = gread(gprogram(one))
    position, _ = along(one.t, back)
    np.testing.assert_allclose(position, one.position, atol=0.01)
    assert abs(back.t[-1] - one.t[-1]) < 2e-3


def test_gcode_refuses_a_leaning_tool_with_the_option_that_writes_it():
    with pytest.raises(InputError, match=r"leans 1\d\.\d° .*--tilt (\d+)") as error:
        gprogram(wave())
    tilt = float(re.search(r"--tilt (\d+)", str(error.value))[1])
    assert "G1" in gprogram(wave(), tilt=np.radians(tilt))


ARC = "G21 G90 G17\nG0 X10 Y0 Z5\nG1 Z0 F600\n"


@pytest.mark.parametrize("word", ["I-10 J0", "R10"])
def test_arcs_run_on_their_circle_the_way_they_say(word):
    end = "X0 Y10" if word == "R10" else "X-10 Y0"
    for code, sign in (("G3", 1), ("G2", -1)):
        text = f"{ARC}{code} {end if sign > 0 or word != 'R10' else 'X0 Y-10'} {word}\n"
        (back,) = gread(text, tolerance=0.001)
        arc = back.position[1:]
        np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1]), 10.0, atol=1e-9)
        assert (sign * arc[1:-1, 1] > 0).all()
        length = np.linalg.norm(np.diff(arc, axis=0), axis=1).sum()
        np.testing.assert_allclose(length, 10 * np.pi / (2 if word == "R10" else 1), rtol=1e-3)


def test_gcode_in_inches_and_steps_is_mm():
    (back,) = gread("G20 G91 G0 X1 Y1\nG90 G1 X2 Y1 Z0 F60\nG91 X1\nG21 X10\n")
    # Steps from nowhere lead nowhere: the cut begins with the first place that is known.
    np.testing.assert_allclose(back.position[:, 0], [50.8, 76.2, 86.2])
    np.testing.assert_allclose(np.diff(back.t), [25.4 / 25.4, 10 / 25.4])


@pytest.mark.parametrize(
    ("line", "words"),
    [("G81 X1 Y1 Z-2 R1", "G81"), ("G1 X1 A5", "axis A"), ("G2 X5 Y5", "centre"), ("#1=3", "word")],
)
def test_gcode_that_is_not_read_is_refused_with_its_line(line, words):
    with pytest.raises(InputError, match=rf"line 4: .*{words}"):
        gread(ARC + line + "\n")


def test_travel_before_and_after_the_cut_is_no_part_of_it():
    text = "G21 G90\nG0 X0 Y0 Z9\nG0 X5 Y5\nG1 Z0 F60\nG1 X9\nG0 Z9\nG0 X0 Y0\nM2\n"
    (back,) = gread(text)
    np.testing.assert_allclose(back.position, [[5, 5, 9], [5, 5, 0], [9, 5, 0]])
