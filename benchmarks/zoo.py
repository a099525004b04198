"""Strokes on CAD-like parts, judged by potpourri3d. ``python -m benchmarks.zoo [PAIRS] [SEED]``.

Sixteen parts (tests/surfaces/zoo.py), each as a binary STL. Waves of 5 mm over 10 to 30 mm, 300
samples: pairs that lie on one smooth patch, and pairs traced at random over the whole part. Wrong
is what ends more than 0.01 mm off, is torn, is off the mesh or leans more than 15° off its facet;
a reason is confirmed where the tracer meets it on the same centre line.
"""

import sys
from collections import Counter

from tests.surfaces import zoo
from tests.surfaces.judge import Verdict, verdicts


def row(name: str, found: tuple[Verdict, Verdict], faces: str, noisy: str) -> str:
    """Return a line of a Markdown table."""
    cells = [name, faces, noisy]
    for one in found:
        why = ", ".join(f"{status} {count}" for status, count in sorted(one.refused.items()))
        cells += [f"{one.drawn} of {one.count}", str(sum(one.wrong.values())), why or "-"]
    cells.append(str(sum(len(one.unconfirmed) for one in found)))
    return f"| {' | '.join(cells)} |"


def added(verdicts: list[Verdict]) -> Verdict:
    """Return the verdict on all of some pairs."""
    wrong, refused = Counter[str](), Counter[str]()
    for one in verdicts:
        wrong.update(one.wrong)
        refused.update(one.refused)
    return Verdict(
        sum(one.count for one in verdicts),
        sum(one.drawn for one in verdicts),
        dict(wrong),
        dict(refused),
        [reason for one in verdicts for reason in one.unconfirmed],
    )


def main() -> None:
    """Print a Markdown table."""
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    print(
        "| part | faces | noisy, % of area | on one patch: drawn | wrong | refused | traced: drawn "
        "| wrong | refused | unconfirmed |"
    )
    print("| --- | ---: | ---: | ---: | ---: | --- | ---: | ---: | --- | ---: |")
    all_found = []
    for name in zoo.PARTS:
        mesh = zoo.mesh(name)
        found = verdicts(mesh, pairs, seed)
        all_found.append(found)
        noisy = f"{100.0 * mesh.shape.noisy_share:.1f}"
        print(row(name, found, str(len(mesh.F)), noisy), flush=True)
    patches, anywhere = (added(list(some)) for some in zip(*all_found, strict=True))
    print(row("all", (patches, anywhere), "", ""))


if __name__ == "__main__":
    main()
