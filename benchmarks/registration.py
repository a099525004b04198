"""How far the poses of `register` can be trusted. ``make bench``.

Parts at random poses, touched at random by area with a noise of 0.1 mm on each axis, started within
10 mm and 10° of the truth. Wrong is what is accepted and more than 1.5 mm off at any point of the
part. ``python -m benchmarks.registration [TRIALS [PART ...]]``; ``none`` among the parts searches
all orientations.
"""

import sys
import time
from collections import Counter

import numpy as np

from dmpcli.surfaces.registration import LIMIT
from tests.surfaces.registration_trial import loaded, trial

PARTS = ("bracket", "carriage", "wedge", "angle_block")
COUNTS = (7, 8, 10, 12, 20, 30)


def main() -> None:
    """Print a Markdown table."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    names = [name for name in sys.argv[2:] if name != "none"] or PARTS
    anywhere = "none" in sys.argv[2:]
    print(
        "| part | points | accepted | wrong | within the bound | free | rival | uncertain "
        "| residual | ms |"
    )
    print("| --- " + "| ---: " * 9 + "|")
    for name in names:
        V, F, part = loaded(name)
        for count in COUNTS:
            begun = time.process_time()
            found = [trial(V, F, part, count, seed, anywhere=anywhere) for seed in range(trials)]
            spent = 1e3 * (time.process_time() - begun) / trials
            good = [(one.error, one.bound) for one in found if one.verdict == "accepted"]
            wrong = sum(error > LIMIT for error, _ in good)
            covered = f"{np.mean([e <= b for e, b in good]):.1%}" if good else ""
            why = Counter(one.verdict for one in found)
            print(
                f"| {name} | {count} | {len(good) / trials:.1%} | {wrong} of {trials} | {covered} "
                f"| {why['free']} | {why['rival']} | {why['uncertain']} | {why['residual']} "
                f"| {spent:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
