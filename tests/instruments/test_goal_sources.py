import math
import socket

import numpy as np
import pytest

from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments.goal_sources import (
    DATAGRAM,
    DatagramGoals,
    ScheduledGoals,
    check,
    datagrams,
)

ME = ("127.0.0.1", 5000)


def letter(number=1, xyz=(1.0, 2.0, 3.0), magic=b"DMPg", source=ME):
    return DATAGRAM.pack(magic, number, *xyz), source


class Post:
    """Hands out what is put into it."""

    def __init__(self, **options):
        self.waiting = []
        self.goals = DatagramGoals("udp", self.receive, **options)

    def receive(self):
        return self.waiting.pop(0) if self.waiting else None

    def take(self, now=0.0, *letters):
        self.waiting += letters
        return self.goals.take(now, 0.0)


def kinds(news):
    return [one.kind for one in news]


def test_a_datagram_of_32_bytes_is_a_goal():
    content, _ = letter(7, (-551.5, 132.25, -17.5))
    assert len(content) == 32
    assert content[:8] == b"DMPg\x00\x00\x00\x07"
    (news,) = Post().take(0.0, (content, ME))
    np.testing.assert_array_equal(news.position, [-551.5, 132.25, -17.5])


@pytest.mark.parametrize(
    ("bad", "kind"),
    [
        ((b"DMPg", ME), "no goal datagram"),
        ((letter()[0] + b"x", ME), "no goal datagram"),
        ((letter()[0][:-1], ME), "no goal datagram"),
        (letter(magic=b"DMPh"), "no goal datagram"),
        (letter(2, (math.nan, 0.0, 0.0)), "no finite numbers"),
        (letter(2, (0.0, -math.inf, 0.0)), "no finite numbers"),
        (letter(2, (0.0, 0.0, 2e5)), "beyond 100 m"),
        (letter(1), "sent twice"),
        (letter(0), "older than the last one"),
        (letter(2, source=("127.0.0.1", 5001)), "another sender"),
        (letter(2, source=("10.0.0.9", 5000)), "another sender"),
    ],
)
def test_what_must_not_be_believed_is_told_and_changes_nothing(bad, kind):
    post = Post()
    assert kinds(post.take(0.0, letter(1))) == [""]
    (news,) = post.take(0.1, bad)
    assert (news.position, news.kind) == (None, kind)
    (after,) = post.take(0.2, letter(2, (4.0, 5.0, 6.0)))
    assert after.position is not None


def test_a_number_runs_on_through_its_turn():
    post = Post()
    for number in (2**32 - 2, 2**32 - 1, 0, 1):
        assert kinds(post.take(0.0, letter(number))) == [""]


def test_only_the_address_that_is_named_is_believed():
    post = Post(sender="10.0.0.9")
    assert kinds(post.take(0.0, letter(5))) == ["another sender"]
    assert kinds(post.take(0.0, letter(1, source=("10.0.0.9", 7)))) == [""]


def test_a_silent_sender_is_told_once_and_may_begin_anew():
    post = Post(patience=0.5)
    assert post.take(0.0) == []
    assert kinds(post.take(0.6)) == ["no goal comes"]
    assert post.take(0.7) == []
    assert kinds(post.take(0.8, letter(90))) == ["goals come again", ""]
    assert kinds(post.take(1.4)) == ["no goal comes"]
    # From another port and with another count; from elsewhere never.
    assert kinds(post.take(1.5, letter(3, source=("10.0.0.9", 1)))) == ["another sender"]
    assert kinds(post.take(1.5, letter(3, source=(ME[0], 6000)))) == ["goals come again", ""]


def test_garbage_does_not_hide_that_no_goal_comes():
    post = Post(patience=0.5)
    post.take(0.0, letter(1))
    assert kinds(post.take(0.6, (b"", ME))) == ["no goal datagram", "no goal comes"]


def test_a_flood_takes_no_more_than_its_share_of_a_cycle():
    post = Post()
    assert len(post.take(0.0, *(letter(n) for n in range(1, 1000)))) == 64


def test_a_schedule_hands_out_what_is_due_once():
    goals = ScheduledGoals("g.csv", np.array([0.0, 1.0, 1.0, 3.0]), np.arange(12.0).reshape(4, 3))
    assert goals.take(0.0, -0.02) == []
    assert [news.position[0] for news in goals.take(0.0, 0.0)] == [0.0]
    assert goals.take(0.0, 0.98) == []
    assert [news.position[0] for news in goals.take(0.0, 5.0)] == [3.0, 6.0, 9.0]
    assert goals.take(0.0, 9.0) == []


def test_it_listens_on_the_loopback_unless_a_host_is_named():
    assert check("udp://:9870") == ("127.0.0.1", 9870, 1.0, "")
    said = "udp://0.0.0.0:9870?from=10.0.0.9&patience=0.2"
    assert check(said) == ("0.0.0.0", 9870, 0.2, "10.0.0.9")


@pytest.mark.parametrize(
    "url",
    [
        "udp:",
        "udp://:0",
        "udp://127.0.0.1",
        "udp://:99999",
        "udp://:9870/x",
        "udp://:9870?a=1",
        "udp://:9870?patience=0",
        "udp://:9870?patience=nan",
        "udp://:9870?patience=1&patience=2",
    ],
)
def test_a_url_that_is_wrong_is_refused(url):
    with pytest.raises(InputError, match="--goal-from"):
        check(url)


def test_what_is_sent_over_the_wire_arrives():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    goals = datagrams(f"udp://:{port}")
    with pytest.raises(InstrumentError, match="cannot listen"):
        datagrams(f"udp://:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(letter(1)[0], ("127.0.0.1", port))
        news = []
        while not news:
            news = goals.take(0.0, 0.0)
    np.testing.assert_array_equal(news[0].position, [1.0, 2.0, 3.0])
    goals.close()
    goals.close()
