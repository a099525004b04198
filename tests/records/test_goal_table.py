import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.records import goal_table
from dmpcli.records.file_io import Source


def read(text):
    return goal_table.read(Source("goals.csv", text.encode()))


def test_times_and_goals_are_read():
    t, goals = read("x,t,z,y\n1,0,3,2\n4,0.5,6,5\n")
    np.testing.assert_array_equal(t, [0.0, 0.5])
    np.testing.assert_array_equal(goals, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,x,y\n0,1,2\n", "column 'z' is missing"),
        ("t,x,y,z\n0,1,2,nan\n", "not a finite number"),
        ("t,x,y,z\n1,1,2,3\n0.5,1,2,3\n", "line 3: t goes back"),
        ("t,x,y,z,rz\n1,1,2,3,0\n", "turns no tool"),
    ],
)
def test_what_is_wrong_is_named(text, said):
    with pytest.raises(InputError, match=said):
        read(text)
