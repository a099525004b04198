"""The command line in this process, for tests of the commands."""

from typer.testing import CliRunner

from dmpcli.cli import app


def invoke(*words, stdin=None):
    """Run the command line, whatever comes of it."""
    return CliRunner().invoke(app, [*map(str, words)], input=stdin)


def ended(*words, expect=0):
    """Run the command line, which must end with this exit code."""
    result = invoke(*words)
    assert result.exit_code == expect, (words, result.output, result.stderr, result.exception)
    return result
