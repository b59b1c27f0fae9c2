"""Export and check of FMUs: `export_fmu` writes an FMU, and `validate` checks an FMU of any origin.

The functions are imported on first use, because the child process of `validate` needs neither of them.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hystfmu.fmu.check.check import validate
    from hystfmu.fmu.write.export import export_fmu

_HOME = {"validate": "check.check", "export_fmu": "write.export"}  # module of each function
__all__ = ["export_fmu", "validate"]


if not TYPE_CHECKING:  # with __getattr__, a type checker would accept misspelt names

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
