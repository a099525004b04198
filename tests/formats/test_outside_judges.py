"""What other programs say of our files."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dmpcli.formats import gcode, polylines, rapid, tum
from dmpcli.formats.toolpath import ProgramOptions
from dmpcli.records.file_io import Source
from dmpcli.spatial.output_events import OutputEvent
from tests.formats.motions import motion, wave
from tests.outside_judge import interpreted, judge, judged_by_linuxcnc

OLD_NAMES = pytest.mark.filterwarnings("ignore:.* deprecated:DeprecationWarning")
"""rapidchecker calls pyparsing by names that it warns of."""


@pytest.mark.thorough
@OLD_NAMES
@pytest.mark.parametrize("options", [ProgramOptions(), ProgramOptions(lift=0.0, lines=4)])
def test_rapidchecker_parses_our_rapid(options):
    from rapidchecker.check import check_format

    text = rapid.encode(
        motion(wave(samples=5), wave(samples=4, name="b")), options, "wave"
    ).decode()
    assert not check_format(text)


@pytest.mark.thorough
@OLD_NAMES
def test_rapidchecker_parses_the_outputs_that_our_rapid_switches():
    from rapidchecker.check import check_format

    events = tuple(OutputEvent(t, "DO1", on=t < 2.0) for t in (0.0, 1.2345, 3.0, 4.0))
    one = replace(wave(samples=9), events=events)
    text = rapid.encode(motion(one), ProgramOptions(), "wave").decode()
    assert "MoveLDO" in text
    assert not check_format(text)


@OLD_NAMES
def test_rapidchecker_would_tell_what_is_no_rapid():
    from rapidchecker.check import check_format

    text = rapid.encode(motion(wave(samples=4)), ProgramOptions(), "wave").decode()
    assert check_format(text.replace("ENDPROC", "ENDFOR", 1))


@judge("evo", "evo")
def test_evo_reads_our_tum_with_the_same_path_length(tmp_path):
    from evo.tools import file_interface

    one = wave()
    path = tmp_path / "wave.tum"
    path.write_bytes(tum.encode(motion(one)))
    found = file_interface.read_tum_trajectory_file(str(path))
    length = np.linalg.norm(np.diff(one.position, axis=0), axis=1).sum() / 1000
    assert abs(found.path_length - length) < 1e-6
    for ours, theirs in zip(one.rotation, found.poses_se3, strict=True):
        np.testing.assert_allclose(theirs[:3, :3], ours, atol=1e-9)


@judge("pymeshlab", "pymeshlab")
@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_meshlab_reads_our_polylines(tmp_path, suffix):
    import pymeshlab

    path = tmp_path / f"wave.{suffix}"
    encode = polylines.encode_ply if suffix == "ply" else polylines.encode_obj
    path.write_bytes(encode(motion(wave())))
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    assert (mesh.vertex_number(), mesh.edge_number()) == (201, 200)


@judged_by_linuxcnc()
def test_linuxcnc_runs_our_gcode_along_the_same_points(tmp_path):
    strokes = [wave(turning=False), wave(turning=False, offset=200.0, name="b")]
    options = ProgramOptions(tilt=np.radians(30.0))
    done = interpreted(gcode.encode(motion(*strokes), options), tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "PROGRAM_END()" in done.stdout
    fed = re.findall(r"STRAIGHT_FEED\(([^)]*)\)", done.stdout)
    points = np.array([[float(v) for v in found.split(",")[:3]] for found in fed])
    back = gcode.decode(Source("wave.ngc", gcode.encode(motion(*strokes), options)), 0.05, 50.0)
    ours = np.concatenate([one.position for one in back])
    assert len(points) == len(ours)
    np.testing.assert_allclose(points, ours, atol=1e-4)
    bad = interpreted(b"G21 G1 X1 F10\nG1 Q5\nM2\n", tmp_path)
    assert bad.returncode != 0
