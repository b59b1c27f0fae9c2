"""Parts that all commands share: options, exit status, checks of repeated options, and types of paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from hystfmu.base.errors import InputError
from hystfmu.base.files import keeping
from hystfmu.cli.signature import Later
from hystfmu.report.terminal import NORMAL, QUIET, VERBOSE, level, set_level

if TYPE_CHECKING:
    _Text = click.ParamType[str]
else:  # generic from click 8.4 on only
    _Text = click.ParamType

FAILED, BAD_INPUT = 1, 2
INTERRUPTED = 130  # convention of shells for an interrupt: 128 plus the number of the signal

json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")


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


class File(_Text):
    """Type of a path to read. The shell completes such a path."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return an item that makes the shell complete the path."""
        return [CompletionItem(incomplete, type="file")]


class OutputFolder(File):
    """Type of a folder into which a command writes files."""

    name = "folder"


class OutputFile(File):
    """Type of a file to write. An invalid path is reported before the command starts its work.

    Parameters
    ----------
    folder : bool
        Whether the folder of the file must exist. If False, the command creates the folder.
    """

    def __init__(self, folder: bool = True) -> None:
        self._folder = folder

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Check the path.

        Raises
        ------
        InputError
            The folder of the file is missing, or the path is read-only, a device, a pipe or a socket.
        """
        from hystfmu.base.files import check_target  # brings pydantic, which --help does without

        check_target(value, folder=self._folder)
        return value


FILE, OUTPUT_FILE, OUTPUT_FOLDER = File(), OutputFile(), OutputFolder()
