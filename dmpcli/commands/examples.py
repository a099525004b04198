"""What people type, command by command: the examples of every ``--help``, which the tests run.

They follow one another in one folder: what a later one reads, an earlier one wrote, or is one of
the files that a user has: meshes, pairs, goals over time, a tool without weight, a recording of
another program, a drawing, points touched on a mesh, and what a crash has left. A real cell is
named by the addresses `SENSOR` and `ROBOT`.
"""

from typing import NamedTuple

SENSOR, ROBOT = "netft://192.168.1.10", "elite://192.168.1.20"
"""What stands for the reader's own instruments."""


class Example(NamedTuple):
    """One command line and what it is for."""

    words: str
    line: str


EXAMPLES: dict[str, tuple[Example, ...]] = {
    "record": (
        Example(
            "Rehearse with the simulated lab, in simulated time.",
            "dmpcli record -o demo.parquet --seed 1",
        ),
        Example(
            "On a real arm, until the tool has rested for a second.",
            f"dmpcli record -o taught.parquet --tool tool.json --sensor {SENSOR} \\\n"
            f"    --robot {ROBOT} --until-rest 1 --log record.log",
        ),
        Example(
            "Every setting, and whether an option, a file, a preset or a default says it.",
            "dmpcli record --preset paper --print-config",
        ),
    ),
    "fit": (
        Example("Learn a skill of one recording.", "dmpcli fit demo.parquet -o skill.json"),
        Example(
            "Of another program's log, which counts seconds as time and metres as tx, ty, tz.",
            "dmpcli fit log.csv -o own.json --map t=time --map x=tx --map y=ty --map z=tz \\\n"
            "    --length-unit m",
        ),
        Example(
            "Of a stroke that was taught on a part, in the chart of its surface.",
            "dmpcli fit demo.parquet -o on_part.json --surface part.stl --regression ridge",
        ),
    ),
    "generalize": (
        Example(
            "At a new start and goal, from rest to rest, as execute needs it.",
            "dmpcli generalize skill.json -o trajectory.parquet --ease-in 0.5 --ease-out 0.5 \\\n"
            "    --start -701.7 132.4 -17.5 --goal -807.6 129.7 -17.5",
        ),
        Example(
            "On a mesh, the tool turning with the surface.",
            "dmpcli generalize skill.json -o curved.parquet --surface part.stl \\\n"
            "    --orientation surface --start -551.7 -37.6 -28.8 --goal -657.6 -43.3 -32.3",
        ),
        Example(
            "At many pairs, into a folder, by two processes.",
            "dmpcli generalize skill.json -o batch --pairs pairs.csv --jobs 2 \\\n"
            "    --ease-in 0.5 --ease-out 0.5",
        ),
    ),
    "execute": (
        Example(
            "Check a trajectory against every limit; send nothing.",
            "dmpcli execute trajectory.parquet --dry-run",
        ),
        Example(
            "Draw it with the simulated arm.", "dmpcli execute trajectory.parquet -o run.parquet"
        ),
        Example(
            "All strokes of a batch in one run, pressing with 5 N.",
            "dmpcli execute batch -o pressed.parquet --coupling force --force-setpoint 5",
        ),
        Example(
            "While its goal moves, by a table of t in s and x, y, z in mm.",
            "dmpcli execute trajectory.parquet -o moved.parquet --goal-from goals.csv",
        ),
        Example(
            "On a real arm, at half the speed, led to the start at 20 mm/s.",
            f"dmpcli execute trajectory.parquet -o drawn.parquet --robot {ROBOT} \\\n"
            "    --tool tool.json --speed 0.5 --approach 20 --log execute.log",
        ),
    ),
    "report": (
        Example(
            "By how much the drawn strokes differ from the taught one; figures into a folder.",
            "dmpcli report demo.parquet trajectory.parquet run.parquet -o report",
        ),
        Example(
            "Along a surface, as JSON for a program.",
            "dmpcli report demo.parquet curved.parquet --surface part.stl --json",
        ),
    ),
    "import": (
        Example(
            "Make a demonstration of a drawing, its pen at 40 mm/s.",
            "dmpcli import drawing.svg -o drawn_{id}.parquet --speed 40",
        ),
        Example(
            "Make one of another program's log.",
            "dmpcli import log.csv -o log.parquet --map t=time --map x=tx --map y=ty \\\n"
            "    --map z=tz --length-unit m",
        ),
    ),
    "export": (
        Example(
            "As a TUM file, by the suffix; evo reads it.",
            "dmpcli export run.parquet -o run.tum",
        ),
        Example(
            "As a program of a UR robot for each stroke of a batch.",
            "dmpcli export batch -o 'stroke_{id}.script'",
        ),
    ),
    "inspect": (
        Example(
            "Where on a part a skill can be drawn.",
            "dmpcli inspect part.stl --for skill.json",
        ),
        Example("What a file is, and what to do with it.", "dmpcli inspect skill.json"),
        Example("The JSON Schema of a kind of file.", "dmpcli inspect --schema tool"),
    ),
    "recover": (
        Example(
            "After a crash: the file of a recording that was cut short.",
            "dmpcli recover cut.parquet.journal -o cut.parquet",
        ),
    ),
    "register": (
        Example(
            "Where a part lies, of points touched on it.",
            "dmpcli register block.stl touched.csv -o pose.json",
        ),
    ),
    "simulate": (
        Example(
            "Serve a lab on the makers' own ports; Ctrl-C ends it.",
            "dmpcli simulate --duration 10",
        ),
        Example(
            "On free ports, with an emergency stop 3 s into the motion.",
            "dmpcli simulate --sensor-port 0 --http-port 0 --tcp-port 0 --robot-port 0 \\\n"
            "    --monitor-port 0 --fault estop@3",
        ),
    ),
    "calibrate": (
        Example(
            "With the simulated lab.",
            "dmpcli calibrate -o mock_tool.json",
        ),
        Example(
            "On a real arm, which turns the tool through twelve poses; nothing may touch it.",
            f"dmpcli calibrate -o tool.json --tool geometry.json --sensor {SENSOR} \\\n"
            f"    --robot {ROBOT} --save poses.parquet",
        ),
        Example(
            "Once more of the same poses, refusing a worse fit.",
            "dmpcli calibrate -o again.json --from poses.parquet --max-residual 0.2",
        ),
    ),
    "touch": (
        Example(
            "A point in every second, three of them; without --every at each Enter.",
            "dmpcli touch -o points.csv --every 1 --count 3",
        ),
    ),
    "check": (
        Example("Whether the simulated lab answers.", "dmpcli check"),
        Example(
            "Whether a cell is ready: reads robot and sensor, and moves nothing.",
            f"dmpcli check --robot {ROBOT} --sensor {SENSOR} --tool tool.json",
        ),
    ),
    "presets": (
        Example("Which presets there are, and what they set.", "dmpcli presets"),
        Example("One as a file to begin with.", "dmpcli presets paper > own.toml"),
    ),
    "info": (
        Example("Versions, extras and machine, for the report of a bug.", "dmpcli info"),
        Example("The same for a program.", "dmpcli info --json"),
    ),
}
"""Examples of each subcommand; they run in this order, `calibrate` first where a tool is named."""
