import os
import signal

import pytest

from dmpcli.control.signals import Interruption

COUNTED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


@pytest.fixture(autouse=True)
def usual():
    """Handlers as a shell leaves them; nohup and the background hand down others."""
    usual = dict.fromkeys((*COUNTED, signal.SIGTSTP), signal.SIG_DFL)
    usual[signal.SIGINT] = signal.default_int_handler
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def handlers():
    return [signal.getsignal(n) for n in (*COUNTED, signal.SIGTSTP)]


def test_signals_are_counted_while_it_is_entered():
    with Interruption() as interruption:
        os.kill(os.getpid(), signal.SIGTERM)
        assert (interruption.number, interruption.count) == (signal.SIGTERM, 1)
        os.kill(os.getpid(), signal.SIGINT)
        assert (interruption.number, interruption.count) == (signal.SIGTERM, 2)


@pytest.mark.parametrize("number", COUNTED)
def test_a_closed_terminal_is_a_signal_like_any_other(number):
    with Interruption() as interruption:
        assert signal.getsignal(number) == interruption.receive
        os.kill(os.getpid(), number)
        assert (interruption.number, interruption.count) == (number, 1)


def test_it_cannot_be_suspended_meanwhile():
    with Interruption() as interruption:
        assert signal.getsignal(signal.SIGTSTP) == signal.SIG_IGN
        os.kill(os.getpid(), signal.SIGTSTP)
        assert interruption.count == 0


def test_who_asked_to_outlive_the_terminal_does():
    """Such as nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interruption() as interruption:
            os.kill(os.getpid(), signal.SIGHUP)
            assert interruption.count == 0
    finally:
        signal.signal(signal.SIGHUP, before)


def test_handlers_are_put_back():
    before = handlers()
    with Interruption():
        assert all(now != then for now, then in zip(handlers(), before, strict=True))
    assert handlers() == before


def test_a_signal_that_ends_the_program_as_handlers_are_put_back_leaves_none_behind(monkeypatch):
    before = handlers()
    put = signal.signal

    def raising(number, handler):
        put(number, handler)
        if number == signal.SIGINT and handler is signal.default_int_handler:
            raise KeyboardInterrupt

    monkeypatch.setattr(signal, "signal", raising)
    with pytest.raises(KeyboardInterrupt), Interruption():
        pass
    monkeypatch.undo()
    assert handlers() == before


def test_the_third_signal_is_the_last_that_is_counted():
    """Two stop the arm; if the process hangs even so, a fourth ends it."""
    before = handlers()
    with Interruption() as interruption:
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) == interruption.receive
        os.kill(os.getpid(), signal.SIGINT)
        assert interruption.count == 3
        assert handlers()[:-1] == before[:-1]
        assert signal.getsignal(signal.SIGTSTP) == signal.SIG_IGN
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert handlers() == before


def test_a_signal_that_was_ignored_is_counted_but_for_that_of_the_terminals_end():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with Interruption() as interruption:
        assert signal.getsignal(signal.SIGINT) == interruption.receive
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        for _ in range(3):
            interruption.receive(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
