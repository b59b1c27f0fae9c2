"""Foundations that every other subpackage may import: errors, arrays, untrusted files, child processes.

The names of errors, files, arrays and checked calls are imported from here on first use, so that a child process starts
without numpy.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hystfmu.base.arrays import *  # noqa: F403
    from hystfmu.base.calls import *  # noqa: F403
    from hystfmu.base.errors import *  # noqa: F403
    from hystfmu.base.files import *  # noqa: F403
    from hystfmu.base.printable import *  # noqa: F403

__version__ = "0.2.0"

PACKAGE = Path(__file__).parents[1]
"""Folder of the installed package. The build copies the libraries, the C source, the licence and the scenarios here."""

_PARTS = ("errors", "printable", "files", "arrays", "calls")  # the last two import numpy


if not TYPE_CHECKING:  # with __getattr__, a type checker would accept misspelt names

    def __getattr__(name: str) -> Any:
        if not name.startswith("_"):
            for part in _PARTS:
                if hasattr(found := import_module(f"{__name__}.{part}"), name):
                    return getattr(found, name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
