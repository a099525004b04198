import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.instruments.netft.settings import (
    READCALINFO,
    BoxInfo,
    Scale,
    calibration_page,
    read_calibration,
    read_pages,
)

FIELDS = {
    "prodname": "Net F/T",
    "setuserfilter": "4",
    "setbias": "0;0;0;0;0;0",
    "cfgnam": "Mini45",
    "cfgcalsel": "2",
    "cfgcpf": "1000000",
    "cfgcpt": "2000000",
    "scfgfu": "N",
    "scfgtu": "N-m",
    "cfgmr": "145;145;290;5;5;5",
    "comrdte": "Enabled",
    "comrdtrate": "1000",
    "comrdtbsiz": "40",
    "runrate": "7000",
}


def page(root="netft", **changes):
    fields = {k: v for k, v in {**FIELDS, **changes}.items() if v is not None}
    body = "".join(f"<{k}>{v}</{k}>" for k, v in fields.items())
    return f"<?xml version='1.0'?>\n<{root}>{body}</{root}>".encode()


def test_a_page_is_read_as_it_stands():
    info = read_pages(page())
    assert (info.product, info.configuration) == ("Net F/T", "Mini45")
    assert info.scale == Scale(1e6, 2e6, "N", "N-m")
    np.testing.assert_array_equal(info.limit, [145, 145, 290, 5, 5, 5])
    assert (info.rate, info.internal_rate, info.records) == (1000.0, 7000.0, 40)
    assert (info.low_pass, info.enabled) == (4, True)


@pytest.mark.parametrize(
    ("unit", "newtons"),
    [("lbf", 4.44822), ("N", 1.0), ("klbf", 4448.22), ("kN", 1000.0), ("kgf", 9.80665)],
)
def test_forces_become_newtons(unit, newtons):
    info = read_pages(page(scfgfu=unit))
    np.testing.assert_allclose(info.scale.per_count[:3], newtons / 1e6, rtol=1e-5)
    np.testing.assert_allclose(info.limit[:3], newtons * np.array([145, 145, 290]), rtol=1e-5)
    np.testing.assert_allclose(info.limit[3:], 5.0)


@pytest.mark.parametrize(
    ("unit", "newton_metres"),
    [
        ("lbf-in", 0.112985),
        ("lbf-ft", 1.355818),
        ("N-m", 1.0),
        ("Nm", 1.0),
        ("N-mm", 1e-3),
        ("Nmm", 1e-3),
        ("kgf-cm", 0.0980665),
        ("kg-cm", 0.0980665),
        ("kN-m", 1e3),
    ],
)
def test_torques_become_newton_metres(unit, newton_metres):
    info = read_pages(page(scfgtu=unit))
    np.testing.assert_allclose(info.scale.per_count[3:], newton_metres / 2e6, rtol=1e-5)
    np.testing.assert_allclose(info.limit[3:], 5.0 * newton_metres, rtol=1e-5)


def test_the_calibrations_page_fills_in_the_scale_and_tells_the_serial_number():
    calibration = (
        b"<netftCalibration><calsn>FT12345</calsn><calcpf>500</calcpf><calcpt>700</calcpt>"
        b"</netftCalibration>"
    )
    info = read_pages(page(cfgcpf=None, cfgcpt="0"), calibration)
    assert info.scale == Scale(500.0, 700.0, "N", "N-m")
    assert info.serial == "FT12345"
    assert read_pages(page(), calibration).scale == Scale(1e6, 2e6, "N", "N-m")
    assert calibration_page(page()) == "/netftcalapi.xml?index=2"
    assert calibration_page(page(cfgcalsel=None)) == "/netftcalapi.xml"


def test_an_axias_converter_rate_is_its_internal_rate():
    assert read_pages(page(setrate="976")).internal_rate == 976.0


@pytest.mark.parametrize("ratings", [None, "", "0;0;0;0;0;0", "145;145;290", "1;2;3;4;5;0"])
def test_a_range_that_is_not_told_is_none(ratings):
    assert read_pages(page(cfgmr=ratings)).limit is None


@pytest.mark.parametrize("text", ["Disabled", "0"])
def test_a_box_whose_stream_is_switched_off_says_so(text):
    assert not read_pages(page(comrdte=text)).enabled


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        (page(cfgcpf=None), "gives no cfgcpf"),
        (page(scfgtu=None), "gives no scfgtu"),
        (page(cfgcpf="a lot"), "cfgcpf = 'a lot'"),
        (page(cfgcpt="nan"), "cfgcpt = 'nan'"),
        (page(cfgcpf="-5"), "counts per force = -5"),
        (page(scfgfu="stone"), "'stone'"),
        (page(cfgmr="1;2;x;4;5;6"), "cfgmr = 'x'"),
        (b"<netft><cfgcpf>1</cfgcpf><cfgcpf>2</cfgcpf></netft>", "cfgcpf stands twice"),
        (b"404 not found", "not XML"),
        (b"", "not XML"),
        (b'<?xml version="1.0" encoding="nonsense"?><a/>', "not XML"),
        (b'<!DOCTYPE a [<!ENTITY b "c">]><netft>&b;</netft>', "document type"),
    ],
)
def test_a_wrong_page_is_refused_by_name(wrong, named):
    with pytest.raises(ValueError, match=named.replace("(", r"\(")):
        read_pages(wrong)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_page_or_a_named_error(content):
    with pytest.raises(ValueError, match=r"."):
        read_pages(content)


@pytest.mark.slow
@given(st.dictionaries(st.sampled_from(sorted(FIELDS)), st.text("0123456789.;-eNxm ", max_size=8)))
def test_any_values_are_a_box_or_a_named_error(changes):
    try:
        info = read_pages(page(**changes))
    except ValueError as error:
        assert str(error)
    else:
        assert isinstance(info, BoxInfo)
        assert np.isfinite(info.scale.per_count).all()
        assert (info.scale.per_count > 0).all()


def test_calibration_info_is_read_from_its_bytes():
    assert bytes.fromhex("01" + 19 * "00") == READCALINFO
    reply = bytes.fromhex("1234 02 03 000f4240 001e8480 0001 0002 0003 0004 0005 0006")
    assert read_calibration(reply) == Scale(1e6, 2e6, "N", "N-m")
    imperial = bytes.fromhex("1234 01 02 00000001 00000002 000000000000000000000000")
    assert read_calibration(imperial) == Scale(1.0, 2.0, "lbf", "lbf-ft")


@pytest.mark.parametrize(
    ("reply", "named"),
    [
        (b"", "0 bytes"),
        (bytes(23), "23 bytes"),
        (bytes(24), "0x0000"),
        (struct.pack(">HBBII12x", 0x1234, 9, 3, 1, 1), "unit 9"),
        (struct.pack(">HBBII12x", 0x1234, 2, 3, 0, 1), "counts per force = 0"),
    ],
)
def test_wrong_calibration_info_is_refused_by_name(reply, named):
    with pytest.raises(ValueError, match=named):
        read_calibration(reply)


@given(
    st.binary(min_size=20, max_size=28)
    | st.binary(min_size=22, max_size=22).map(b"\x12\x34".__add__)
)
def test_any_reply_is_a_scale_or_a_named_error(reply):
    try:
        scale = read_calibration(reply)
    except ValueError as error:
        assert str(error)
    else:
        assert (scale.per_count > 0).all()
