"""Forms of rotation against scipy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.records import rotation_forms
from dmpcli.records.rotation_forms import MATRIX_NAMES, ORDERS

angles = st.lists(st.floats(-3.2, 3.2), min_size=3, max_size=3)


def test_there_are_the_twenty_four_orders():
    assert len(set(ORDERS)) == 24


@pytest.mark.slow
@given(st.sampled_from(ORDERS), angles)
def test_any_order_gives_the_product_of_its_turns(order, turns):
    R = rotation_forms.matrices(order, np.array([turns]))[0]
    expected = np.eye(3)
    proper = len(set(order.lower())) == 2
    for place, axis in enumerate(order):
        angle = turns[place] if proper else turns["xyz".index(axis.lower())]
        turn = Rotation.from_rotvec(angle * np.eye(3)["xyz".index(axis.lower())]).as_matrix()
        # About the tool's own axes each turn comes from the right, about the base's from the left.
        expected = expected @ turn if order.isupper() else turn @ expected
    np.testing.assert_allclose(R, expected, atol=1e-12)


@pytest.mark.slow
@given(angles)
def test_an_extrinsic_order_is_the_intrinsic_one_backward(turns):
    values = np.array([turns])
    for order in ("xyz", "zyx", "yxz"):
        np.testing.assert_allclose(
            rotation_forms.matrices(order, values),
            rotation_forms.matrices(order[::-1].upper(), values),
            atol=1e-12,
        )


@pytest.mark.slow
@given(angles)
def test_words_are_orders(turns):
    values = np.array([turns])
    for word, order in (("euler", "XYZ"), ("rpy", "xyz"), ("rpy", "ZYX")):
        np.testing.assert_allclose(
            rotation_forms.matrices(word, values),
            rotation_forms.matrices(order, values),
            atol=1e-12,
        )


@pytest.mark.slow
@given(angles)
def test_vectors_quaternions_and_matrices_are_scipys(turns):
    R = Rotation.from_rotvec([turns])
    for form, values in (
        ("rotvec", np.array([turns])),
        ("quaternion", R.as_quat()),
        ("matrix", R.as_matrix().reshape(1, 9)),
    ):
        assert rotation_forms.wrong(form, values) is None
        np.testing.assert_allclose(rotation_forms.matrices(form, values), R.as_matrix(), atol=1e-12)
    assert len(MATRIX_NAMES) == 9


@given(st.text(max_size=12))
def test_any_word_is_a_form_or_refused(word):
    try:
        rotation_forms.check(word)
    except InputError as error:
        assert "must be one of" in str(error)
    else:
        assert rotation_forms.described(word)
        assert rotation_forms.columns_of(word)


def test_what_is_no_rotation_is_found_by_row():
    good = np.tile([0.0, 0.0, 0.0, 1.0], (5, 1))
    good[3] = [0, 0, 0, 1.2]
    assert rotation_forms.wrong("xyzw", good) == (3, "the quaternion has norm 1.2, not 1")
    mirror = np.tile(np.eye(3).ravel(), (3, 1))
    mirror[1, 8] = -1.0
    assert rotation_forms.wrong("matrix", mirror) == (1, "is no rotation matrix")


@pytest.mark.parametrize("degrees", [0.0, 3.1, 90.0, 179.0])
def test_the_lean_is_the_angle_from_straight_down(degrees):
    R = Rotation.from_euler("x", 180.0 - degrees, degrees=True).as_matrix()
    assert rotation_forms.lean(R) == pytest.approx(degrees, abs=1e-9)


@pytest.mark.parametrize("size", [1e30, 1e200, np.inf, np.nan])
@pytest.mark.parametrize(("form", "width"), [("quaternion", 4), ("wxyz", 4), ("matrix", 9)])
def test_numbers_of_any_size_are_no_rotation_and_no_warning(form, width, size):
    values = np.zeros((2, width))
    values[:, [0, 4, 8] if width == 9 else [0]] = 1.0
    values[1, 1] = size
    row, _ = rotation_forms.wrong(form, values)
    assert row == 1
