import json
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.instruments.elite import replies
from dmpcli.instruments.elite.replies import BadReplyError, Refusal, ReplyBuffer, result_of
from tests.instruments.elite.scripted import refusal, reply

JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**6), 10**6)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@pytest.mark.slow
@given(st.lists(JSON, min_size=1, max_size=4), st.sampled_from([b"", b"\n", b"\r\n"]), st.data())
def test_replies_are_found_however_the_stream_is_chopped(results, end, data):
    stream = b"".join(reply(result, n, end) for n, result in enumerate(results))
    buffer, found = ReplyBuffer(), []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        buffer.feed(stream[:size])
        stream = stream[size:]
        while (whole := buffer.take()) is not None:
            found.append(result_of(whole, len(found)))
    assert found == results
    assert buffer.empty


@pytest.mark.parametrize("result", ["}", '"}', "\\", '{"a":"}"}', "{", '\\"}', ""])
def test_braces_and_quotes_within_a_text_end_no_reply(result):
    whole = json.dumps({"id": 7, "result": result}).encode()
    for cut in range(1, len(whole)):
        buffer = ReplyBuffer()
        buffer.feed(whole[:cut])
        assert buffer.take() is None
        buffer.feed(whole[cut:] + b"\n")
        assert buffer.take() == whole
        assert buffer.empty


@given(st.binary(max_size=200))
def test_any_bytes_are_a_reply_or_a_fault(data):
    buffer = ReplyBuffer()
    buffer.feed(data)
    try:
        while (whole := buffer.take()) is not None:
            result_of(whole, 1)
    except (BadReplyError, Refusal) as fault:
        assert str(fault)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (b"[1]", "is no JSON object"),
        (b"HTTP/1.1 400 Bad Request\r\n", "is no JSON object"),
        (b'{"id":7,"result":"1",}', "is not JSON in the reply"),
        (b'{"id":7,"result":"\xff"}', "is not JSON in the reply"),
        (b'{"id":7,"id":7,"result":"1"}', "stands twice"),
        (b'{"id":7,"result":NaN}', "NaN is not a number"),
        (b'{"id":7,"result":"NaN"}', "is not JSON in the result: NaN"),
        (b'{"id":7,"result":"[1,Infinity]"}', "Infinity is not a number"),
        (b'{"id":7,"result":"tru"}', "is not JSON in the result"),
        (b'{"id":7,"result":""}', "is not JSON in the result"),
        (b'{"id":7,"result":true}', "a result that is no text"),
        (b'{"id":7,"result":null}', "a result that is no text"),
        (b'{"id":7}', "neither a result nor an error"),
        (b'{"id":7,"result":"1","error":{}}', "or both"),
        (b'{"id":8,"result":"1"}', "answers request 8, not 7"),
        (b'{"id":7.0,"result":"1"}', "answers request 7.0"),
        (b'{"id":"7","result":"1"}', "answers request '7'"),
        (b'{"id":true,"result":"1"}', "answers request True"),
        (b'{"result":"1"}', "answers request None"),
        (b'{"jsonrpc":"1.0","id":7,"result":"1"}', "another protocol"),
        (b'{"id":7,"error":"no"}', "without code and message"),
        (b'{"id":7,"error":{"code":"1","message":"no"}}', "without code and message"),
        (b'{"id":7,"error":{"code":1}}', "without code and message"),
        (b'{"id":7,"result":"' + b"[" * 20000 + b'"}', "is not JSON in the result"),
    ],
)
def test_every_fault_has_its_name(said, words):
    buffer = ReplyBuffer()
    buffer.feed(said)
    with pytest.raises(BadReplyError, match=words):
        result_of(buffer.take(), 7)


def test_a_reply_without_end_is_refused():
    buffer = ReplyBuffer()
    buffer.feed(b'{"result":"' + b"1" * replies.LONGEST)
    with pytest.raises(BadReplyError, match="longer than"):
        buffer.take()


def test_an_error_is_the_controllers_no_with_its_code():
    with pytest.raises(Refusal, match="must be in remote mode") as error:
        result_of(refusal(7), 7)
    assert error.value.code == -32693
    with pytest.raises(Refusal, match="Parse error"):
        result_of(refusal(None, -32700, "Parse error"), 7)
    with pytest.raises(BadReplyError, match="answers request 6"):
        result_of(refusal(6), 7)


@pytest.mark.parametrize("value", [None, 2, -1, 0.5, 1.0, "true", [], [True]])
def test_only_yes_and_no_are_yes_or_no(value):
    with pytest.raises(BadReplyError, match="neither true nor false"):
        replies.boolean(value)
    assert [replies.boolean(v) for v in (True, False, 1, 0)] == [True, False, True, False]


@pytest.mark.parametrize("value", [None, 6, -1, 2.0, True, "2", [2], 10**50])
def test_only_a_whole_number_in_range_is_one(value):
    with pytest.raises(BadReplyError, match="no whole number from 0 to 5"):
        replies.whole(value, 0, 5)
    assert replies.whole(5, 0, 5) == 5


@pytest.mark.parametrize(
    "value",
    [
        None, 1.0, {}, [], [1.0] * 5, [1.0] * 7, [1.0] * 5 + [None], [1.0] * 5 + ["1"],
        [1.0] * 5 + [True], [1.0] * 5 + [721.0], [1.0] * 5 + [-721], [1.0] * 5 + [10**400],
        [1.0] * 5 + [[1.0]],
    ],
)  # fmt: skip
def test_only_six_numbers_in_range_are_joint_angles(value):
    with pytest.raises(BadReplyError, match=r"is no list of 6 numbers|no number within"):
        replies.numbers(value, (6, 8), 720.0)


def test_older_controllers_send_eight():
    assert replies.numbers([1, 2.5, 3, 4, 5, 6, 0, 0], (6, 8), 720.0) == [1, 2.5, 3, 4, 5, 6, 0, 0]


def mutated(rng, said):
    """Truncate, flip, insert, split, join, or replace by another reply."""
    kind = rng.randrange(8)
    at = rng.randrange(len(said))
    if kind == 0:
        return said[:at]
    if kind == 1:
        return said[:at] + bytes([rng.randrange(256)]) + said[at + 1 :]
    if kind == 2:
        return said[:at] + rng.randbytes(rng.randrange(1, 20)) + said[at:]
    if kind == 3:
        return said[at:]
    if kind == 4:
        return said[:at] + said
    if kind == 5:
        return said[:at] + b" " * 2000 + said[at:]
    if kind == 6:
        return reply(rng.choice([None, 1, "x", [float(rng.random())] * 6, {}]), rng.randrange(9))
    return b'{"jsonrpc":"2.0","result":"[NaN,1,2,3,4,5]","id":7}'


@pytest.mark.slow
def test_ten_thousand_damaged_replies_name_their_fault_or_are_a_valid_reply():
    rng = random.Random(4)
    told = [30.25, -80.5, 100.125, -110.0, -90.0, 20.75]
    faults, accepted = 0, 0
    for _ in range(10_000):
        said = mutated(rng, reply(told, 7, rng.choice([b"", b"\n"])))
        buffer = ReplyBuffer()
        buffer.feed(said)
        try:
            whole = buffer.take()
            if whole is None:
                continue  # cut short: the client's time runs out
            value = replies.numbers(result_of(whole, 7), (6, 8), 720.0)
        except (BadReplyError, Refusal) as fault:
            assert str(fault)
            faults += 1
            continue
        accepted += 1
        # Read again by nothing but the standard library: what was accepted is what was said.
        outer = json.loads(whole)
        assert (outer["id"], json.loads(outer["result"])) == (7, value)
        assert all(abs(v) <= 720.0 for v in value)
    assert faults > 3000
    assert accepted > 300
