"""Kinds of model by key: description, options, memory use, and entries for ``auto``.

The kinds are the files of `methods`, and ``auto``. A module is loaded on first use. Each row of a table of options
defines the check, the error message and the listing of one option. A fit may use at most half of the memory of the
machine; the estimate uses the measured bytes per row of each kind.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError, meant
from hystfmu.graph import Graph
from hystfmu.identify import methods

Options = Mapping[str, Any]
"""Values of the options of a kind by name, checked."""
Built = tuple[Graph, int, dict[str, Any]]
"""A fitted graph, the number of its parameters, and further results such as ``warnings`` and ``bounded``."""
CLOSES, OPENS, LAGS, LATE, ANY = "return-point", "open", "rate", "open, then rate", ""
SHARE = 0.5  # of the memory: the system and other programs have the rest
LEAST = 400.0  # bytes per row of any fit
EXPENSIVE = 3.0  # s: a fit that takes longer, and has no quick options, is tried on a part of the rows first
AUTO = "auto"
METHODS: tuple[str, ...] = (*(module.name for module in pkgutil.iter_modules(methods.__path__)), AUTO)
REMOVED = {  # kinds of older versions: what takes their place
    "prandtl_ishlinskii_asym": "actuator or preisach",
    "prandtl_ishlinskii_rate": "actuator or preisach",
}


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
        """Convert a value to the type of the option; InputError if it is not legal."""
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
    """Return all options of a method: validated values of the given options, and defaults of all other options.

    An unknown option raises an InputError that lists the legal options. A value out of range raises an InputError, too.
    """
    rows = {o.name: o for o in table}
    for name in given:
        if name not in rows:
            legal = ", ".join(f"{o.name} ({o.rule})" for o in table) or "none"
            raise InputError(f"An option of {method} must be one of: {legal}. Got {name!r} instead.")
    return {name: o.check(given[name]) if name in given else o.default for name, o in rows.items()}


@dataclass(frozen=True)
class Candidate:
    """An entry of the table ``CANDIDATES`` of a kind of model.

    Parameters
    ----------
    memory : str
        `CLOSES`: static, minor loops close. `OPENS`: static, minor loops stay open. `LAGS`: rate-dependent. `LATE`:
        linear dynamics after an operator whose loops stay open; an input with one speed can also show them. `ANY`:
        creep or lags may open a loop.
    seconds, per_1000 : float
        Estimated cost of a fit (s): a fixed part, and a part per 1000 rows up to the last training row.
    options : dict
        Options of the kind that differ from its defaults.
    quick : dict
        Options of a short trial fit. A kind must pass this trial before it is fitted in full. Empty: no trial fit. The
        trial may be coarser than the full fit but must have all parts of the full fit.
    local : bool
        Whether each parameter acts only on some states of the memory, so that states outside the record remain
        undetermined. A network states its coverage itself.
    """

    memory: str
    seconds: float
    per_1000: float
    options: Mapping[str, Any] = field(default_factory=dict)
    quick: Mapping[str, Any] = field(default_factory=dict)
    local: bool = False

    def cost(self, rows: int) -> float:
        """Return the estimated cost (s) for this number of rows."""
        return self.seconds + self.per_1000 * rows / 1000

    def tries(self, rows: int) -> bool:
        """Return whether a short trial fit comes before a full one."""
        return bool(self.quick) or self.cost(rows) > EXPENSIVE

    def named(self, key: str) -> str:
        """Return the kind with its options, e.g. ``zhao_tan_mlp memory=last``."""
        return " ".join([key, *(f"{k}={v}" for k, v in self.options.items())])


@dataclass(frozen=True)
class Memory:
    """Measured memory of a fit; a kind whose module has no ``MEMORY`` is assumed to need the least memory.

    `per_row` is the peak memory of a fit with the default options (bytes per row of a long record). The peak grows with
    a power of the named option; without a name it depends on no option.
    """

    per_row: float
    option: str = ""
    power: int = 1

    def grown(self, given: Mapping[str, Any], default: float) -> float:
        """Return the bytes per row of a fit with these options; `default` is the default value of the named option."""
        size = float(given.get(self.option, default))
        return float(self.per_row * (size / default) ** self.power)


def method(key: str) -> ModuleType:
    """Import the module of a kind of model; it states ``TEXT`` and ``OPTIONS``. An unknown key raises an InputError."""
    if key in REMOVED:
        raise InputError(f"The model must be {REMOVED[key]}, which replace {key}. Got {key!r} instead.")
    if key not in METHODS:
        raise InputError(f"The model must be one of {', '.join(METHODS)}. Got {key!r} instead.{meant(key, METHODS)}")
    return importlib.import_module("hystfmu.identify.auto" if key == AUTO else f"{methods.__name__}.{key}")


def candidates() -> dict[str, tuple[str, Candidate]]:
    """Return the kinds that compete in ``auto``: name, e.g. ``zhao_tan_mlp memory=last``, to key and candidate."""
    kinds = ((key, getattr(method(key), "CANDIDATES", ())) for key in METHODS if key != AUTO)
    return {candidate.named(key): (key, candidate) for key, table in kinds for candidate in table}


def takes_records(key: str) -> bool:
    """Return whether the method `key` fits several records, each from a fresh start (``RECORDS`` of its module)."""
    return bool(getattr(method(key), "RECORDS", False))


def takes_covariates(key: str) -> bool:
    """Return whether the method `key` takes further inputs beside u (``COVARIATES`` of its module)."""
    return bool(getattr(method(key), "COVARIATES", False))


def description(key: str) -> str:
    """Return the line that describes the method `key`."""
    line: str = method(key).TEXT
    return line


def options(key: str) -> tuple[Option, ...]:
    """Return the options of the method `key`."""
    table: tuple[Option, ...] = method(key).OPTIONS
    return table


def too_large(rows: int, key: str, given: Options) -> str:
    """Return the reason why a fit to so many rows would take too much memory; empty if it would not.

    ``"auto"`` means the kind that takes least memory. `given` contains options of the kind that differ from their
    defaults.
    """
    have = _memory()
    if have is None:
        return ""
    taken = Memory(LEAST) if key == AUTO else getattr(method(key), "MEMORY", Memory(LEAST))
    default = next((float(o.default or 1.0) for o in options(key) if o.name == taken.option), 1.0)
    need = rows * max(taken.grown(given, default), LEAST)
    if need <= SHARE * have:
        return ""
    return (
        f"A fit must take at most half of the memory, {SHARE * have / 2**30:.3g} GiB. Got {rows} rows, of which a fit "
        f"of {key} takes about {need / 2**30:.3g} GiB: resample the record to a lower rate (--resample HZ), or fit "
        "fewer rows"
    )


def _memory() -> float | None:
    """Return the memory of the machine, or of the container if it has less (bytes); None where it is not known."""
    found = []
    with suppress(AttributeError, ValueError, OSError):  # not on Windows
        found.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    with suppress(OSError, ValueError):  # "max" without a limit
        found.append(float(Path("/sys/fs/cgroup/memory.max").read_text()))
    return min(found, default=None)
