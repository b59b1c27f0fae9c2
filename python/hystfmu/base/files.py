"""Read untrusted input files with size limits and one-line errors; write files atomically.

Only regular files are replaced. A command may replace files that it wrote itself; with the option --force it may
replace all files. Writing the same content again is always allowed. In Python, the functions `save` and `export` always
replace an existing file.
"""

import os
import re
import secrets
import stat
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

import tomli_w

from hystfmu.base.errors import InputError, meant, meant_file
from hystfmu.base.printable import printable, unprintable

if TYPE_CHECKING:  # not imported at run time, so that `hystfmu --help` starts fast
    import pydantic

_CHUNK = 2**20


@dataclass(frozen=True)
class _Rule:
    """Files that the running command may replace."""

    force: bool
    own: set[Path] = field(default_factory=set)  # files, and folders with all files in them


@dataclass(frozen=True)
class _New:
    """A completely written file that still has a temporary name."""

    file: Path
    target: Path
    shown: str
    apart: re.Pattern[bytes] | None


_RULE: ContextVar[_Rule | None] = ContextVar("rule", default=None)
_WAITING: ContextVar[list[_New] | None] = ContextVar("waiting", default=None)


@contextmanager
def keeping(force: bool) -> Iterator[None]:
    """Within this context, refuse to replace a file by different content unless `force` is true."""
    before = _RULE.set(_Rule(force))
    try:
        yield
    finally:
        _RULE.reset(before)


def own(*paths: str | Path) -> None:
    """Permit the running command to replace the given files, and all files in the given folders.

    These are files that the command wrote in an earlier run, or files that the user wants to change by the command.
    """
    if rule := _RULE.get():
        rule.own.update(_real(p) for p in paths)


def may_replace(path: str | Path) -> bool:
    """Return whether the command may replace the file at `path` by different content."""
    rule, real = _RULE.get(), _real(path)
    return rule is None or rule.force or not real.exists() or any(p in rule.own for p in (real, *real.parents))


def refuse_existing(*paths: str | Path) -> None:
    """Raise an error if one of the files exists and the command may not replace this file.

    The check takes place before the command computes anything. It is used for files whose content differs in each run.

    Raises
    ------
    InputError
        One of these files exists, and the command may not replace this file.
    """
    for path in paths:
        if not may_replace(path):
            raise refusal(path)


def refusal(path: str | Path) -> InputError:
    """Return the error for a file that must not be replaced."""
    return InputError(f"{path}: exists with different content. Name another file, or replace it with --force.")


@contextmanager
def together() -> Iterator[None]:
    """Give all files written in this context their final names at the end of the context.

    After an exception, no file is renamed. A context inside another one ends with the outer context.
    """
    if _WAITING.get() is not None:
        yield
        return
    waiting: list[_New] = []
    before = _WAITING.set(waiting)
    try:
        yield
        placed = [new for new in waiting if _is_wanted(new)]
        for new in placed:
            os.replace(new.file, new.target)
            own(new.target)
    finally:
        _WAITING.reset(before)
        for new in waiting:
            new.file.unlink(missing_ok=True)


def place(file: Path, target: Path, shown: str | Path, apart: re.Pattern[bytes] | None = None) -> None:
    """Rename a written file to its final name, immediately or at the end of the context `together`.

    If the target already has the same content, the written file is removed.

    `file` and `target` are in the same folder. `shown` is the path of the target in the form that the user gave. Text
    that matches `apart`, such as the run time of a fit, is ignored when old and new content are compared.

    Raises
    ------
    InputError
        The target has other content, and the command may not replace the target.
    """
    new, waiting = _New(file, target, str(shown), apart), _WAITING.get()
    if not _is_wanted(new):
        file.unlink()
    elif waiting is not None:
        waiting.append(new)
    else:
        os.replace(file, target)
        own(target)


def _is_wanted(new: _New) -> bool:
    if may_replace(new.target):
        return True
    if not _same(new.file, new.target, new.apart):
        raise refusal(new.shown)
    return False


def _same(a: Path, b: Path, apart: re.Pattern[bytes] | None) -> bool:
    if apart is not None:
        return apart.sub(b"", a.read_bytes()) == apart.sub(b"", b.read_bytes())
    if a.stat().st_size != b.stat().st_size:
        return False
    with a.open("rb") as first, b.open("rb") as second:
        while chunk := first.read(_CHUNK):
            if chunk != second.read(_CHUNK):
                return False
    return True


def _real(path: str | Path) -> Path:
    return Path(os.path.realpath(path))


MOST_BYTES = 256 * 2**20
_MOST_FAULTS = 20  # maximum number of errors of a file that one message lists
_LINE = re.compile(r"at line (\d+)")  # position in an error message of tomllib
_WIDE = 120  # columns; a table or an array of tables that fits is written in one line
_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")  # key that needs no quotes

M = TypeVar("M", bound="pydantic.BaseModel")
Key = tuple[str | int, ...]


def read_bytes(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file of at most `most` bytes.

    Raises
    ------
    InputError
        The file cannot be read, is not a regular file, or is too large.
    """
    try:
        found = check_source(path)
        with open(path, "rb") as f:
            content = b"" if found.st_size > most else f.read(most + 1)  # the file may grow, or its size may be 0
        if (size := max(found.st_size, len(content))) > most:
            raise InputError(f"{path}: The file must have at most {most} bytes. Got {size} instead.")
        return content
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or e}") from None


def check_source(path: str | Path) -> os.stat_result:
    """Return the file status of a path; refuse a path whose reading may block or never end, such as a pipe.

    Raises
    ------
    InputError
        There is no such file, or it is a folder, a device, a pipe or a socket.
    """
    try:
        found = Path(path).stat()
    except FileNotFoundError as e:
        raise InputError(f"{path}: {e.strerror}.{meant_file(path)}") from None
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or e}") from None
    if not stat.S_ISREG(found.st_mode):
        got = "folder" if stat.S_ISDIR(found.st_mode) else "device, pipe or socket"
        raise InputError(f"{path}: The file must be a regular file. Got a {got}.")
    return found


@contextmanager
def written(path: str | Path, apart: re.Pattern[bytes] | None = None) -> Iterator[IO[bytes]]:
    """Open a file for an atomic write.

    The content is written to a temporary file in the same folder. At the end of the context, this file is renamed. If
    the path is a link, the target of the link is written. An existing file keeps its permissions; a new file gets the
    permissions of the umask. `place` explains the argument `apart`.

    Raises
    ------
    InputError
        The file cannot be written, or it is read-only, a device, a pipe or a socket. In a command, the error also means
        that the file exists with different content.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = check_target(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        new = target.parent / f".{target.name}.{secrets.token_hex(8)}"
        handle = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        try:
            with os.fdopen(handle, "wb") as f:
                yield f
            if mode is not None:
                os.chmod(new, mode)
            place(new, target, path, apart)
        except BaseException:
            new.unlink(missing_ok=True)
            raise
    except OSError as e:
        raise InputError(f"{path}: cannot be written: {e.strerror or e}") from None


def check_target(path: str | Path, folder: bool = False) -> int | None:
    """Check that a path can be written as a regular file; return the permissions of the existing file, or None.

    With `folder`, the folder that contains the path must exist. Raises InputError with the reason in one line.
    """
    try:
        found = Path(path).stat()
    except (FileNotFoundError, NotADirectoryError):
        above = Path(os.path.realpath(path)).parent
        if folder and not above.is_dir():
            raise InputError(f"{path}: cannot be written: there is no folder {above}") from None
        return None
    except OSError as e:
        raise InputError(f"{path}: cannot be written: {e.strerror or e}") from None
    if stat.S_ISDIR(found.st_mode):
        return None  # the write itself reports the error, or a command writes into the device
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{path}: cannot be written: it is a device, pipe or socket")
    if not found.st_mode & 0o222 or not os.access(path, os.W_OK):  # for root, os.access alone is always true
        raise InputError(f"{path}: cannot be written: it is read-only")
    return stat.S_IMODE(found.st_mode)


def write_bytes(path: str | Path, content: bytes, apart: re.Pattern[bytes] | None = None) -> None:
    """Write a file atomically; `written` explains the argument `apart`."""
    with written(path, apart) as f:
        f.write(content)


def write_text(path: str | Path, content: str) -> None:
    """Write a UTF-8 text file atomically."""
    write_bytes(path, content.encode())


def load_toml(path: str | Path, most: int = MOST_BYTES) -> dict[str, Any]:
    """Return the tables of a TOML file without validation of the keys.

    Raises
    ------
    InputError
        The file cannot be read, is too large, is not TOML, or contains unprintable characters. The message is one line
        that names the file.
    """
    content = read_bytes(path, most)  # outside `try`: an InputError is a ValueError, but not a syntax error
    try:
        table = tomllib.loads(content.decode("utf-8-sig"))  # editors of Windows write a byte order mark before the text
    except ValueError as e:  # wrong syntax or encoding, or an integer with thousands of digits
        text = " ".join(str(e).split())
        line = _LINE.search(text)
        place = f"{path}: line {line[1]}" if line else f"{path}"
        other = "" if Path(path).suffix == ".toml" else " Is it another kind of file? A model ends with .model.toml."
        raise InputError(f"{place}: The file must be valid TOML. Got: {text}.{other}") from None
    except RecursionError:
        raise InputError(f"{path}: The file must be valid TOML. Got arrays or tables nested too deeply.") from None
    _check_printable(table, path)
    return table


def _check_printable(table: dict[str, Any], path: str | Path) -> None:
    """Refuse keys and texts with characters that XML does not permit, that control a terminal, or that hide text."""
    left: list[tuple[str, Any]] = [("", table)]
    while left:
        place, value = left.pop()
        if isinstance(value, str) and unprintable(value):
            raise InputError(
                f"{path}: {place}: The text must hold printable characters, line ends and tabs. "
                f"Got {value[:80]!r} instead."
            )
        if isinstance(value, list):
            left += [(f"{place}.{k}", v) for k, v in enumerate(value) if isinstance(v, str | list | dict)]
        elif isinstance(value, dict):
            for key, v in value.items():
                where = f"{place}.{key}" if place else key
                if printable(key) != key:
                    raise InputError(
                        f"{path}: {where}: The key must hold printable characters. Got {key[:80]!r} instead."
                    )
                left.append((where, v))


def check_format(data: dict[str, Any], present: int, path: str | Path, required: bool = False) -> None:
    """Refuse a file whose format number is not `present`, before its keys are checked.

    If `required` is true, a file without the key `format` is refused, because older versions of HystFMU wrote such
    files. The message of the InputError states the remedy: an upgrade of HystFMU, or a new file.
    """
    found = data.get("format", None if required else present)
    if found is None or (isinstance(found, int) and found != present):
        got, remedy = f"{found} of an older version", "create the file again with this version"
        if found is None:
            got = "none, as in older versions"
        elif found > present:
            got, remedy = f"{found} of a newer version", "pip install --upgrade hystfmu"
        raise InputError(f"{path}: format: The format must be {present}. Got {got} of HystFMU: {remedy}")


def check(data: dict[str, Any], kind: type[M], path: str | Path | Callable[[Key], Path]) -> M:
    """Validate the tables of a file against the pydantic model `kind`; return an object of this model.

    `path` is the file, or a function that returns, for a key, the file that contains this key.

    Raises
    ------
    InputError
        The data are invalid; the message is one line; for every error, it states the file, the key, the rule and the
        value.
    """
    import pydantic

    try:
        return kind.model_validate(data)
    except pydantic.ValidationError as e:
        raise InputError(_faults(_joined(e.errors(include_url=False), data), kind, path)) from None


def _joined(errors: list[Any], data: Any) -> list[Any]:
    """Return the errors of a validation, one for each wrong value.

    pydantic reports an error for each type that a value may have, with the name of the type as an additional part of
    the key. Keys of the file contain no such parts.
    """
    found: dict[Key, list[Any]] = {}
    for error in errors:
        at: Any = data
        place: list[str | int] = []
        for part in error["loc"]:
            if part in at if isinstance(at, dict) else isinstance(at, list) and part in range(len(at)):
                at = at[part]
                place.append(part)
        place += error["loc"][-1:] if error["type"] == "missing" else ()
        found.setdefault(tuple(place), []).append(error)
    typed = {place for place, several in found.items() if several[0]["loc"] != place}
    inner = [place for place in found if not any(len(p) > len(place) and p[: len(place)] == place for p in typed)]
    return [found[p][0] if p not in typed else _of_types(found[p], p) for p in inner]


def _of_types(several: list[Any], place: Key) -> Any:
    """Return one error for a value that has none of several types."""
    types = dict.fromkeys(error["msg"].removeprefix("Input should be ") for error in several)
    rule = " or ".join(types).replace(" or a valid ", " or ")
    return several[0] | {"loc": place, "msg": f"Input should be {rule}"}


def _faults(errors: list[Any], kind: type[M], path: str | Path | Callable[[Key], Path]) -> str:
    """Return all errors of a validation as one line with file, key, rule and value; unknown keys come first."""
    errors = sorted(errors, key=lambda error: error["type"] != "extra_forbidden")
    lacking = {error["loc"] for error in errors if error["type"] == "missing"}
    parts: list[str] = []
    file = None
    for error in errors[:_MOST_FAULTS]:
        loc = error["loc"]
        stated = path(loc) if callable(path) else path
        parts += [f"{stated}:"] if stated != file else []
        file = stated
        if error["type"] == "extra_forbidden":
            known = {str(key[-1]) for key in lacking if key[:-1] == loc[:-1]}
            known |= set() if loc[1:] else set(kind.model_fields)
            rule = f"There is no such key.{meant(str(loc[-1]), sorted(known))}"
        elif error["type"] == "missing":
            rule = "The key is required."
        else:
            text = re.sub(r"^\w+ should", "The value must", error["msg"]).removeprefix("Value error, ")
            rule = text if " Got " in text else f"{text}. Got {repr(error['input'])[:80]} instead."
        parts.append(f"{'.'.join(map(str, loc)) or 'file'}: {rule}")
    more = len(errors) - _MOST_FAULTS
    return " ".join([*parts, *([f"Further wrong keys: {more}."] if more > 0 else [])])


def write_toml(
    path: str | Path, data: dict[str, Any], heading: str = "", apart: re.Pattern[bytes] | None = None
) -> None:
    """Write a dictionary as a TOML file atomically. Reading the file gives bit-identical floats.

    The text `heading` precedes the tables as a comment; `written` explains the argument `apart`.

    Raises
    ------
    InputError
        The file cannot be written, or it contains a key or a text that `load_toml` refuses.
    """
    _check_printable(data, path)
    lines = [*(f"# {line}" for line in heading.splitlines()), *_toml(data)]
    write_bytes(path, "".join(f"{line}\n" for line in lines).encode(), apart)


def _toml(table: dict[str, Any], place: str = "") -> Iterator[str]:
    """Yield the lines of a table. A value, an array or a short table has one line; a long table has its own section.

    Trap: a value after the header ``[place.key]`` would belong to that section. So values come before all sections, and
    a short table that follows a long table also becomes a section. In this way the tables keep their order.
    """
    parts: list[tuple[str, Any]] = []
    for key, value in table.items():
        line = f"{_key(key)} = {_inline(value)}"
        tables = isinstance(value, list) and value and all(isinstance(v, dict) for v in value)
        if isinstance(value, dict):
            short = bool(place) and not any(isinstance(v, dict) for v in value.values()) and len(line) <= _WIDE
        else:
            short = not tables or max(len(_inline(v)) for v in value) <= _WIDE - 5
        if not short or (parts and (tables or isinstance(value, dict))):
            parts.append((f"{place}{_key(key)}", value))
        elif len(line) > _WIDE and isinstance(value, list) and any(isinstance(v, list | dict) for v in value):
            yield from (f"{_key(key)} = [", *_packed(value), "]")
        else:
            yield line
    for name, value in parts:
        for part in [value] if isinstance(value, dict) else value:
            lines = [*_toml(part, f"{name}.")]
            if not isinstance(value, dict) or not lines or lines[0]:  # a table of tables only needs no header
                yield from ("", f"[{name}]" if isinstance(value, dict) else f"[[{name}]]")
            yield from lines


def _packed(items: list[Any]) -> Iterator[str]:
    """Yield the lines of an array; each line contains as many items as fit."""
    line = ""
    for text in (f"{_inline(v)}," for v in items):
        if line and len(line) + 1 + len(text) > _WIDE:
            yield line
            line = ""
        line = f"{line} {text}" if line else f"    {text}"
    yield line


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        items = ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in value.items())
        return f"{{ {items} }}" if items else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_inline, value))}]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").removesuffix("\n")


def _key(key: str) -> str:
    return key if _BARE.match(key) else _inline(key)
