import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.instruments.address import Address
from dmpcli.instruments.netft import NetFtSensor, make, options
from dmpcli.instruments.netft.options import NetFtOptions
from dmpcli.instruments.netft.settings import Scale


def read(**given):
    return options.read(Address("sensor", "netft", "192.168.1.1", None, given))


def test_without_options_the_box_is_asked_for_everything():
    assert read() == NetFtOptions()


def test_every_option_is_read():
    read_options = read(
        dialect="axia",
        http="8080",
        tcp="5000",
        counts="1000,2000",
        force="lbf",
        torque="lbf-in",
        rate="keep",
        buffered="yes",
        bias="1",
        filter="12",
    )
    assert read_options == NetFtOptions(
        dialect="axia",
        http=8080,
        tcp=5000,
        scale=Scale(1000.0, 2000.0, "lbf", "lbf-in"),
        keep_rate=True,
        buffered=True,
        bias=True,
        filter=12,
    )


@pytest.mark.parametrize(
    ("text", "limit"),
    [("145,145,290,5,5,5", [145, 145, 290, 5, 5, 5]), ("200,10", [200, 200, 200, 10, 10, 10])],
)
def test_a_range_has_six_numbers_or_two(text, limit):
    np.testing.assert_array_equal(read(range=text).range, limit)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("dialect", "robotiq"),
        ("http", "0"),
        ("http", "65536"),
        ("http", "http"),
        ("tcp", "-1"),
        ("range", "1,2,3"),
        ("range", "1,2,3,4,5,0"),
        ("range", "1,2,3,4,5,nan"),
        ("range", "1;2"),
        ("range", ""),
        ("counts", "1000000"),
        ("counts", "1e6,-1e6"),
        ("counts", "1e6,inf"),
        ("force", "stone"),
        ("torque", "N"),
        ("rate", "1000"),
        ("buffered", "40"),
        ("bias", "maybe"),
        ("filter", "13"),
        ("filter", "73 Hz"),
        ("speed", "1"),
        ("", ""),
    ],
)
def test_a_wrong_option_is_refused_by_name(key, text):
    with pytest.raises(InputError, match=rf"^--sensor netft://192\.168\.1\.1: {key}"):
        read(**{key: text})


def test_units_are_of_use_with_counts_only():
    with pytest.raises(InputError, match="force: is the unit of counts"):
        read(force="lbf")


@pytest.mark.parametrize("given", [{"rate": "keep"}, {"buffered": "yes"}, {"filter": "7"}])
def test_what_an_onrobot_box_does_not_have_is_refused(given):
    with pytest.raises(InputError, match=next(iter(given))):
        read(dialect="onrobot", **given)


def test_the_factory_reads_the_options_before_anything_is_opened():
    address = Address("sensor", "netft", "192.0.2.1", None, {"bias": "perhaps"})
    with pytest.raises(InputError, match="bias"):
        make(address, None)
    assert isinstance(make(Address("sensor", "netft", "192.0.2.1"), None), NetFtSensor)
