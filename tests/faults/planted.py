"""Defects that a laboratory must find: each is planted, and looked for among seeds.

``python -m tests.faults --planted`` says after how many seeds each is found.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from typing import Any, TypeAlias
from unittest import mock

import numpy as np

from dmpcli.control import guards, stopping
from dmpcli.control.arrival import ArrivalMonitor
from dmpcli.control.cycle import LoopOutcome
from dmpcli.control.outputs import OutputSwitch
from dmpcli.control.signals import Interruption
from dmpcli.control.step_limits import StepLimits
from dmpcli.errors import UnconfirmedStopError
from dmpcli.instruments.elite.arm_driver import ArmDriver
from dmpcli.instruments.elite.monitor import Monitor
from dmpcli.instruments.elite.stream_driver import StreamDriver
from dmpcli.instruments.netft import box_watch
from dmpcli.planning import goal_course
from dmpcli.workflows.run_output import RunOutput

Plant: TypeAlias = Callable[[], AbstractContextManager[Any]]


def _jump() -> AbstractContextManager[Any]:
    """Every 30th set-point is sent with joint 1 a third of a degree off."""
    send, count = StreamDriver.send, [0]

    def jumping(self: StreamDriver, target: Any) -> bool:
        count[0] += 1
        bent = target + np.array([1.0 / 3.0, 0, 0, 0, 0, 0]) * (count[0] % 30 == 0)
        return send(self, bent)

    return mock.patch.object(StreamDriver, "send", jumping)


def _goal_jumps() -> AbstractContextManager[Any]:
    """A goal is where the tool is at once, and nobody looks at the step to it."""
    respond = goal_course.response

    def at_once(filter_: Any, state: Any, shift: Any, count: int) -> Any:
        return respond(filter_, np.stack([shift, np.zeros(3)]), shift, count)

    stack = ExitStack()
    stack.enter_context(mock.patch.object(goal_course, "response", at_once))
    stack.enter_context(mock.patch.object(goal_course, "_by_limits", return_value=""))
    stack.enter_context(mock.patch.object(StepLimits, "check", _nothing))
    return stack


def _lost() -> AbstractContextManager[Any]:
    """What failed is not kept."""
    keep = RunOutput.keep

    def keeping(self: RunOutput, whole: Any, failure: Any) -> None:
        if failure is None:
            keep(self, whole, failure)
        else:
            self.drop()

    return mock.patch.object(RunOutput, "keep", keeping)


def _nothing(*_: object, **__: object) -> None:
    """Do nothing, and find nothing."""


def _whatever_was_last(self: Monitor, *_: object, **__: object) -> object:
    return self._newest


def _first(_: object, before: str = "") -> UnconfirmedStopError:
    return UnconfirmedStopError(before)


def _dropped_stop(self: ArmDriver) -> None:
    self._begun = False


PLANTED: dict[str, tuple[Plant, str, tuple[str, ...]]] = {
    "a flag of one frame is forgotten": (
        lambda: mock.patch.object(Monitor, "latched", property(_nothing)),
        "execute",
        ("frame_flag",),
    ),
    "no state forbids motion": (
        lambda: mock.patch.object(guards, "check_ready", _nothing),
        "execute",
        ("frame_flag",),
    ),
    "what is on stays on": (
        lambda: mock.patch.object(OutputSwitch, "leave", _nothing),
        "execute",
        ("estop",),
    ),
    "the arm is not told to stop": (
        lambda: mock.patch.object(ArmDriver, "stop", _dropped_stop),
        "execute file",
        ("frames_stop",),
    ),
    "rest is believed unseen": (
        lambda: mock.patch.object(stopping, "_seen", return_value=stopping.AT_REST),
        "execute file",
        ("stop_fails", "signals"),
    ),
    "arrival is believed": (
        lambda: mock.patch.multiple(
            ArrivalMonitor, refuse=_nothing, check_rest=_nothing, arrived=True
        ),
        "execute",
        ("arm_stands",),
    ),
    "a set-point jumps": (_jump, "execute", ()),
    "a goal that jumps is jumped to": (_goal_jumps, "execute moved", ()),
    "a change of the box's bias is believed": (
        lambda: mock.patch.object(box_watch, "changed", _nothing),
        "record",
        ("sensor_biased",),
    ),
    "an arm that may still move is code 3": (
        lambda: mock.patch.object(UnconfirmedStopError, "exit_code", 3),
        "execute file",
        ("stop_fails", "frames_stop"),
    ),
    "what failed first is told last": (
        lambda: mock.patch.object(stopping.StopOutcome, "error", _first),
        "execute file",
        ("stop_fails", "frames_stop"),
    ),
    "a failed run is thrown away": (_lost, "execute", ("estop",)),
    "a failure is not raised": (
        lambda: mock.patch.object(LoopOutcome, "error", _nothing),
        "execute",
        ("estop",),
    ),
    "signals are not heeded": (
        lambda: mock.patch.object(Interruption, "receive", _nothing),
        "execute",
        ("signals",),
    ),
    "an old state passes for new": (
        lambda: mock.patch.object(Monitor, "newest", _whatever_was_last),
        "execute",
        ("frames_stop",),
    ),
}
"""Defects by what they do: how each is planted, and a command and faults that reveal it."""
