"""Options of an identification method as a table; a row gives the check, the error message and the listing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError


@dataclass(frozen=True)
class Option:
    """One option of a method.

    Parameters
    ----------
    name : str
        Name, as in ``--set name=value``.
    default : bool, int, float, str or None
        Default; its type is the type of the option.  None means that a number is chosen from the data.
    lo, hi : float
        Range of a number, ends included.
    choices : tuple of str
        Legal words of a str option.
    text : str
        Description, one line.
    """

    name: str
    default: bool | int | float | str | None
    lo: float = -np.inf
    hi: float = np.inf
    choices: tuple[str, ...] = ()
    text: str = ""

    @property
    def rule(self) -> str:
        """Valid values in words."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if isinstance(self.default, bool):
            return "true or false"
        return f"{'an int' if isinstance(self.default, int) else 'a float'} in [{self.lo:g}, {self.hi:g}]"

    @property
    def shown_default(self) -> str:
        """The default in words."""
        if self.default is None:
            return "from the data"
        if isinstance(self.default, float):
            return f"{self.default:g}"
        return str(self.default).lower() if isinstance(self.default, bool) else str(self.default)

    def check(self, value: Any) -> Any:
        """Convert a value to the type of the option.

        Raises
        ------
        InputError
            The value is not legal.
        """
        if self.choices:
            if value in self.choices:
                return value
        elif isinstance(self.default, bool):
            if isinstance(value, bool):
                return value
        elif not isinstance(value, bool) and isinstance(value, (int, float, np.integer, np.floating)):
            whole = isinstance(self.default, int)
            if np.isfinite(value) and self.lo <= value <= self.hi and not (whole and value != int(value)):
                return int(value) if whole else float(value)
        raise InputError(f"The option {self.name!r} must be {self.rule}. Got {value!r} instead.")


def resolve(method: str, table: Sequence[Option], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return all options of a method: validated values for those given, defaults for the others.

    Raises
    ------
    InputError
        Unknown option (the message lists the legal ones), or value out of range.
    """
    rows = {o.name: o for o in table}
    for name in given:
        if name not in rows:
            legal = ", ".join(f"{o.name} ({o.rule})" for o in table) or "none"
            raise InputError(f"An option of {method} must be one of: {legal}. Got {name!r} instead.")
    return {name: o.check(given[name]) if name in given else o.default for name, o in rows.items()}
