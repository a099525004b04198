import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.simulation.elite_server.parameters import RpcError
from dmpcli.simulation.elite_server.rpc import LONGEST, RequestLines, answer


def echo(method, params):
    if method == "silent":
        return None
    if method == "fail":
        raise RpcError(-32693, "Can't operate, robot must be in remote mode.")
    return [method, params]


def test_the_result_is_json_within_a_json_string():
    line = b'{"method":"m","params":{"a":1},"jsonrpc":"2.0","id":5}'
    assert answer(line, echo, newline=False) == (
        b'{"jsonrpc":"2.0","result":"[\\"m\\", {\\"a\\": 1}]","id":5}'
    )


def test_a_bool_is_encoded_twice_too():
    reply = answer(b'{"method":"m","params":{},"id":1}', lambda *_: True, newline=False)
    assert reply == b'{"jsonrpc":"2.0","result":"true","id":1}'


@pytest.mark.parametrize("params", [b"", b',"params":{}', b',"params":[]', b',"params":null'])
def test_empty_parameters_come_in_several_forms(params):
    reply = json.loads(answer(b'{"method":"m"' + params + b',"id":1}', echo, newline=False))
    assert json.loads(reply["result"]) == ["m", {}]


def test_an_error_has_a_code_a_message_and_the_requests_id():
    reply = json.loads(answer(b'{"method":"fail","id":9}', echo, newline=False))
    assert reply["error"] == {
        "code": -32693,
        "message": "Can't operate, robot must be in remote mode.",
    }
    assert reply["id"] == 9
    assert "result" not in reply


def test_replies_end_in_a_newline_where_that_was_chosen():
    assert answer(b'{"method":"m","id":1}', echo, newline=True).endswith(b"}\n")
    assert answer(b'{"method":"fail","id":1}', echo, newline=True).endswith(b"}\n")


def test_what_is_not_to_be_answered_is_not():
    assert answer(b'{"method":"silent","id":1}', echo, newline=True) == b""


@pytest.mark.slow
@given(
    st.one_of(
        st.binary(),
        st.text().map(str.encode),
        st.builds(
            json.dumps,
            st.recursive(
                st.none() | st.booleans() | st.floats() | st.integers() | st.text(),
                lambda inner: (
                    st.lists(inner)
                    | st.dictionaries(st.sampled_from(["method", "params", "id"]), inner)
                ),
            ),
        ).map(str.encode),
    )
)
def test_any_line_is_answered_with_one_json_object(line):
    reply = json.loads(answer(line, echo, newline=False) or b'{"id": 0}')
    assert isinstance(reply, dict)
    assert "id" in reply


@given(st.lists(st.binary(max_size=40)), st.lists(st.integers(1, 30)))
def test_lines_are_whole_however_the_stream_is_cut(lines, sizes):
    lines = [line.replace(b"\n", b"") for line in lines]
    stream = b"".join(line + b"\n" for line in lines)
    requests, found = RequestLines(), []
    for size in [*sizes, len(stream) + 1]:
        piece, stream = stream[:size], stream[size:]
        found += requests.feed(piece)
    assert found == [line for line in lines if line.strip()]


def test_a_line_without_end_is_an_error_and_not_kept():
    requests = RequestLines()
    with pytest.raises(RpcError):
        list(requests.feed(b"x" * (LONGEST + 1)))
    assert list(requests.feed(b"{}\n")) == [b"{}"]
