"""The UR driver: its logic against fakes of ur-rtde, and ur-rtde itself against an RTDE server."""

import secrets
import socket
import subprocess
import sys
import threading
import time
import types

import numpy as np
import pytest

from dmpcli import extras
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments import registry, ur
from dmpcli.instruments.address import Address
from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
from dmpcli.instruments.servo_adapter import PoseServo
from dmpcli.kinematics import chain, models
from dmpcli.simulation.mock import PEN
from dmpcli.spatial.rotations import exp, log
from tests.extras_here import needs
from tests.instruments import rtde_server

POSE = [-0.4, 0.1, 0.3, 0.0, 3.0, 0.5]
JOINTS = [0.1, -1.2, 1.3, -1.4, 1.5, 0.6]


def own_loopback():
    """A loopback address that no other test has: the port of a UR robot cannot be chosen."""
    return f"127.{secrets.randbelow(250) + 2}.{secrets.randbelow(256)}.{secrets.randbelow(254) + 1}"


class FakeReceive:
    """ur-rtde's reading half, as a test wants it."""

    def __init__(self, host, variables=()):
        self.host, self.variables = host, variables
        self.stamp, self.safety, self.mode = 1.0, 1, 7
        self.estop = self.protective = False
        self.connected = True
        self.gone = False

    def isConnected(self):  # noqa: N802
        return self.connected

    def getTimestamp(self):  # noqa: N802
        return self.stamp

    def getActualTCPPose(self):  # noqa: N802
        return POSE

    def getActualQ(self):  # noqa: N802
        return JOINTS

    def getSafetyMode(self):  # noqa: N802
        return self.safety

    def getRobotMode(self):  # noqa: N802
        return self.mode

    def isEmergencyStopped(self):  # noqa: N802
        return self.estop

    def isProtectiveStopped(self):  # noqa: N802
        return self.protective

    def disconnect(self):
        self.gone = True


class FakeControl:
    """ur-rtde's driving half: remembers what it was told."""

    def __init__(self, host):
        self.host, self.told = host, []
        self.safe = self.takes = self.running = self.stops = True
        self.fails = set()

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        answers = {
            "isPoseWithinSafetyLimits": lambda: self.safe,
            "servoL": lambda: self.takes,
            "isProgramRunning": lambda: self.running,
            "servoStop": lambda: self.stops,
        }

        def call(*values):
            if name in self.fails:
                raise RuntimeError(f"{name}: broken\n pipe")
            self.told.append((name, *values))
            return answers.get(name, lambda: True)()

        return call

    def names(self):
        return [name for name, *_ in self.told]


@pytest.fixture
def fakes(monkeypatch):
    made = types.SimpleNamespace(receive=[], control=[], io=[])

    def keep(kind, into):
        def make(*args, **kwargs):
            into.append(kind(*args, **kwargs))
            return into[-1]

        return make

    receive = types.SimpleNamespace(RTDEReceiveInterface=keep(FakeReceive, made.receive))
    control = types.SimpleNamespace(RTDEControlInterface=keep(FakeControl, made.control))
    outside = types.SimpleNamespace(RTDEIOInterface=keep(FakeControl, made.io))
    monkeypatch.setitem(sys.modules, "rtde_io", outside)
    monkeypatch.setitem(sys.modules, "rtde_receive", receive)
    monkeypatch.setitem(sys.modules, "rtde_control", control)
    monkeypatch.setattr(ur.UrDriver, "_probe", lambda self: None)
    monkeypatch.setattr(ur.UrDriver, "_open", lambda self, port: socket.socket())
    return made


def driver(clock=None, **options):
    address = Address("robot", "ur", "10.0.0.1", options=options)
    return ur.make(address, clock or SimulatedClock())


@pytest.fixture
def started(fakes):
    made = driver(lookahead="0.08", gain="500", deceleration="4", watchdog="20")
    made.connect()
    made.start(0.02)
    return made, fakes.receive[0], fakes.control[0]


# What the URL says.


def test_the_scheme_is_registered():
    assert registry.robot_factory("ur") is ur.make


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lookahead": "0.3"}, "lookahead = '0.3': a number from 0.03 to 0.2 s"),
        ({"gain": "50"}, "gain = '50': a number from 100 to 2000"),
        ({"deceleration": "x"}, "deceleration = 'x'"),
        ({"speed": "1"}, "speed: there is no such option; ur has lookahead, gain"),
    ],
)
def test_a_wrong_option_is_refused_by_name(options, words):
    with pytest.raises(InputError, match=words):
        driver(**options)


def test_a_port_is_refused():
    with pytest.raises(InputError, match="ports are fixed"):
        ur.make(Address("robot", "ur", "10.0.0.1", 30004), SimulatedClock())


@pytest.mark.parametrize("module", ["rtde_receive", "rtde_control"])
def test_without_ur_rtde_the_extra_is_named(fakes, monkeypatch, module):
    made = driver()
    made.connect()
    monkeypatch.setitem(sys.modules, module, None)
    step = made.connect if module == "rtde_receive" else lambda: made.start(0.02)
    with pytest.raises(InputError, match=r"pip install 'dmpcli\[ur\]'"):
        step()


# Reading.


def test_it_declares_poses_in_metres_with_rotation_vectors(fakes):
    declared = driver(lookahead="0.15", watchdog="25").connect()
    assert declared.space == "pose"
    assert (declared.length, declared.angle) == ("m", "rad")
    assert declared.orientation == "rotation vector"
    assert declared.lookahead == 0.15
    # At no period that it takes do set-points come too seldom for the robot's watchdog.
    assert declared.period_range[1] < 1 / 25


def test_to_connect_starts_nothing_on_the_robot(fakes):
    made = driver()
    made.connect()
    made.state()
    made.close()
    assert fakes.control == []
    assert fakes.receive[0].gone


def test_the_servo_above_it_speaks_millimetres_and_matrices(fakes):
    servo = PoseServo(driver(), SimulatedClock())
    servo.open()
    state = servo.state()
    assert state.position == pytest.approx([-400, 100, 300])
    assert state.rotation == pytest.approx(exp(np.array([0, 3.0, 0.5])))
    assert state.joints == pytest.approx(JOINTS)
    servo.start(0.02)
    assert servo.send(np.array([-410.0, 110, 310]), exp(np.array([0.1, 0.2, 0.3])))
    name, pose, *rest = fakes.control[0].told[-1]
    assert name == "servoL"
    assert pose == pytest.approx([-0.41, 0.11, 0.31, 0.1, 0.2, 0.3])
    assert rest == [0.0, 0.0, 0.02, 0.1, 300.0]


@pytest.mark.parametrize(
    ("set_to", "mode", "detail"),
    [
        ({"estop": True, "safety": 7}, "emergency stop", "robot"),
        ({"safety": 6}, "emergency stop", "system"),
        ({"protective": True, "safety": 3}, "protective stop", ""),
        ({"protective": True}, "protective stop", ""),
        ({"safety": 5}, "stopped", "safeguard stop"),
        ({"safety": 9}, "fault", "safety fault"),
        ({"safety": 42}, "fault", "safety mode 42"),
        ({"mode": 5}, "not ready", "robot mode 5"),
        ({"safety": 2}, "ready", "reduced mode"),
    ],
)
def test_what_the_robot_says_of_itself_is_its_mode(fakes, set_to, mode, detail):
    made = driver()
    made.connect()
    for name, value in set_to.items():
        setattr(fakes.receive[0], name, value)
    state = made.state()
    assert state.mode == mode
    assert detail in state.detail
    if mode != "ready":
        with pytest.raises(RefusedError, match=mode):
            made.start(0.02)
        assert fakes.control == []


def test_a_state_that_does_not_change_is_not_believed_for_long(fakes):
    clock = SimulatedClock()
    made = driver(clock)
    made.connect()
    made.state()
    clock.sleep_until(0.15)
    assert made.state().t == 0.0  # when it was new
    clock.sleep_until(0.25)
    with pytest.raises(InstrumentError, match=r"silent for 0\.25 s"):
        made.state()
    fakes.receive[0].stamp += 0.008
    assert made.state().t == 0.25


def test_a_lost_connection_is_told(fakes):
    made = driver()
    made.connect()
    fakes.receive[0].connected = False
    with pytest.raises(InstrumentError, match="connection is lost"):
        made.state()


# Driving.


def test_the_watchdog_is_set_and_kicked_before_every_set_point(started):
    made, _, control = started
    assert control.told == [("setWatchdog", 20.0)]
    for _ in range(3):
        assert made.send(np.array(POSE))
    assert control.names()[1:] == [
        "isPoseWithinSafetyLimits",
        *["kickWatchdog", "servoL"] * 3,
    ]
    assert control.told[-1] == ("servoL", POSE, 0.0, 0.0, 0.02, 0.08, 500.0)


def test_a_first_set_point_outside_the_safety_limits_is_not_sent(started):
    made, _, control = started
    control.safe = False
    with pytest.raises(RefusedError, match="out of its reach or safety limits"):
        made.send(np.array(POSE))
    assert "servoL" not in control.names()


def test_a_set_point_that_is_not_taken_or_not_a_number_is_false(started):
    made, _, control = started
    assert not made.send(np.full(6, np.nan))
    control.takes = False
    assert not made.send(np.array(POSE))


def test_nothing_is_sent_before_the_start(fakes):
    made = driver()
    made.connect()
    assert not made.send(np.array(POSE))


def test_a_program_that_was_stopped_on_the_pendant_is_seen(started):
    made, _, control = started
    assert made.state().mode == "ready"
    made.send(np.array(POSE))
    control.running = False
    assert made.state().mode == "stopped"


def test_stop_decelerates_once_and_close_ends_the_script(started):
    made, receive, control = started
    made.send(np.array(POSE))
    made.stop()
    made.stop()
    assert control.told[-1] == ("servoStop", 4.0)
    assert control.names().count("servoStop") == 1
    made.close()
    made.close()
    assert control.names()[-2:] == ["stopScript", "disconnect"]
    assert receive.gone


def test_a_stop_that_was_not_done_is_told_and_tried_again(started):
    made, _, control = started
    made.send(np.array(POSE))
    control.fails = {"servoStop"}
    with pytest.raises(InstrumentError, match="servoStop failed"):
        made.stop()
    control.fails, control.stops = set(), False
    with pytest.raises(InstrumentError, match=r"did not do servoStop.*emergency stop"):
        made.stop()
    control.running = False  # then nothing moves it
    made.stop()
    made.stop()
    assert control.names().count("servoStop") == 2


@pytest.fixture
def dashboard(monkeypatch):
    """A dashboard server of one line; `answer` is what it says to stop."""
    said = types.SimpleNamespace(asked=[], answer="Stopped\n")

    def link(self, port):
        assert port == ur.DASHBOARD_PORT
        here, there = socket.socketpair()

        def serve():
            with there, there.makefile("rw", newline="\n") as lines:
                lines.write("Connected: Universal Robots Dashboard Server\n")
                lines.flush()
                said.asked.append(lines.readline())
                lines.write(said.answer)

        threading.Thread(target=serve, daemon=True).start()
        return here

    def install():
        monkeypatch.setattr(ur.UrDriver, "_open", link)
        return said

    return install


@pytest.mark.parametrize("how", ["fails", "refuses"])
def test_what_does_not_do_servo_stop_is_stopped_by_the_dashboard(started, dashboard, how):
    made, _, control = started
    said = dashboard()
    made.send(np.array(POSE))
    if how == "fails":
        control.fails = {"servoStop", "isProgramRunning"}
    else:
        control.stops = False
    made.stop()
    assert said.asked == ["stop\n"]
    made.stop()
    assert len(said.asked) == 1


def test_it_can_be_stopped_while_a_call_hangs(started, dashboard):
    made, said = started[0], dashboard()
    servo = PoseServo(made, SimulatedClock())
    assert servo.halt()
    assert said.asked == ["stop\n"]
    said.answer = "Failed to execute: stop\n"
    with pytest.raises(InstrumentError, match="dashboard: stop: answers 'Failed to execute: stop'"):
        made.halt()


def standing(fakes, monkeypatch, offset):
    """A UR5e whose TCP is set `offset` mm beyond its flange."""
    arm = models.model("ur5e")
    at = chain.forward(arm, np.array(JOINTS))
    position, rotation = at.position, at.rotation
    tip = (position + rotation @ [0.0, 0.0, offset]) / 1000.0
    pose = [*tip, *log(rotation)]
    monkeypatch.setattr(FakeReceive, "getActualTCPPose", lambda self: pose)


def test_the_tools_tcp_is_compared_with_the_robots(fakes, monkeypatch):
    standing(fakes, monkeypatch, float(PEN.tcp_position[2]))
    servo = PoseServo(driver(model="ur5e"), SimulatedClock(), PEN)
    servo.open()
    assert servo.reach.arm is models.model("ur5e")
    standing(fakes, monkeypatch, float(PEN.tcp_position[2]) + 7.0)
    with pytest.raises(RefusedError, match=r"7\.0 mm and .*the TCP that is set on the robot"):
        PoseServo(driver(model="ur5e"), SimulatedClock(), PEN).open()
    PoseServo(driver(model="ur5e", check="10"), SimulatedClock(), PEN).open()
    for options, tool in (({}, PEN), ({"model": "ur5e"}, None)):
        unknown = PoseServo(driver(**options), SimulatedClock(), tool)
        unknown.open()
        assert unknown.reach is None


def test_close_stops_an_arm_that_is_still_moving_and_goes_on_after_a_failure(started):
    made, receive, control = started
    made.send(np.array(POSE))
    control.fails = {"servoStop", "stopScript"}
    with pytest.raises(InstrumentError, match=r"servoStop failed: servoStop: broken pipe"):
        made.close()
    assert control.names()[-1] == "disconnect"
    assert receive.gone


def test_what_ur_rtde_raises_is_one_line_with_the_robot_in_it(started):
    made, _, control = started
    control.fails = {"kickWatchdog"}
    with pytest.raises(InstrumentError) as caught:
        made.send(np.array(POSE))
    assert str(caught.value).startswith("robot ur://10.0.0.1: kickWatchdog failed")
    assert "\n" not in str(caught.value)


# Whether there is a robot, before ur-rtde is let in.


def on_loopback(respond):
    """Serve one connection on RTDE's port of a loopback address; returns the address."""
    address = own_loopback()
    listener = socket.create_server((address, ur.RTDE_PORT))

    def serve():
        with listener, listener.accept()[0] as link:
            respond(link)

    threading.Thread(target=serve, daemon=True).start()
    return address


def at(address):
    return ur.make(Address("robot", "ur", address), MonotonicClock())


def test_an_address_where_nobody_listens_is_one_line(monkeypatch):
    trap = types.SimpleNamespace(RTDEReceiveInterface=lambda *_, **__: pytest.fail("let in"))
    monkeypatch.setitem(sys.modules, "rtde_receive", trap)
    with pytest.raises(InstrumentError, match="cannot be reached") as caught:
        at(own_loopback()).connect()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "respond",
    [
        lambda link: link.close(),
        lambda link: link.sendall(b"HTTP/1.1 400 Bad Request\r\n"),
        lambda link: link.sendall(b"\x00\x04V\x00"),  # version 2 refused
        lambda link: time.sleep(1.5),
    ],
    ids=["closes", "another protocol", "old", "silent"],
)
def test_what_is_no_ur_robot_is_told_before_ur_rtde_is_let_in(respond, monkeypatch):
    trap = types.SimpleNamespace(RTDEReceiveInterface=lambda *_, **__: pytest.fail("let in"))
    monkeypatch.setitem(sys.modules, "rtde_receive", trap)
    with pytest.raises(InstrumentError, match="not as a UR robot does"):
        at(on_loopback(respond)).connect()


# ur-rtde itself.


class Server:
    def __init__(self):
        self.address = own_loopback()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.instruments.rtde_server", self.address],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout.readline() == "ready\n"

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline().split() == line.split()[:1]

    def end(self):
        self.process.stdin.close()
        assert self.process.wait(10) == 0
        self.process.stdout.close()


with_ur_rtde = needs(extras.UR)


@pytest.fixture
def server():
    made = Server()
    yield made
    made.end()


def until(what, patience=5.0):
    deadline = time.monotonic() + patience
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@with_ur_rtde
def test_the_real_receive_interface_reads_a_robot_that_speaks_rtde(server, capfd):
    made = at(server.address)
    try:
        made.connect()
        until(lambda: made.state().pose[0] == POSE[0])
        state = made.state()
        assert state.mode == "ready"
        assert state.pose.tolist() == list(rtde_server.STATE["actual_TCP_pose"])
        assert state.joints.tolist() == list(rtde_server.STATE["actual_q"])
        server.tell("x -0.25")
        until(lambda: made.state().pose[0] == -0.25)
        server.tell("safety 3 4")
        until(lambda: made.state().mode == "protective stop")
        server.tell("safety 7 1216")
        until(lambda: made.state().mode == "emergency stop")
        server.tell("safety 1 1")
        server.tell("mode 5")
        until(lambda: made.state().mode == "not ready")
        with pytest.raises(RefusedError, match="power on and release the brakes"):
            made.start(0.02)
    finally:
        made.close()
    assert capfd.readouterr().out == ""


@pytest.mark.slow
@with_ur_rtde
def test_the_real_receive_interface_of_a_robot_that_falls_silent_is_not_believed(server):
    made = at(server.address)
    try:
        made.connect()
        until(lambda: made.state().pose[0] == POSE[0])
        server.tell("freeze")
        with pytest.raises(InstrumentError, match=r"silent|lost"):
            until(lambda: made.state() is None)
    finally:
        made.close()


@with_ur_rtde
def test_the_real_receive_interface_whose_robot_hangs_up_says_so(server):
    made = at(server.address)
    try:
        made.connect()
        until(lambda: made.state().pose[0] == POSE[0])
        server.tell("drop")
        with pytest.raises(InstrumentError, match=r"silent|lost|failed"):
            until(lambda: made.state() is None)
    finally:
        made.close()


@with_ur_rtde
def test_a_robot_without_a_dashboard_cannot_be_driven_and_says_so(server):
    made = at(server.address)
    try:
        made.connect()
        until(lambda: made.state().pose[0] == POSE[0])
        with pytest.raises(InstrumentError, match=r"port 29999: cannot be reached"):
            made.start(0.02)
    finally:
        made.close()


# Outputs.


def test_outputs_are_switched_by_rtde_on_a_connection_of_their_own(fakes):
    made = driver()
    made.connect()
    for name in ("DO3", "CO0", "TO1"):
        made.output(name)
    assert fakes.io == []  # a dry run only reads
    made.start(0.02)
    for name, on in (("DO3", True), ("CO0", True), ("TO1", False)):
        made.switch(name, on)
    assert fakes.io[0].told == [
        ("setStandardDigitalOut", 3, True),
        ("setConfigurableDigitalOut", 0, True),
        ("setToolDigitalOut", 1, False),
    ]
    made.close()
    assert fakes.io[0].names()[-1] == "disconnect"


@with_ur_rtde
def test_the_calls_are_those_that_ur_rtde_has():
    import rtde_io

    assert all(hasattr(rtde_io.RTDEIOInterface, call) for call, _ in ur._OUTPUTS.values())


@pytest.mark.parametrize("name", ["DO8", "TO2", "glue", "DO"])
def test_an_output_that_it_has_not_is_refused(name):
    with pytest.raises(InputError, match=f"has no output {name}; there are"):
        driver().output(name)


def test_an_output_that_the_robot_does_not_switch_is_a_failure(fakes):
    made = driver()
    made.connect()
    made.output("DO1")
    made.start(0.02)
    fakes.io[0].fails.add("setStandardDigitalOut")
    with pytest.raises(InstrumentError, match="DO1 failed: setStandardDigitalOut: broken pipe"):
        made.switch("DO1", True)


def test_without_outputs_there_is_no_such_connection(started, fakes):
    assert fakes.io == []
