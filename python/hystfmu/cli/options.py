"""Shared parts of the commands: checks of repeated options, exit status, file names, `--set` and `--json`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from hystfmu.base.errors import InputError
from hystfmu.base.files import keeping
from hystfmu.report.terminal import NORMAL, QUIET, VERBOSE, level, set_level

if TYPE_CHECKING:
    _Text = click.ParamType[str]
else:  # generic from click 8.4 on only
    _Text = click.ParamType

FAILED, BAD_INPUT = 1, 2
INTERRUPTED = 130  # as a shell tells of an interrupt: 128 and the number of the signal
MOST_BYTES = 2**20  # of a file of settings

json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
unconfined_option = click.option(
    "--unconfined",
    is_flag=True,
    help="Run foreign FMUs with your rights, for example if one needs a licence server or another program.",
)


def _level(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    if level() != NORMAL:
        raise InputError("-v prints more and -q less. Got both.")
    set_level(context, VERBOSE if option.name == "verbose" else QUIET)


_FORCE = "hystfmu.force"  # of the command that runs, in its context
_HOW_MUCH = (
    (("-v", "--verbose"), "Print also the details behind the tables, and the time of each step."),
    (("-q", "--quiet"), "Print problems only; the exit status states the outcome."),
)


def _force(context: click.Context, option: click.Parameter, asked: bool) -> None:
    context.meta[_FORCE] = asked


class Command(click.Command):
    """A command that takes -v and -q, and states what remains after an interrupt.

    The command refuses a repeated option of one value; click would silently take the last value. A command that writes
    files has the option --force. Without --force it does not replace a file with different content.

    Parameters
    ----------
    interrupted : str
        Text that states what remains after an interrupt; the command to repeat follows.
    """

    def __init__(self, *words: Any, interrupted: str = "files are whole or as they were; again:", **named: Any) -> None:
        super().__init__(*words, **named)
        self.interrupted = interrupted
        for names, text in _HOW_MUCH:
            self.params.append(click.Option(names, is_flag=True, expose_value=False, callback=_level, help=text))
        if any(isinstance(p.type, (OutputFile, OutputFolder)) for p in self.params):
            text = "Replace existing files with different content.  Without this option such a file is an error."
            self.params.append(click.Option(["--force"], is_flag=True, expose_value=False, callback=_force, help=text))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with keeping(ctx.meta.get(_FORCE, False)):
            return super().invoke(ctx)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the words of the command line.

        Raises
        ------
        InputError
            An option of one value is repeated.
        """
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        for option in given:
            once = isinstance(option, click.Option) and not (option.multiple or option.is_flag or option.count)
            if once and given.count(option) > 1:
                raise InputError(f"{option.opts[-1]} takes one value. Got it {given.count(option)} times.")
        return super().parse_args(ctx, args)


class File(_Text):
    """A file or folder to read. A shell completes the path."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Leave the completion of a path to the shell."""
        return [CompletionItem(incomplete, type="file")]


class OutputFolder(File):
    """A folder to write into."""

    name = "folder"


class OutputFile(File):
    """A file to write; an invalid path is reported before the command runs.

    Parameters
    ----------
    folder : bool
        Whether the folder of the file must exist. If False, the command makes the folder.
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


def assignments(pairs: tuple[str, ...]) -> dict[str, Any]:
    """Parse `--set name=value`, and `--set @FILE`, a file with a JSON object of names and values.

    A value is read as JSON if possible, else as text. A value on the command line overrides the value in a file.

    Raises
    ------
    InputError
        A pair is not of the form name=value, a name is repeated, or a file is invalid.
    """
    values: dict[str, Any] = {}
    named: set[str] = set()
    for pair in pairs:
        if pair.startswith("@"):
            values |= _settings(pair[1:])
            continue
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise InputError(f"--set must read name=value. Got {pair!r} instead.")
        if name in named:
            raise InputError(f"--set {name} takes one value. Got it more than once.")
        named.add(name)
        try:
            values[name] = json.loads(text)
        except json.JSONDecodeError:
            values[name] = text
    return values


def _settings(path: str) -> dict[str, Any]:
    from hystfmu.base.files import read_bytes  # brings pydantic, which --help does without

    try:
        values = json.loads(read_bytes(path, MOST_BYTES))
    except ValueError as e:
        raise e if isinstance(e, InputError) else InputError(f"{path}: --set @FILE must hold JSON. {e}") from None
    if not isinstance(values, dict):
        raise InputError(f"{path}: --set @FILE must hold an object of name: value. Got {type(values).__name__}.")
    return values
