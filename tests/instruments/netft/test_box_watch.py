import threading
from dataclasses import replace

from dmpcli.instruments.netft import box_watch
from dmpcli.instruments.netft.box_watch import BoxWatch
from dmpcli.instruments.netft.settings import BoxInfo, Scale


class Pages:
    """A box's pages, which count who looks."""

    def __init__(self):
        self.shown = BoxInfo("", "", Scale(1e6, 1e6, "N", "N-m"), bias=(0.0,) * 6)
        self.looks, self.looked = 0, threading.Event()

    def info(self, wait):
        self.looks += 1
        self.looked.set()
        return self.shown


def test_a_look_that_is_asked_for_does_not_wait_for_its_time():
    pages = Pages()
    watch = BoxWatch(pages, pages.shown, 3600.0)
    pages.shown = replace(pages.shown, bias=(5e6, 0.0, 0.0, 0.0, 0.0, 0.0))
    watch.look_soon()
    watch._thread.join(30.0)
    assert "its bias was changed" in watch.fault
    watch.end()
    assert pages.looks == 1


def test_however_often_looks_are_asked_for_the_box_is_left_to_itself_between(monkeypatch):
    monkeypatch.setattr(box_watch, "PAUSE", 3600.0)
    pages = Pages()
    watch = BoxWatch(pages, pages.shown, 3600.0)
    watch.look_soon()
    assert pages.looked.wait(30.0)
    watch.look_soon()
    watch.end()  # looks once more by itself
    assert (pages.looks, watch.fault) == (2, None)


def test_an_end_wakes_the_thread_and_looks_once_more():
    pages = Pages()
    watch = BoxWatch(pages, pages.shown, 3600.0)
    watch.end()
    watch.end()
    assert not watch._thread.is_alive()
    assert pages.looks == 1
