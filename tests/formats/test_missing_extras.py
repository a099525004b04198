"""What needs an extra fails with the line that installs it, and exit code 2."""

import sys

import pytest

from dmpcli.errors import InputError
from dmpcli.formats import mcap_file, ros_bag, svg_paths
from dmpcli.records.file_io import Source
from tests.formats.motions import motion


@pytest.mark.parametrize(
    ("module", "call", "line"),
    [
        (
            "svgelements",
            lambda folder: svg_paths.decode(Source("a.svg", b"<svg/>")),
            "pip install 'dmpcli[svg]'",
        ),
        ("mcap.writer", lambda folder: mcap_file.encode(motion()), "pip install 'dmpcli[ros]'"),
        (
            "rosbags.rosbag2",
            lambda folder: ros_bag.write(motion(), folder / "bag"),
            "pip install 'dmpcli[ros]'",
        ),
    ],
)
def test_a_missing_extra_is_named_with_the_line_that_installs_it(
    monkeypatch, tmp_path, module, call, line
):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError) as error:
        call(tmp_path)
    assert line in str(error.value)
    assert not list(tmp_path.iterdir())
