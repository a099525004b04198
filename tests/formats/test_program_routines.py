"""Programs as a controller runs them: what would run otherwise than it stands is not read."""

import logging
import re

import pytest

from dmpcli.errors import InputError
from dmpcli.formats import krl, rapid, urscript
from dmpcli.records.file_io import Source

QUATERNION = "[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def line(language, x):
    if language == "rapid":
        return rf"MoveL [[{x},0,0],{QUATERNION}, v100, fine, tool0\WObj:=wobj0;"
    if language == "krl":
        return f"LIN {{X {x},Y 0,Z 0,A 0,B 0,C 180}}"
    return f"movel(p[{x / 1000}, 0, 0, 0, 3.14159, 0], a=1, v=0.1)"


def text(language, main, *parts):
    """A program: what its main routine says, and routines of two moves each, by name and start."""
    if language == "rapid":
        calls = [line(language, x) if isinstance(x, int) else f"{x};" for x in main]
        whole = ["MODULE m", "PROC main()", *calls, "ENDPROC"]
        for name, x in parts:
            whole += [f"PROC {name}()", line(language, x), line(language, x + 5), "ENDPROC"]
        return "\n".join([*whole, "ENDMODULE"])
    calls = [line(language, x) if isinstance(x, int) else f"{x}()" for x in main]
    if language == "krl":
        whole = ["DEF m ( )", "$BASE=$ROBROOT", "$VEL.CP=0.1", *calls, "END"]
        for name, x in parts:
            whole += [f"DEF {name} ( )", line(language, x), line(language, x + 5), "END"]
        return "\n".join(whole)
    whole = ["def m():"]
    for name, x in parts:
        whole += [f"def {name}():", line(language, x), line(language, x + 5), "end"]
    return "\n".join([*whole, *calls, "end"])


def read(language, content):
    decode = {"rapid": rapid, "krl": krl, "urscript": urscript}[language].decode
    (stroke,) = decode(Source("program", content.encode()))
    return [round(x) for x in stroke.position[:, 0].tolist()]


every = pytest.mark.parametrize("language", ["rapid", "krl", "urscript"])


@every
def test_routines_that_run_as_they_stand_are_read(language):
    assert read(language, text(language, ["A", "B"], ("A", 0), ("B", 10))) == [0, 5, 10, 15]
    assert read(language, text(language, [0, 7])) == [0, 7]
    assert read(language, text(language, ["a"], ("a", 0))) == [0, 5]


@every
@pytest.mark.parametrize(
    ("main", "parts", "words"),
    [
        (["B", "A"], [("A", 0), ("B", 10)], "stand as a, b and run as b, a"),
        (["A", "A"], [("A", 0)], "stand as a and run as a, a"),
        (["A"], [("A", 0), ("B", 10)], "stand as a, b and run as a; write each once"),
        ([], [("A", 0), ("B", 10)], "stand as a, b and run as none"),
        (["A", "Elsewhere"], [("A", 0)], r"line \d+: routine Elsewhere is not in this file"),
        ([0, "A", 20], [("A", 5)], "A is called between moves"),
        (["A", "B"], [("A", 0), ("A", 10)], "routine A is there twice"),
    ],
)
def test_what_runs_otherwise_than_it_stands_is_refused(language, main, parts, words):
    with pytest.raises(InputError, match=words):
        read(language, text(language, main, *parts))


def test_a_routine_that_calls_itself_is_refused():
    content = text("rapid", ["A"], ("A", 0)).replace("PROC main()", "PROC main()\nmain;")
    with pytest.raises(InputError, match="main is called between moves, or by itself"):
        read("rapid", content)


def test_routines_that_call_one_another_twice_take_no_time():
    names = [f"R{i}" for i in range(60)]
    whole = ["MODULE m", "PROC main()", "R0;", line("rapid", 0), line("rapid", 5), "ENDPROC"]
    for name, called in zip(names, [*names[1:], "Stop"], strict=True):
        whole += [f"PROC {name}()", f"{called};", f"{called};", "ENDPROC"]
    assert read("rapid", "\n".join([*whole, "ENDMODULE"])) == [0, 5]


@pytest.mark.parametrize(
    ("language", "ours", "theirs", "words"),
    [
        ("rapid", "wobj0", "wobjTable", "line 3: positions are in work object wobjTable"),
        ("krl", "$BASE=$ROBROOT", "$BASE=BASE_DATA[3]", r"\$BASE BASE_DATA\[3\], and are taken"),
        ("krl", "$BASE=$ROBROOT", "BAS (#BASE,3)", r"positions are in \$BASE 3"),
        ("krl", "$BASE=$ROBROOT", "$BASE={X 0,Y 0,Z 5,A 0,B 0,C 0}", "Z 5"),
    ],
)
def test_another_frame_than_the_robots_base_is_told(language, ours, theirs, words, caplog):
    content = text(language, [0, 7])
    with caplog.at_level(logging.WARNING, "dmpcli"):
        read(language, content)
        assert not caplog.messages
        read(language, content.replace(ours, theirs))
    (said,) = caplog.messages
    assert re.search(words, said)


@pytest.mark.parametrize("same", ["$NULLFRAME", "{X 0,Y 0,Z 0.0,A 0,B 0,C 0}"])
def test_a_frame_that_is_the_robots_base_is_not_told(same, caplog):
    content = text("krl", [0, 7]).replace("$ROBROOT", same)
    with caplog.at_level(logging.WARNING, "dmpcli"):
        assert read("krl", content) == [0, 7]
    assert not caplog.messages
