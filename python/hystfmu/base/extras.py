"""Optional packages: if one is missing, one line names the extra of HystFMU that installs it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hystfmu.base.errors import InputError

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
    """An optional package is not installed; the text names the command that installs it."""


@contextmanager
def extras(what: str, extra: str = "") -> Iterator[None]:
    """Import optional packages inside this context.

    Parameters
    ----------
    what : str
        What needs them, for the message.
    extra : str
        The extra to name if several install the package; default: that of `EXTRAS`.

    Raises
    ------
    MissingExtra
        One of `EXTRAS` is not installed.
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
