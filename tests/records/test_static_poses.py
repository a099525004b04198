import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dmpcli.errors import InputError
from dmpcli.records import static_poses
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance
from dmpcli.records.static_poses import StaticPose
from dmpcli.spatial.rotations import exp


def some_poses(n=5):
    rng = np.random.default_rng(0)
    return [
        StaticPose(
            float(i),
            rng.standard_normal(3),
            exp(rng.standard_normal(3)),
            0.01,
            0.001,
            rng.standard_normal(6),
            np.full(6, 0.02),
            100,
            0.005,
        )
        for i in range(n)
    ]


def encoded(facts=None):
    return static_poses.encode(some_poses(), Provenance("calibrate", facts=facts or {}))


def test_poses_survive_their_file():
    found, facts = static_poses.decode(Source("p", encoded({"sensor": {"make": "mock"}})))
    assert facts == {"sensor": {"make": "mock"}}
    for before, after in zip(some_poses(), found, strict=True):
        np.testing.assert_array_equal(after.position, before.position)
        np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-14)
        np.testing.assert_array_equal(after.wrench, before.wrench)
        assert (after.t, after.samples, after.moved) == (before.t, 100, 0.01)


def test_the_same_poses_give_the_same_bytes():
    assert encoded() == encoded()


def without(*names, **changes):
    table = pq.read_table(Source("p", encoded()).open())
    for name, values in changes.items():
        table = table.set_column(
            table.schema.get_field_index(name), name, pa.array(values, pa.float64())
        )
    table = table.drop_columns(list(names))
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink)
    return Source("p.parquet", sink.getvalue().to_pybytes())


def test_how_it_rested_may_be_left_out():
    found, _ = static_poses.decode(without("moved", "turned", "unsteady", "fx_std"))
    assert {pose.moved for pose in found} == {0.0}
    assert np.isnan(found[0].spread).all()


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (without("rx"), "column 'rx', row 1: no value"),
        (without("tz_raw"), "column 'tz_raw', row 1: no value"),
        (without(fx_raw=[0, 0, None, 0, 0]), "column 'fx_raw', row 3: no value"),
        (without("samples"), "column 'samples' is missing"),
        (Source("p.parquet", json.dumps({}).encode()), "not a Parquet file"),
    ],
)
def test_what_is_missing_is_named(source, words):
    with pytest.raises(InputError, match=words):
        static_poses.decode(source)
