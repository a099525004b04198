"""A skill with the file that it is, or will be, written as."""

from dataclasses import dataclass, fields

from dmpcli.dmp.skill import Skill
from dmpcli.records import skill as skill_file
from dmpcli.records.file_io import Source
from dmpcli.records.skill import SkillFile


@dataclass(frozen=True, kw_only=True)
class LearnedSkill(Skill):
    """A skill that knows where it comes from.

    Attributes
    ----------
    file : SkillFile
        What stands in its file beside the primitives: how well each demonstration is kept, options
        and inputs.
    content : bytes
        Of the file.
    sha256 : str
        Of the content.
    name : str
        What messages call it.
    """

    file: SkillFile
    content: bytes
    sha256: str
    name: str

    def plain(self) -> Skill:
        """Return the primitives alone: what travels to other processes."""
        return Skill(**{each.name: getattr(self, each.name) for each in fields(Skill)})


def read(source: Source) -> LearnedSkill:
    """Read a skill file.

    Raises
    ------
    InputError
        As `records.skill.decode`.
    """
    skill, file = skill_file.decode(source)
    own = {each.name: getattr(skill, each.name) for each in fields(skill)}
    return LearnedSkill(
        **own, file=file, content=source.content, sha256=source.sha256, name=source.name
    )
