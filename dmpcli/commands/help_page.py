"""How a subcommand's help looks: the terminal's whole width, each default, and the examples."""

import shutil
from typing import Any

from typer.core import TyperCommand

from dmpcli.commands.examples import EXAMPLES

NARROWEST = 80


def width() -> int:
    """Return the columns that help may take: the terminal's, and 80 where there is none."""
    return max(shutil.get_terminal_size((NARROWEST, 24)).columns, NARROWEST)


class HelpedCommand(TyperCommand):
    """One subcommand."""

    def __init__(self, *words: Any, **said: Any) -> None:
        super().__init__(*words, **said)
        for option in self.params:
            _state_default(option)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words; who asks for the settings alone need not name files."""
        before = args[: args.index("--")] if "--" in args else args
        needed = [option for option in self.params if option.required]
        for option in needed:
            option.required = "--print-config" not in before
        try:
            return super().parse_args(ctx, args)
        finally:
            for option in needed:
                option.required = True

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the examples, each line as it is typed."""
        del ctx
        examples = EXAMPLES.get(str(self.name), ())
        if not examples:
            return
        with formatter.section("Examples"):
            for one in examples:
                for line in (f"# {one.words}", *one.line.split("\n")):
                    formatter.write(f"{'':>{formatter.current_indent}}{line}\n")


def _state_default(option: Any) -> None:
    """Say of an option what holds without it, where nothing else does."""
    text = getattr(option, "help", None)
    if option.param_type_name != "option" or text is None or option.required:
        return
    if "[default: " in text or "--help" in option.opts or (option.show_default and option.default):
        return
    option.help = f"{text}  [default: {'off' if option.is_flag else 'none'}]"
