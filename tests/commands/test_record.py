import os
import signal
import subprocess
import sys

import numpy as np
import pytest
import typer
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from dmpcli.commands import record
from dmpcli.control import keyboard, workcell
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
from dmpcli.instruments import clock
from dmpcli.records import file_io, journal, tool
from dmpcli.records.file_io import Source, read
from dmpcli.records.journal import Journal
from dmpcli.records.record import Provenance, decode
from dmpcli.records.row_buffer import RowBuffer
from dmpcli.records.schemas import DEMONSTRATION
from dmpcli.simulation.mock import PEN, MockServo
from dmpcli.workflows import record as workflow
from tests.control.drag_fakes import drag_settings

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)
app.command()(record.command)


def run(*arguments):
    """Run the command line; a user's mistake comes back as the exception that the door prints."""
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def demonstration(path):
    return decode(read(path), DEMONSTRATION)


def test_a_recording_is_a_demonstration_with_its_provenance(tmp_path):
    out = tmp_path / "demo.parquet"
    result = run("-o", out, "--seed", 3, "--duration", 2)
    assert result.exit_code == 0
    assert result.stdout == ""
    assert "101 rows, 2.00 s; ended because its time was over" in result.stderr
    demo = demonstration(out)
    assert set(demo.columns) == set(DEMONSTRATION.columns)
    assert len(demo) == 101
    p = demo.provenance
    assert p.command == "record"
    assert p.options["seed"] == 3
    assert p.options["damping"] == [0.08, 0.08, 0.4, 3.0, 3.0, 3.0]
    assert p.facts["simulated"] is True
    assert p.facts["reference"]["wave_height"] == 49.979
    assert str(tmp_path) not in repr(p)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_and_another_other_ones(tmp_path):
    one, two, other = (tmp_path / f"{name}.parquet" for name in "abc")
    run("-o", one, "--seed", 1, "--duration", 2)
    run("-o", two, "--seed", 1, "--duration", 2)
    run("-o", other, "--seed", 2, "--duration", 2)
    assert one.read_bytes() == two.read_bytes()
    assert one.read_bytes() != other.read_bytes()


def test_the_dash_writes_the_file_to_standard_output(tmp_path):
    result = run("-o", "-", "--duration", 2, "-q")
    assert result.stderr == ""
    assert len(decode(Source("standard input", result.stdout_bytes), DEMONSTRATION)) == 101


@pytest.mark.slow
def test_options_beat_the_config_which_beats_the_preset(tmp_path):
    config = tmp_path / "my.toml"
    config.write_text("[record]\nseed = 8\nperiods = 0.5\ndead_band_force = 0.5\n")
    out = tmp_path / "demo.parquet"
    result = run("-o", out, "--config", config, "--seed", 9, "--preset", "paper")
    assert "coasts: M/D = 5 s" in result.stderr
    options = demonstration(out).provenance.options
    assert (options["seed"], options["periods"], options["dead_band_force"]) == (9, 0.5, 0.5)
    assert options["stiffness"] == [0.02, 0.02, 0.02, 0.9, 0.9, 0.9]


def test_the_built_in_drag_has_no_admittance_reference(tmp_path):
    out = tmp_path / "demo.parquet"
    run("-o", out, "--drag", "builtin", "--duration", 2)
    demo = demonstration(out)
    assert not demo.has("x_ref")
    assert demo.has("x", "fx", "fx_raw")


def test_a_csv_and_a_tool_file_stand_in_the_provenance_by_their_hash(tmp_path):
    points, pen = tmp_path / "path.csv", tmp_path / "pen.json"
    points.write_text("x,y,z\n0,0,5\n40,0,5\n40,30,5\n")
    pen.write_bytes(tool.encode(PEN))
    out = tmp_path / "demo.parquet"
    run("-o", out, "--reference", points, "--tool", pen, "--duration", 5)
    demo = demonstration(out)
    assert demo.provenance.inputs == (
        {"role": "tool", "sha256": read(pen).sha256},
        {"role": "reference", "sha256": read(points).sha256},
    )
    assert str(tmp_path) not in repr(demo.provenance)
    assert np.linalg.norm(demo.position()[-1] - [40, 30, 5]) < 1.0


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        (["--duration", "nan"], InputError, "--duration = nan"),
        (["--duration", "-1"], InputError, "--duration = -1.0"),
        (["--duration", "1"], InputError, "would need 448 mm/s"),
        (["--until-rest", "0"], InputError, "--until-rest = 0.0"),
        (["--seed", "-1"], InputError, "--seed = -1"),
        (["--drag", "push"], InputError, "--drag = 'push'"),
        (["--wave-height", "0"], InputError, "--wave-height = 0.0"),
        (["--periods", "inf"], InputError, "--periods = inf"),
        (["--start", "nan", "0", "0"], InputError, "--start"),
        (["--start", "1", "1", "1", "--goal", "1", "1", "1"], InputError, "same point"),
        (["--reference", "spiral"], InputError, "--reference spiral"),
        (["--reference", "none.csv"], InputError, "none.csv: no such file"),
        (["--preset", "heavy"], InputError, "--preset heavy: no such preset"),
        (["--tool", "none.json"], InputError, "none.json: no such file"),
        (["--robot", "elite://10.0.0.1"], InputError, "beside a mock sensor"),
        (["--robot", "ur://h", "--sensor", "laser://h"], InputError, "one of mock:,"),
        (["--robot", "mock:?estop_at=0"], RefusedError, "emergency stop"),
        (["--sensor", "mock:?silent_at=0"], InstrumentError, "sends nothing"),
    ],
)
def test_what_cannot_be_recorded_is_refused_and_no_file_touched(tmp_path, options, error, words):
    out = tmp_path / "demo.parquet"
    out.write_bytes(b"older")
    with pytest.raises(error) as caught:
        run("-o", out, *options)
    assert words in str(caught.value)
    assert str(caught.value).count("\n") <= 1
    assert out.read_bytes() == b"older"
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("mass = [0.005, 0.005, nan, 0.1, 0.1, 0.1]", "[record] mass[2] = nan"),
        ("mass = [0.005, 0.005, 0.0, 0.1, 0.1, 0.1]", "z: mass = 0"),
        ("damping = [0.08, 0.08, -0.4, 3.0, 3.0, 3.0]", "z: damping = -0.4"),
        ("stiffness = [0.0, 0.0, 0.0, 0.0, 0.0, -1.0]", "rotation z: stiffness = -1"),
        ("damping = [0.08, 0.08, 0.4, 3.0, 3.0, 30.0]", "rotation z: unstable"),
        ("control_rate = 0.0", "[record] control_rate = 0.0"),
        ("sensor_rate = 0", "[record] sensor_rate = 0"),
        ("control_rate = nan", "[record] control_rate = nan"),
        ("damping = [0.08, 0.08]", "[record] damping"),
        ("weight = 3.0", "[record] weight: no such setting"),
    ],
)
def test_a_bad_preset_is_refused_by_name_before_anything_moves(tmp_path, monkeypatch, line, words):
    def never(*_):
        raise AssertionError("the instruments were reached")

    monkeypatch.setattr("dmpcli.control.workcell.connect", never)
    preset, out = tmp_path / "mine.toml", tmp_path / "demo.parquet"
    lines = {
        "mass": "[0.005, 0.005, 0.01, 0.1, 0.1, 0.1]",
        "damping": "[0.08, 0.08, 0.4, 3.0, 3.0, 3.0]",
        "stiffness": "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]",
    }
    key, _, value = line.partition(" = ")
    body = "\n".join(f"{k} = {v}" for k, v in (lines | {key: value}).items())
    preset.write_text(f"[record]\n{body}\n")
    with pytest.raises(InputError) as caught:
        run("-o", out, "--preset", preset)
    assert words in str(caught.value)
    assert not out.exists()


@pytest.mark.parametrize(
    ("url", "error"),
    [("mock:?silent_at=3", InstrumentError), ("mock:?estop_at=3", RefusedError)],
)
def test_what_was_recorded_before_a_failure_is_kept(tmp_path, url, error):
    out = tmp_path / "demo.parquet"
    with pytest.raises(error):
        run("-o", out, "--robot", url)
    demo = demonstration(out)
    assert 1.0 < demo.t[-1] < 2.0
    assert "stop" in demo.provenance.facts["ended"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_recording_which_is_kept(tmp_path, monkeypatch, number):
    class Signalling(clock.SimulatedClock):
        def sleep_until(self, t):
            super().sleep_until(t)
            if 2.999 < t < 3.001:
                signal.raise_signal(number)

    monkeypatch.setattr(clock, "SimulatedClock", Signalling)
    before = signal.getsignal(number)
    out = tmp_path / "demo.parquet"
    result = run("-o", out)
    assert result.exit_code == 128 + number
    assert "stopped after braking to rest" in result.stderr.splitlines()[-1]
    assert demonstration(out).t[-1] == pytest.approx(1.5, abs=0.05)
    assert signal.getsignal(number) == before


def test_enter_ends_the_recording_in_real_time_only(tmp_path, monkeypatch):
    out = tmp_path / "demo.parquet"
    lead_in = 50  # cycles, in which the mock tutor sets the pen down
    presses = iter([False] * (lead_in + 9) + [True])
    monkeypatch.setattr(clock, "MonotonicClock", clock.SimulatedClock)
    monkeypatch.setattr(keyboard, "pressed", lambda: next(presses))
    assert run("-o", out, "--realtime").exit_code == 0
    assert len(demonstration(out)) == 10
    run("-o", out, "--duration", 2)
    assert len(demonstration(out)) == 101


def test_nobody_presses_enter_where_no_person_sits():
    assert keyboard.pressed() is False


def test_a_real_recording_is_replaced_by_force_only(tmp_path):
    out = tmp_path / "demo.parquet"
    workflow.check_output(str(out), repeatable=False, force=False)
    out.write_bytes(b"real")
    workflow.check_output(str(out), repeatable=True, force=False)
    workflow.check_output(str(out), repeatable=False, force=True)
    with pytest.raises(InputError, match="--force"):
        workflow.check_output(str(out), repeatable=False, force=False)


@pytest.fixture
def half_real(monkeypatch):
    """A mock lab that passes for a mock robot with a real sensor."""
    connect = workcell.connect
    addresses = workcell.parse("mock:", "robot"), workcell.parse("netft://10.0.0.7", "sensor")
    monkeypatch.setattr(workcell, "check", lambda *_: addresses)

    def pretend(robot, sensor, clock, **options):
        monkeypatch.undo()
        return connect("mock:", "mock:", clock, **options)

    monkeypatch.setattr(workcell, "connect", pretend)
    monkeypatch.setattr(clock, "MonotonicClock", clock.SimulatedClock)
    return ("--sensor", "netft://10.0.0.7", "--allow-mixed", "--duration", 2)


@pytest.mark.parametrize(
    "option",
    [
        ("--reference", "line"),
        ("--start", -550, 130, -17),
        ("--goal", -650, 130, -17),
        ("--wave-height", 30),
        ("--periods", 2),
        ("--seed", 3),
    ],
)
def test_options_of_the_mocks_hand_are_refused_where_a_person_draws(tmp_path, option):
    real = ("--robot", "elite://10.0.0.7", "--sensor", "netft://10.0.0.8", "--tool", "pen.json")
    with pytest.raises(InputError, match=f"{option[0]}: is of the mock's hand"):
        run("-o", tmp_path / "demo.parquet", *real, *option)


def test_a_persons_recording_says_nothing_of_a_reference():
    settings = drag_settings()
    known = workflow.provenance_of(settings, {"robot": "elite"}, False, None, None)
    assert known.facts == {"simulated": False}
    assert known.options["damping"] == list(settings.damping)
    assert not known.options.keys() & {"reference", "start", "goal", "wave_height", "seed"}


@pytest.mark.parametrize("stale", [False, True])
def test_a_recording_that_goes_on_is_not_disturbed_by_another_of_its_name(
    tmp_path, half_real, monkeypatch, stale
):
    def never(*_, **__):
        raise AssertionError("the instruments were reached")

    monkeypatch.setattr(workcell, "connect", never)
    pen, out = tmp_path / "pen.json", tmp_path / "demo.parquet"
    pen.write_bytes(tool.encode(PEN))
    going = Journal(
        journal.beside(str(out)), RowBuffer({"t": 1}), DEMONSTRATION, Provenance("record", {})
    )
    if stale:
        going._end_thread()
        os.close(going._file)
    try:
        with pytest.raises(InputError, match="recover" if stale else "another dmpcli is writing"):
            run("-o", out, *half_real, "--tool", pen)
        assert not out.exists()
    finally:
        if not stale:
            going.discard()


def test_a_real_sensor_without_its_tool_is_refused(tmp_path, half_real):
    with pytest.raises(InputError, match="--tool FILE"):
        run("-o", tmp_path / "demo.parquet", *half_real)


def test_a_recording_with_a_real_instrument_is_not_replaced_unasked(tmp_path, half_real):
    pen, out = tmp_path / "pen.json", tmp_path / "demo.parquet"
    pen.write_bytes(tool.encode(PEN))
    out.write_bytes(b"real")
    with pytest.raises(InputError, match="--force"):
        run("-o", out, *half_real, "--tool", pen)
    assert out.read_bytes() == b"real"


def test_a_real_instrument_is_paced_by_the_real_clock_and_named_by_its_scheme(tmp_path, half_real):
    pen, out = tmp_path / "pen.json", tmp_path / "demo.parquet"
    pen.write_bytes(tool.encode(PEN))
    # A machine that stands still for a tenth of a second ends it, as it must: then once more.
    for attempt in range(4):
        try:
            run("-o", out, *half_real, "--tool", pen, "--force")
            break
        except InstrumentError as error:
            if attempt == 3 or "did not come round" not in str(error):
                raise
    provenance = demonstration(out).provenance
    assert provenance.options["sensor"] == "netft"
    assert provenance.options["realtime"] is True
    assert "10.0.0.7" not in repr(provenance)


def test_a_second_signal_while_the_file_is_written_does_not_lose_it(tmp_path, monkeypatch):
    class Signalling(clock.SimulatedClock):
        def sleep_until(self, t):
            super().sleep_until(t)
            if 2.999 < t < 3.001:
                signal.raise_signal(signal.SIGINT)

    write = file_io.write

    def interrupted(output, content):
        signal.raise_signal(signal.SIGINT)
        write(output, content)

    monkeypatch.setattr(clock, "SimulatedClock", Signalling)
    monkeypatch.setattr(file_io, "write", interrupted)
    out = tmp_path / "demo.parquet"
    assert run("-o", out).exit_code == 130
    assert demonstration(out).t[-1] == pytest.approx(1.5, abs=0.05)


def test_a_defect_keeps_the_recording_and_its_traceback(tmp_path, monkeypatch):
    read, at = MockServo.state, [0.0]

    def broken(servo):
        state = read(servo)
        at.append(state.t)
        return 1 / 0 if at[-1] > 3.0 >= at[-2] else state

    monkeypatch.setattr(MockServo, "state", broken)
    out = tmp_path / "demo.parquet"
    with pytest.raises(ZeroDivisionError):
        run("-o", out)
    assert demonstration(out).provenance.facts["ended"] == "a defect of dmpcli"


EXTREME = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from([0.0, -0.0, 5e-324, 1e-300, 1e-9, 1e9, 1e300, -1e300, 1.7e308]),
)
NUMBERS = {
    "--duration": 1,
    "--until-rest": 1,
    "--start": 3,
    "--goal": 3,
    "--wave-height": 1,
    "--periods": 1,
    "--following-error": 1,
    "--workspace": 6,
}


@pytest.mark.slow
@settings(max_examples=60)
@given(st.sampled_from(sorted(NUMBERS)), st.data())
def test_no_finite_number_ends_in_a_traceback(option, data):
    """Also without an hour of simulation: what passes lasts seconds."""
    values = [data.draw(EXTREME) for _ in range(NUMBERS[option])]
    length = [] if option == "--duration" and values[0] > 20 else ["--duration", 2]
    assume(option != "--duration" or not 20 < values[0] <= 3600)
    try:
        run("-o", "-", "-q", *length, f"{option}", *(repr(v) for v in values))
    except DmpError as error:
        assert str(error).count("\n") <= 1


def test_every_mistake_has_one_of_the_exit_codes():
    assert {e.exit_code for e in (InputError, RefusedError, InstrumentError)} == {2, 3, 4}
    assert all(issubclass(e, DmpError) for e in (InputError, RefusedError, InstrumentError))


@pytest.mark.slow
def test_recording_imports_nothing_that_it_does_not_need(tmp_path):
    script = (
        "import sys, typer; from dmpcli.commands import record; "
        "light = not {'numpy', 'pydantic', 'pyarrow', 'rich'} & set(sys.modules); "
        "app = typer.Typer(); app.command()(record.command); "
        f"out = {str(tmp_path / 'demo.parquet')!r}; "
        "app(['-o', out, '--duration', '2'], standalone_mode=False); "
        "heavy = [m for m in ('scipy', 'pandas', 'matplotlib') if m in sys.modules]; "
        "sys.exit(0 if light and not heavy else f'light {light}, heavy {heavy}')"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
