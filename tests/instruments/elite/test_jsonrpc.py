import random
import socket
import threading
import time
from collections import Counter

import pytest

from dmpcli.errors import InstrumentError
from dmpcli.instruments.elite.jsonrpc import Client
from dmpcli.instruments.elite.replies import Refusal
from tests.instruments.elite.scripted import Scripted, refusal, reply
from tests.instruments.elite.test_replies import mutated


@pytest.fixture
def robot():
    with Scripted() as scripted:
        yield scripted


@pytest.fixture
def client_of():
    """Connects clients that are closed at the end."""
    made = []

    def connected(robot, patience=1.0):
        made.append(Client("127.0.0.1", robot.port, patience))
        made[-1].connect()
        return made[-1]

    yield connected
    for client in made:
        client.close()


@pytest.mark.parametrize("end", [b"", b"\n", b"\r\n"])
@pytest.mark.parametrize("chop", [0, 1, 7])
def test_a_request_is_answered_with_or_without_a_newline_whole_or_in_pieces(client_of, end, chop):
    with Scripted(end, chop) as robot:
        client = client_of(robot)
        assert client.call("getRobotMode") == 2
        assert client.call("get_joint_pos") == robot.joints
        assert robot.asked == [("getRobotMode", {}), ("get_joint_pos", {})]
        client.close()
        client.close()


def test_a_no_leaves_the_connection_usable(robot, client_of):
    robot.answers["stop"] = refusal(1).replace(b'"id": 1', b'"id": {id}')
    client = client_of(robot)
    with pytest.raises(Refusal, match="remote mode"):
        client.call("stop")
    assert client.call("getRobotMode") == 2


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (None, "no answer"),
        (OSError, "the controller closed the connection"),
        (b'{"jsonrpc":"2.0","result":"0","id":{id}', "no answer"),
        (reply(0, 99), "its reply answers request 99, not 1"),
        (b"hello\n", "its reply is no JSON object"),
        (b'{"id":{id},"result":"NaN"}', "its reply is not JSON in the result"),
        (b'{"id":{id},"result":"' + b"1" * 70_000, "its reply is longer than"),
    ],
)
def test_a_fault_is_named_and_the_connection_not_used_again(robot, client_of, answer, words):
    robot.answers["getRobotState"] = answer
    client = client_of(robot, patience=0.3)
    with pytest.raises(InstrumentError, match=words) as error:
        client.call("getRobotState")
    assert "getRobotState" in str(error.value)
    assert not client.connected
    with pytest.raises(InstrumentError, match="the connection is gone"):
        client.call("getRobotMode")
    client.connect()
    assert client.call("getRobotMode") == 2


def test_an_answer_that_nobody_asked_for_ends_the_connection(robot, client_of):
    robot.answers["getRobotState"] = reply(0, 1) + reply(0, 2)
    client = client_of(robot)
    assert client.call("getRobotState") == 0
    with pytest.raises(InstrumentError, match=r"nobody asked for|answers request"):
        client.call("getRobotMode")


def test_a_trickle_does_not_keep_it_waiting(robot, client_of):
    def trickle(_):
        time.sleep(0.4)
        return b'{"result":'

    robot.answers["getRobotState"] = trickle
    client = client_of(robot, patience=0.2)
    with pytest.raises(InstrumentError, match="no answer"):
        client.call("getRobotState")


def test_requests_from_several_threads_get_their_own_answers(robot, client_of):
    robot.answers["positiveKinematic"] = lambda params: params["n"]
    client = client_of(robot)
    wrong = []

    def ask(base):
        wrong.extend(n for n in range(base, base + 100) if answer(n) != n)

    def answer(n):
        return client.call("positiveKinematic", {"n": n})

    threads = [threading.Thread(target=ask, args=(1000 * k,)) for k in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_an_unanswered_request_is_sent(robot, client_of):
    robot.answers["push"] = lambda _: None
    client = client_of(robot)
    client.notify("push", {"n": 1})
    assert client.call("getRobotMode") == 2
    assert robot.asked[0] == ("push", {"n": 1})


def test_a_connection_that_the_other_end_closed_is_found_without_a_request(robot):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = Client("127.0.0.1", listener.getsockname()[1], 5.0)
        client.connect()
        connection = listener.accept()[0]
        client.poll()
        client._socket.settimeout(5.0)
        connection.close()
        client._socket.recv(1, socket.MSG_PEEK)  # waits for the end to arrive
        with pytest.raises(InstrumentError, match="closed the connection"):
            client.poll()
        assert not client.connected
        with pytest.raises(InstrumentError, match="is gone"):
            client.poll()


def test_nothing_that_still_waits_to_be_sent_arrives_after_the_connection_is_dropped():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = Client("127.0.0.1", listener.getsockname()[1], 5.0)
        client.connect()
        with listener.accept()[0] as controller:
            controller.settimeout(5.0)
            # A connection that is reset has thrown away what had not been sent.
            client.close()
            with pytest.raises(ConnectionResetError):
                controller.recv(1)


@pytest.mark.slow
def test_two_hundred_damaged_replies_over_the_wire_neither_hang_nor_deceive(robot, client_of):
    rng = random.Random(8)
    robot.answers["get_joint_pos"] = lambda _: next(said)
    robot.end = b""
    outcomes = Counter()
    client = client_of(robot, patience=5.0)
    for _ in range(200):
        if not client.connected:
            client.connect()
        number = client.call("getRobotMode") and client._number + 1
        said = iter([mutated(rng, reply(robot.joints, number))])
        try:
            value = client.call("get_joint_pos", patience=0.03)
        except (InstrumentError, Refusal) as fault:
            assert "get_joint_pos" in str(fault)
            outcomes["fault"] += 1
            client.close()
        else:
            # A flipped digit is a valid reply; anything else than six numbers is not.
            outcomes["value"] += value == robot.joints
            client.close()
    assert outcomes["fault"] > 100
    assert outcomes["value"] > 5


def test_a_host_that_is_not_there_is_one_line():
    with Scripted() as gone:
        port = gone.port
    for client, words in (
        (Client("127.0.0.1", port, 0.3), "Connection refused"),
        (Client("no-such-host.invalid", 8055, 0.3), "nobody knows this host"),
    ):
        with pytest.raises(InstrumentError, match=words) as error:
            client.connect()
        assert "\n" not in str(error.value)
