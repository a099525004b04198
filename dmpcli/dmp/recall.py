"""What a skill gives back of a recording, so that skills learned in any way can be ranked.

Each is rolled out at the recording's own start, goal and length, and held against what was
recorded, beyond what the noise explains; not against what the skill's own learning made of it.
"""

import numpy as np

from dmpcli.dmp.basis_search import Quality, judged
from dmpcli.dmp.learning import lost_of, with_lost
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.paper_learning import rolled_out
from dmpcli.dmp.paper_preprocessing import prepare
from dmpcli.dmp.preprocessing import Preprocessed
from dmpcli.dmp.skill import Skill
from dmpcli.dmp.taught_strokes import TaughtStroke
from dmpcli.spatial.trajectory import Trajectory

# Samples of both that are compared.
_MOST = 8001
_LEAST = 2001


def recalled(skill: Skill, taught: TaughtStroke) -> Quality:
    """Hold a skill learned by a tolerance against one of its recordings.

    Parameters
    ----------
    skill : Skill
    taught : TaughtStroke
        The recording in the skill's coordinates.
    """
    share = np.linspace(0.0, 1.0, _count(taught.seen))
    x = taught.curve(share * taught.curve.duration)
    if not skill.closed and taught.length > 0.0:
        # The chart stretches along start-goal alone.
        x[:, 0] *= (skill.goal[0] - skill.start[0]) / taught.length
    r = skill.response(share * skill.duration)
    reproduced = r.between(skill, x[0], x[-1])
    return with_lost(judged(x, reproduced, skill.closed), [lost_of(taught.seen)])


def recalled_as_paper(
    skill: Skill, recording: Trajectory, seen: Preprocessed, choices: FitOptions
) -> Quality:
    """Hold a skill learned as the paper has it against one of its recordings.

    Parameters
    ----------
    skill : Skill
    recording : Trajectory
        As it was recorded.
    seen : Preprocessed
        The same, smoothed by its noise.
    choices : FitOptions
        By which the skill was learned.
    """
    own = prepare(recording, choices)
    share = np.linspace(0.0, 1.0, _count(seen))
    C, start = own.frame.axes, own.frame.start
    x, signal = rolled_out(skill, own, share)
    reproduced, demonstrated = np.zeros_like(x), np.zeros_like(x)
    reproduced[:, :3] = x[:, :3] if skill.model == "modified" else (x[:, :3] - start) @ C
    demonstrated[:, :3] = (seen.position(share * seen.duration) - start) @ C
    reproduced[:, 3:], demonstrated[:, 3:] = x[:, 3:], signal[:, 3:]
    return with_lost(judged(demonstrated, reproduced, skill.closed), [lost_of(seen)])


def _count(seen: Preprocessed) -> int:
    return int(np.clip(4 * len(seen.raw.t), _LEAST, _MOST))
