"""Optional packages: one line says which extra of HystFMU brings a package that is missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hystfmu.base.errors import InputError

EXTRAS = {
    "control": "control",
    "dask": "study",
    "distributed": "study",
    "h5py": "hdf5",
    "matplotlib": "notebook",
    "optuna": "study",
    "pyarrow": "study",
    "torch": "train",
}


class MissingExtra(InputError):
    """A package that an extra brings is not installed; the text names the command that installs it."""


@contextmanager
def extras(what: str) -> Iterator[None]:
    """Import optional packages inside this context.

    Parameters
    ----------
    what : str
        What needs them, for the message.

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
            f"{what} needs {name}, which is not installed: pip install 'hystfmu[{EXTRAS[name]}]'"
        ) from None
