"""Options of the commands: built from the function that a command calls, and parts that all commands share.

The options are built from the signature and the numpydoc docstring of the function. Its source is parsed but not
imported. Therefore these options do not slow down `--help` and completion.
"""

import ast
import inspect
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from hystfmu.base import PACKAGE, InputError, keeping
from hystfmu.report.terminal import NORMAL, QUIET, VERBOSE, level, set_json, set_level

MOST_BYTES = 2**20  # of a file of settings
_UNITS = {"s": "SECONDS", "Hz": "HZ", "dB": "DB", "%": "PERCENT"}  # of measure, in a text, and metavars
_NUMBERS = {"int": int, "float": float}
_END = {"(": True, ")": True, "[": False, "]": False}  # whether an end of a range is open
_RANGE = re.compile(r" in ([(\[])([^,]+), ([^)\]]+)([)\]])")
_ENTRY = re.compile(r"^(\*{0,2}\w[\w, *]*?)(?: : (.*))?$")

if TYPE_CHECKING:
    _Text = click.ParamType[str]
else:  # generic from click 8.4 on only
    _Text = click.ParamType


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
        from hystfmu.base import check_target

        check_target(value, folder=self._folder)
        return value


FILE, OUTPUT_FILE, OUTPUT_FOLDER = File(), OutputFile(), OutputFolder()
WrittenFile = str
WrittenFolder = str
PATHS: dict[str, _Text] = {"WrittenFile": OUTPUT_FILE, "WrittenFolder": OUTPUT_FOLDER}
"""Types of the paths that a command has as own arguments, by their annotations."""

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


@dataclass(frozen=True)
class Argument:
    """Argument of a function: annotation with resolved aliases, default value if it is a literal, and docstring text.

    `leaves` contains the members of the annotated union: names of types, or literals in a tuple. `rule` is the type
    that the docstring states.
    """

    name: str
    leaves: tuple[str | tuple[Any, ...], ...]
    default: Any
    rule: str
    text: str

    def option(self, words: str, more: Mapping[str, Any], spelled: Mapping[str, str]) -> click.Option:
        """Return the option of the command line for this argument.

        Parameters
        ----------
        words : str
            Flags such as ``-o --out``, and the metavar. The default flag is the name of the argument.
        more : mapping
            Arguments of `click.Option` that replace the arguments derived from the signature.
        spelled : mapping
            Flag of each argument. In the text, flags replace the names of arguments.
        """
        flags = [w for w in words.split() if w.startswith("-")] or [f"--{self.name.replace('_', '-')}"]
        metavar = " ".join(w for w in words.split() if not w.startswith("-")) or None
        text = re.sub(r"`([\w.]+)`", lambda m: spelled.get(m[1], m[1]), self.text.replace("``", "")).replace("`", "")
        made: dict[str, Any] = {"metavar": metavar, "default": self.default}
        if path := next((PATHS[leaf] for leaf in self.leaves if leaf in PATHS), None):
            made["type"] = path
        number = next((n for n in ("float", "int") if n in self.leaves), None)
        if number and {*self.leaves} <= {"int", "float", "None"}:
            unit = re.search(r"\((\w+|%)\)", text)
            made |= {"type": self._range(_NUMBERS[number]), "default": self.default}
            made["metavar"] = metavar or (_UNITS.get(unit[1]) if unit else None)
        elif self.leaves == ("bool",):
            made = {"is_flag": True}
            text = re.sub(r"^Whether (?:to )?(.)", lambda m: m[1].upper(), text)
            if self.default:  # the option switches the default behaviour off
                flags, text = [f"--un{self.name}"], f"Without this option, {text[:1].lower()}{text[1:]}"
                made["callback"] = lambda context, option, given: not given
        elif all(isinstance(leaf, tuple) for leaf in self.leaves if leaf != "None"):
            values = [v for leaf in self.leaves if isinstance(leaf, tuple) for v in leaf]
            made |= {"type": click.Choice([str(v) for v in values]), "metavar": None}
            made["default"] = None if self.default is None else str(self.default)
            made["callback"] = lambda context, option, given: {str(v): v for v in values}.get(given)
        elif "Mapping" in self.leaves:
            made = {"multiple": True, "metavar": metavar or "NAME=VALUE"}
            made["callback"] = lambda context, option, given: assignments(given, option.opts[-1])
            text += " Repeatable. @FILE.json reads names and values from a JSON file."
        elif "Sequence" in self.leaves or ("tuple" in self.leaves and "multiple" in more):
            made = {
                "multiple": True,
                "metavar": metavar,
                "callback": lambda context, option, given: given or self.default,
            }
            text += " Repeatable."
        made["show_default"] = made.get("default") not in (None, "")
        made = {"help": text, **made, **more}
        if made.get("required"):
            del made["default"]  # click 8.3 and newer take None for a given default
        kind: type[click.Option] = made.pop("cls", click.Option)
        return kind([self.name, *flags], **made)

    def _range(self, number: type) -> Any:
        found = _RANGE.search(self.rule)
        if found is None:
            return number
        low, high = (None if "inf" in end else json.loads(end) for end in found.group(2, 3))
        of = click.IntRange if number is int else click.FloatRange
        return of(low, high, min_open=_END[found[1]] and low is not None, max_open=_END[found[4]] and high is not None)


class Signature:
    """Arguments of a function or method, or fields of a data class. A default that is not a literal is ignored.

    Parameters
    ----------
    home : str
        Module in the package, and name of the function or class, such as ``"scenario.running:run"``.
    """

    def __init__(self, home: str) -> None:
        module, _, name = home.partition(":")
        tree = _tree(module)
        node: Any = tree
        for part in name.replace(".<locals>", "").split("."):
            node = next(n for n in node.body if getattr(n, "name", "") == part)
        texts = _texts(inspect.cleandoc(ast.get_docstring(node) or ""))
        given: list[tuple[str, ast.expr | None, ast.expr | None]] = []
        if isinstance(node, ast.ClassDef):
            fields = [n for n in node.body if isinstance(n, ast.AnnAssign)]
            given = [(n.target.id, n.annotation, None) for n in fields if isinstance(n.target, ast.Name)]
        else:
            a = node.args
            defaults = [*[None] * (len(a.args) - len(a.defaults)), *a.defaults]
            given = [(n.arg, n.annotation, d) for n, d in zip(a.args, defaults, strict=True)]
            given += [(n.arg, n.annotation, d) for n, d in zip(a.kwonlyargs, a.kw_defaults, strict=True)]
            if a.kwarg is not None:
                given.append((a.kwarg.arg, ast.parse("Mapping[str, Any]", mode="eval").body, None))
        self.arguments = {
            name: Argument(name, tuple(_leaves(hint, module)), _literal(default), *texts.get(name, ("", "")))
            for name, hint, default in given
        }


@cache
def _tree(module: str) -> ast.Module:
    path = PACKAGE.joinpath(*module.split("."))
    return ast.parse((path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(encoding="utf-8"))


@cache
def _names(module: str) -> dict[str, ast.stmt]:
    """Return the assignment or import of each name of a module, also of those that only a type checker imports."""
    found: dict[str, ast.stmt] = {}
    for n in _tree(module).body:
        for part in n.body if isinstance(n, ast.If) else [n]:
            if isinstance(part, ast.Assign) and isinstance(part.targets[0], ast.Name):
                found[part.targets[0].id] = part
            elif isinstance(part, ast.ImportFrom):
                found |= dict.fromkeys((a.name for a in part.names), part)
    return found


def structures() -> dict[str, str]:
    """Return the names and descriptions of the controller structures in `hystfmu.design.structures`."""
    calls = [n for n in ast.walk(_tree("design.structures")) if isinstance(n, ast.Call)]
    pairs = [c.args[:2] for c in calls if isinstance(c.func, ast.Name) and c.func.id == "Structure"]
    return {ast.literal_eval(name): ast.literal_eval(text) for name, text in pairs}


def _literal(default: ast.expr | None) -> Any:
    try:
        return None if default is None else ast.literal_eval(default)
    except ValueError:
        return None


def _leaves(hint: ast.expr | None, module: str) -> list[str | tuple[Any, ...]]:
    """Return the members of an annotated union. An alias is replaced by its definition, also from another module."""
    if isinstance(hint, ast.BinOp):
        return [*_leaves(hint.left, module), *_leaves(hint.right, module)]
    if isinstance(hint, ast.Subscript) and isinstance(hint.value, ast.Name):
        if hint.value.id == "Literal":
            return [
                ast.literal_eval(hint.slice) if isinstance(hint.slice, ast.Tuple) else (ast.literal_eval(hint.slice),)
            ]
        return [hint.value.id]
    if not isinstance(hint, ast.Name):
        return ["None"]
    meant = None if hint.id in PATHS else _names(module).get(hint.id)
    if isinstance(meant, ast.Assign):
        return _leaves(meant.value, module)
    if isinstance(meant, ast.ImportFrom) and meant.module and meant.module.startswith("hystfmu."):
        return _leaves(hint, meant.module.removeprefix("hystfmu."))
    return [hint.id]


def _texts(doc: str) -> dict[str, tuple[str, str]]:
    """Return the type and the first paragraph of the text for each argument in a numpydoc docstring."""
    section = re.search(r"^(?:Parameters|Attributes)\n-+\n(.*?)(?=\n\n\w[^\n]*\n-+\n|\Z)", doc, re.M | re.S)
    found: dict[str, tuple[str, str]] = {}
    for entry in re.split(r"\n(?=\S)", section[1]) if section else []:
        head, _, text = entry.partition("\n")
        if named := _ENTRY.match(head):
            first = " ".join(inspect.cleandoc(text).split("\n\n")[0].split())
            found |= {name.strip(" *"): (named[2] or "", first) for name in named[1].split(",")}
    return found


@dataclass(frozen=True)
class Later:
    """Options that are built when the command first needs them."""

    made: Callable[[], list[click.Parameter]]


def of(home: str, **options: str | tuple[str, Mapping[str, Any]]) -> Decorator:
    """Return a decorator that adds arguments of a function to a command as options, under the names of the arguments.

    Parameters
    ----------
    home : str
        See `Signature`. If it is empty, the options are own arguments of the command. The docstring of a command
        describes its own arguments behind a form feed, where click ends the text of the help.
    **options
        Flags and metavar of each option as text, such as ``-o --out OUT.csv``. If the text contains no flag, the name
        of the argument becomes the flag. A pair of this text and a dict adds arguments of `click.Option`.
    """

    def decorate(f: Callable[..., Any]) -> Callable[..., Any]:
        at = home or f"{f.__module__.removeprefix('hystfmu.')}:{f.__qualname__}"

        def made() -> list[click.Parameter]:
            arguments = Signature(at).arguments
            pairs = {name: (given, {}) if isinstance(given, str) else given for name, given in options.items()}
            flags = {
                n: next((w for w in words.split() if w.startswith("-")), f"--{n}") for n, (words, _) in pairs.items()
            }
            return [arguments[name].option(words, more, flags) for name, (words, more) in pairs.items()]

        f.__dict__.setdefault("__click_params__", []).append(Later(made))
        return f

    return decorate


def assignments(pairs: Sequence[str], option: str = "--set") -> dict[str, Any]:
    """Return the names and values from `pairs`: texts `name=value`, and names `@FILE` of files with a JSON object.

    A value that is valid JSON is parsed as JSON, any other value is text. A value on the command line overrides the
    value in a file. Error messages name `option`.

    Raises
    ------
    InputError
        A pair is not of the form name=value, a name is repeated, or a file is invalid.
    """
    values: dict[str, Any] = {}
    named: set[str] = set()
    for pair in pairs:
        if pair.startswith("@"):
            values |= _settings(pair[1:], option)
            continue
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise InputError(f"{option} must read name=value. Got {pair!r} instead.")
        if name in named:
            raise InputError(f"{option} {name} takes one value. Got it more than once.")
        named.add(name)
        try:
            values[name] = json.loads(text)
        except json.JSONDecodeError:
            values[name] = text
    return values


def _settings(path: str, option: str) -> dict[str, Any]:
    from hystfmu.base import read_bytes

    try:
        values = json.loads(read_bytes(path, MOST_BYTES))
    except ValueError as e:
        raise e if isinstance(e, InputError) else InputError(f"{path}: {option} @FILE must hold JSON. {e}") from None
    if not isinstance(values, dict):
        raise InputError(f"{path}: {option} @FILE must hold an object of name: value. Got {type(values).__name__}.")
    return values


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

    def __init__(self, *words: Any, interrupted: str = "no file is incomplete; to repeat:", **named: Any) -> None:
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
