import os
import signal

from dmpcli.instruments.interruption import Interruption


def test_signals_are_counted_while_it_is_entered():
    with Interruption() as interruption:
        os.kill(os.getpid(), signal.SIGTERM)
        assert (interruption.number, interruption.count) == (signal.SIGTERM, 1)
        os.kill(os.getpid(), signal.SIGINT)
        assert (interruption.number, interruption.count) == (signal.SIGTERM, 2)


def test_handlers_are_put_back():
    before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    with Interruption():
        assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] != before
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == before
