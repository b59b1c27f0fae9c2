"""Parts that all commands share: options, exit status, checks of repeated options, and types of paths."""

from collections.abc import Sequence
from typing import Any

import click

from hystfmu.base import InputError, keeping
from hystfmu.cli.signature import Later, OutputFile, OutputFolder
from hystfmu.report.terminal import NORMAL, QUIET, VERBOSE, level, set_json, set_level

BAD_INPUT = 2
INTERRUPTED = 130  # convention of shells for an interrupt: 128 plus the number of the signal


def _json(context: click.Context, option: click.Parameter, asked: bool) -> None:
    set_json(context, asked)


json_option = click.option("--json", is_flag=True, expose_value=False, callback=_json, help="Print the result as JSON.")


def _level(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    if level() != NORMAL:
        raise InputError("-v prints more and -q less. Got both.")
    set_level(context, VERBOSE if option.name == "verbose" else QUIET)


_FORCE = "hystfmu.force"  # of the command that runs, in its context
_HOW_MUCH = (
    (("-v", "--verbose"), "Also print details that the tables omit, and the run time of each part of the work."),
    (("-q", "--quiet"), "Print only problems. The exit status states the result."),
)


def _force(context: click.Context, option: click.Parameter, asked: bool) -> None:
    context.meta[_FORCE] = asked


class Command(click.Command):
    """A command with the options -v and -q, and with a message for an interrupt.

    If an option with one value is repeated, the command ends with an error; click alone would silently use the last
    value. A command that writes files has the option --force. Without --force, the command does not replace a file that
    has different content.

    Parameters
    ----------
    interrupted : str
        Message for an interrupt. It states which results remain. The command line follows the message.
    """

    _given: Sequence[click.Parameter | Later]
    _made: list[click.Parameter]

    def __init__(self, *words: Any, interrupted: str = "files are whole or as they were; again:", **named: Any) -> None:
        super().__init__(*words, **named)
        self.interrupted = interrupted

    @property
    def params(self) -> list[click.Parameter]:
        """Arguments and options; options from a signature are built at the first use, to keep `hystfmu --help` fast."""
        if not self._made:
            made = [p for given in self._given for p in (given.made() if isinstance(given, Later) else [given])]
            for names, text in _HOW_MUCH:
                made.append(click.Option(names, is_flag=True, expose_value=False, callback=_level, help=text))
            if any(isinstance(p.type, (OutputFile, OutputFolder)) for p in made):
                text = (
                    "Replace existing files. Without this option, an existing file with different content is an error."
                )
                made.append(click.Option(["--force"], is_flag=True, expose_value=False, callback=_force, help=text))
            self._made = made
        return self._made

    @params.setter
    def params(self, given: list[click.Parameter]) -> None:
        self._given, self._made = given, []

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with keeping(ctx.meta.get(_FORCE, False)):
            return super().invoke(ctx)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the words of the command line.

        Raises
        ------
        InputError
            An option with a single value is repeated.
        """
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        for option in given:
            once = isinstance(option, click.Option) and not (option.multiple or option.is_flag or option.count)
            if once and given.count(option) > 1:
                raise InputError(f"{option.opts[-1]} takes one value. Got it {given.count(option)} times.")
        return super().parse_args(ctx, args)
