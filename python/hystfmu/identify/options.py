"""Options of an identification method as a table: one row makes the check, the message and the listing."""

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
        As written in ``--set name=value``.
    default : bool, int, float, str or None
        Its type is the type of the option; None stands for "chosen from the data" and a number may replace it.
    lo, hi : float
        Range of a number, both ends included.
    choices : tuple of str
        Legal words of a str option.
    text : str
        One line for a reader.
    """

    name: str
    default: bool | int | float | str | None
    lo: float = -np.inf
    hi: float = np.inf
    choices: tuple[str, ...] = ()
    text: str = ""

    @property
    def rule(self) -> str:
        """What a legal value is, in words."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if isinstance(self.default, bool):
            return "true or false"
        return f"{'an int' if isinstance(self.default, int) else 'a float'} in [{self.lo:g}, {self.hi:g}]"

    def check(self, value: Any) -> Any:
        """The value in the option's type, or InputError."""
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
        raise InputError(f"the option {self.name!r} must be {self.rule}; got {value!r}")


def resolve(method: str, table: Sequence[Option], given: Mapping[str, Any]) -> dict[str, Any]:
    """All options of a method: the given ones checked, the others at their defaults.

    Raises
    ------
    InputError
        Unknown option (the legal ones are named) or value out of range.
    """
    rows = {o.name: o for o in table}
    for name in given:
        if name not in rows:
            legal = ", ".join(f"{o.name} ({o.rule})" for o in table) or "none"
            raise InputError(f"{method} has no option {name!r}; it has: {legal}")
    return {name: o.check(given[name]) if name in given else o.default for name, o in rows.items()}
