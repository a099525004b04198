"""The whole tool-chain through the installed command: pipes, bytes, the paper's bounds."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from dmpcli.records import file_io, record, schemas
from tests.pipeline.conftest import DMPCLI

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "sample_runs" / "reference.parquet"
RECORDED = ROOT / "sample_runs" / "recorded.parquet"
PAIR = ["--start", "-701.698", "132.420", "-17.538", "--goal", "-807.597", "129.739", "-17.518"]


def heights(run, *files):
    """Mean wave height by stroke name."""
    report = json.loads(run("report", *files, "--json").stdout)
    strokes = [stroke for file in report["files"] for stroke in file["strokes"]]
    return {stroke["stroke"]: stroke["wave"]["mean"] for stroke in strokes}


def shell(command, folder):
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"],
        cwd=folder,
        capture_output=True,
        check=False,
        env={"PATH": f"{Path(DMPCLI).parent}:/usr/bin:/bin"},
    )


@pytest.mark.slow
def test_record_to_report(dmpcli, in_process, tmp_path):
    """What the pipe below starts as processes, and a report, are called here."""
    in_process("record", "-o", "demo.parquet", "--seed", "1")
    in_process("fit", "demo.parquet", "-o", "skill.json")
    ease = ["--ease-in", "0.5", "--ease-out", "0.5"]
    in_process("generalize", "skill.json", "-o", "traj.parquet", *PAIR, *ease)
    dmpcli("execute", "traj.parquet", "-o", "run.parquet")
    files = ["demo.parquet", "traj.parquet", "run.parquet"]
    assert b"nearest RMS" in dmpcli("report", *files).stdout
    done = in_process("report", *files, "--paper", "--png", "-o", "out")
    assert "Table 2" in done.stdout
    for stem in ("fig7", "fig8"):
        for suffix in ("svg", "png"):
            assert list((tmp_path / "out").glob(f"{stem}*.{suffix}"))
    run = record.decode(file_io.read(tmp_path / "run.parquet"), schemas.RUN)
    assert np.abs(run.position("plan") - run.position("sent")).max() < 1e-9


@pytest.mark.slow
def test_the_pipe_of_the_readme(tmp_path):
    pipe = (
        "dmpcli record -o - | dmpcli fit - -o - | dmpcli generalize - -o - "
        "--start -700 130 -17.5 --goal -800 130 -17.5 > traj.parquet"
    )
    done = shell(pipe, tmp_path)
    assert done.returncode == 0, done.stderr.decode()
    found = record.decode(file_io.read(tmp_path / "traj.parquet"), schemas.TRAJECTORY)
    np.testing.assert_allclose(found.position()[0], [-700, 130, -17.5])


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_bytes_through_every_stage(dmpcli, in_process, tmp_path):
    """Also in a process that did other things before."""
    for run, call in (("a", dmpcli), ("b", in_process)):
        (tmp_path / run).mkdir()
        call("record", "-o", f"{run}/demo.parquet", "--seed", "7", "--duration", "4")
        call("fit", f"{run}/demo.parquet", "-o", f"{run}/skill.json")
        call("generalize", f"{run}/skill.json", "-o", f"{run}/traj.parquet", *PAIR)
        call("report", f"{run}/demo.parquet", f"{run}/traj.parquet", "-o", f"{run}/report")
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) >= 8
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes(), file
    in_process("record", "-o", "other.parquet", "--seed", "8", "--duration", "4")
    assert (tmp_path / "other.parquet").read_bytes() != (tmp_path / "a/demo.parquet").read_bytes()


@pytest.mark.slow
def test_the_sample_runs_are_what_the_tool_makes(in_process, tmp_path):
    config = ROOT / "sample_runs" / "recorded.toml"
    in_process("record", "-o", "again.parquet", "--config", config, "--seed", "1")
    again = record.decode(file_io.read(tmp_path / "again.parquet"))
    kept = record.decode(file_io.read(RECORDED))
    assert again.provenance == kept.provenance
    # Not the bytes: the last bit of a sine may differ between processor types.
    np.testing.assert_allclose(again.position(), kept.position(), atol=1e-6)
    assert kept.provenance.facts["simulated"] is True


@pytest.mark.slow
def test_the_recorded_samples_wave_height_is_the_papers(in_process):
    found = heights(in_process, RECORDED)
    assert found["recorded"] == pytest.approx(49.979, abs=0.3)


@pytest.fixture
def fitted(in_process, tmp_path):
    def run(name, *options):
        in_process("fit", REFERENCE, "-o", f"{name}.json", *options)
        in_process("generalize", f"{name}.json", "-o", f"{name}1.parquet", "--reproduce")
        in_process("generalize", f"{name}.json", "-o", f"{name}2.parquet", *PAIR)
        return json.loads((tmp_path / f"{name}.json").read_text())["reproduction"][0]

    return run


@pytest.mark.slow
def test_tables_1_and_2_reach_the_promised_bounds(in_process, fitted):
    paper = ["--preset", "paper"]
    lwr, ridge = fitted("lwr"), fitted("ridge", "--regression", "ridge")
    fitted("paper", *paper)
    fitted("original", *paper, "--model", "original")
    names = ("lwr", "ridge", "paper", "original")
    files = [f"{name}{table}.parquet" for name in names for table in (1, 2)]
    found = heights(in_process, REFERENCE, *files)
    demonstrated = found["reference"]
    assert abs(found["original1"] - 47.669) <= 0.5
    for table in (1, 2):
        assert found[f"paper{table}"] >= 49.16
        assert abs(found[f"lwr{table}"] - demonstrated) <= 0.05
        assert abs(found[f"ridge{table}"] - demonstrated) <= 0.005
    assert lwr["rms"] <= 0.05
    assert ridge["rms"] <= 0.002
    assert max(lwr["end"], ridge["end"]) <= 0.01


@pytest.mark.slow
def test_an_interrupted_writer_leaves_the_old_file(in_process, tmp_path):
    in_process("fit", REFERENCE, "-o", "skill.json")
    before = (tmp_path / "skill.json").read_bytes()
    slow = f"(head -c 3000 {REFERENCE}; sleep 5) | timeout -s KILL 2 {DMPCLI} fit - -o skill.json"
    assert shell(slow, tmp_path).returncode != 0
    assert (tmp_path / "skill.json").read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["skill.json"]


@pytest.mark.thorough
def test_nothing_but_data_goes_to_standard_output(dmpcli):
    skill = dmpcli("fit", REFERENCE, "-o", "-").stdout
    assert json.loads(skill)["schema"] == "skill"
    drawn = dmpcli("generalize", "-", "-o", "-", *PAIR, stdin=skill).stdout
    run = dmpcli("execute", "-", "-o", "-", stdin=drawn).stdout
    assert record.decode(file_io.Source("run", run)).schema is schemas.RUN


NO_INPUT = [b"", b"PAR1", b"\x00\x01\x02"]
NO_INPUT_BUT_A_FILE = [b"{}", b"t,x,y,z\n"]  # inspect says what these are


@pytest.mark.parametrize(
    ("command", "content"),
    [(c, x) for c in ("fit", "report", "inspect", "execute", "generalize") for x in NO_INPUT]
    + [(c, x) for c in ("fit", "report", "execute", "generalize") for x in NO_INPUT_BUT_A_FILE],
)
def test_every_command_refuses_what_is_no_input_in_a_line_or_two(
    in_process, tmp_path, command, content
):
    (tmp_path / "input").write_bytes(content)
    output = [] if command in ("report", "inspect") else ["-o", "output"]
    ends = PAIR if command == "generalize" else []
    said = in_process(command, "input", *output, *ends, code=2).stderr
    assert "input" in said
    assert len(said.strip().splitlines()) <= 2
    assert [p.name for p in tmp_path.iterdir()] == ["input"]


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("command", ["fit demo -o -", "record -o - --duration 2", "inspect demo"])
def test_a_full_or_closed_standard_output_is_one_line_and_a_lost_reader_is_sigpipe(
    tmp_path, command
):
    (tmp_path / "demo").write_bytes(REFERENCE.read_bytes())
    for redirection in ("> /dev/full", ">&-"):
        done = shell(
            f"dmpcli {command} -q {redirection}".replace("inspect demo -q", "inspect demo"),
            tmp_path,
        )
        said = done.stderr.decode()
        assert done.returncode == 2, said
        assert said.startswith("dmpcli: standard output: ")
        assert len(said.strip().splitlines()) == 1
    lost = shell(f"dmpcli {command} | true; exit ${{PIPESTATUS[0]}}", tmp_path)
    assert lost.returncode in (0, 141)
    assert b"Traceback" not in lost.stderr
    assert b"Exception" not in lost.stderr


@pytest.mark.slow
def test_a_closed_standard_input_is_one_line(tmp_path):
    done = shell("dmpcli fit - -o skill.json <&-", tmp_path)
    assert done.returncode == 2
    assert done.stderr.decode() == "dmpcli: standard input: is closed; name a file\n"


@pytest.mark.slow
def test_a_skill_that_is_not_the_stroke_is_said_so_even_when_quiet(in_process):
    said = in_process("fit", REFERENCE, "-o", "s.json", "--cutoff", "0.02", "-q").stderr
    assert "smoothing took off much of the stroke" in said
    assert in_process("fit", REFERENCE, "-o", "s.json", "-q").stderr == ""


@pytest.mark.thorough
def test_a_report_leaves_no_figures_of_an_older_one(in_process, tmp_path):
    in_process("fit", REFERENCE, "-o", "s.json")
    in_process("generalize", "s.json", "-o", "1.parquet", "--reproduce")
    in_process("generalize", "s.json", "-o", "2.parquet", *PAIR)
    in_process("report", REFERENCE, "1.parquet", "--paper", "-o", "out")
    in_process("report", REFERENCE, "2.parquet", "--paper", "-o", "out")
    names = {p.name[:4] for p in (tmp_path / "out").glob("fig*")}
    assert {"fig7", "fig8"} <= names
    assert not {"fig5", "fig6"} & names
    in_process("report", "none.parquet", "-o", "never", code=2)
    assert not (tmp_path / "never").exists()
