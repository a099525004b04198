"""What other programs say of our files."""

import numpy as np
import pytest

from dmpcli.formats import polylines, rapid, tum
from dmpcli.formats.toolpath import ProgramOptions
from tests.formats.motions import motion, wave
from tests.outside_judge import judge

OLD_NAMES = pytest.mark.filterwarnings("ignore:.* deprecated:DeprecationWarning")
"""rapidchecker calls pyparsing by names that it warns of."""


@OLD_NAMES
@pytest.mark.parametrize("options", [ProgramOptions(), ProgramOptions(lift=0.0, lines=4)])
def test_rapidchecker_parses_our_rapid(options):
    from rapidchecker.check import check_format

    text = rapid.encode(
        motion(wave(samples=5), wave(samples=4, name="b")), options, "wave"
    ).decode()
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
