"""Exceptions for invalid user input. A message is one line that also states the remedy, e.g. a similar name."""

import difflib
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hystfmu.base.printable import printable


class InputError(ValueError):
    """Invalid user input.

    The message is one line. It states the file with the line or key, the subject, the rule and the value. Example: "The
    'rho' parameter of sliding_mode must be a float in [0, inf). Got -1 instead." A command prints the message and exits
    with status 2.

    Examples
    --------
    >>> import hystfmu as hy
    >>> try:
    ...     hy.blocks.SlidingMode(rho=-1)
    ... except hy.InputError as e:
    ...     print(e)
    The 'rho' parameter of sliding_mode must be a float in [0, inf). Got -1 instead.
    """

    def __str__(self) -> str:
        """Return the message with escaped control characters.

        So names and values from a file cannot control the terminal.
        """
        return printable(" ".join(super().__str__().split()))


EXTRAS = {
    "control": "control",
    "dask": "study",
    "distributed": "study",
    "h5py": "files",
    "matplotlib": "notebook",
    "nptdms": "files",
    "openpyxl": "files",
    "optuna": "study",
    "pandas": "notebook",
    "pyarrow": "study",
    "torch": "train",
}


class MissingExtra(InputError):
    """An optional package is not installed. The message states the command that installs this package."""


@contextmanager
def extras(what: str, extra: str = "") -> Iterator[None]:
    """Raise `MissingExtra` if an import of an optional package fails inside this context.

    Parameters
    ----------
    what : str
        Name of the feature that needs the packages, for the message.
    extra : str
        Name of the pip extra for the message, if several extras install the package. By default, the message names the
        extra in `EXTRAS`.

    Raises
    ------
    MissingExtra
        A package of `EXTRAS` is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as e:
        name = (e.name or "").partition(".")[0]
        if name not in EXTRAS:
            raise
        raise MissingExtra(
            f"{what} needs {name}, which is not installed: pip install 'hystfmu[{extra or EXTRAS[name]}]'"
        ) from None


_MOST_ENTRIES = 1000  # maximum number of folder entries among which a similar name is searched


def meant(word: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` with one or two known names similar to `word`, or "" if no name is similar."""
    names = list(known)
    begins = {n[: len(word) + 1]: n for n in reversed(names)} if len(word) > 2 else {}
    near = difflib.get_close_matches(word, names, 2) or [n for n in names if word and n.startswith(word)][:2]
    near = near or [begins[b] for b in difflib.get_close_matches(word, begins, 2, 0.75)]
    return f" Did you mean {' or '.join(repr(n) for n in near)}?" if near else ""


def meant_file(path: str | Path) -> str:
    """Return ``" Did you mean 'x'?"`` with names similar to a missing path, or "" if none is similar.

    The function compares the first missing part of the path with the names in the last existing folder of the path.
    """
    missing = Path(path)
    while not missing.parent.exists():
        missing = missing.parent
    try:
        entries = sorted(os.listdir(missing.parent))[:_MOST_ENTRIES]
    except OSError:  # it is a file, or a folder without read permission
        return ""
    return meant(missing.name, entries)
