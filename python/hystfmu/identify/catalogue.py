"""Kinds of model: description, options, memory use, candidates for ``auto``, and the ends of their graphs.

Each kind is a row of a table `KINDS` in a module of the folder `methods`, and ``auto`` is one more kind. A module is
imported when it is first used. A fit may use at most half of the memory of the computer. The memory that a fit needs is
estimated from the number of rows and a measured number of bytes per row.
"""

import importlib
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args

import numpy as np

from hystfmu.base import Array, InputError, Progress, meant
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify import methods
from hystfmu.identify.kinds import Kind

Options = Mapping[str, Any]
"""Valid values of the options of a kind, by name."""
Built = tuple[Graph, int, dict[str, Any]]
"""Fitted graph, number of fitted parameters, and further results such as ``warnings`` and ``bounded``."""
Build = Callable[[Dataset, Options, int, Progress], Built | tuple[Graph, int]]
"""Function that fits a model to data with given options and a seed. It also gets a function that reports progress."""
CLOSES, OPENS, LAGS, LATE, ANY = "return-point", "open", "rate", "open, then rate", ""
SHARE = 0.5  # share of the memory that a fit may use; the system and other programs use the rest
LEAST = 400.0  # minimum memory of any fit (bytes per row)
EXPENSIVE = 3.0  # cost (s) above which a kind without quick options is first fitted to a part of the rows
AUTO = "auto"
STRUCTURE = "structure"  # entry of the results of a fit that chooses its components, see `Candidate`
AUTO_TEXT = "selection by minor loops, rate dependence and validation blocks between reversals of the training rows"
METHODS: tuple[str, ...] = get_args(Kind)


@dataclass(frozen=True)
class Option:
    """One option of a kind of model.

    Parameters
    ----------
    name : str
        Name of the option in ``--set name=value``.
    default : bool, int, float, str or None
        Default value, which also defines the type of the option. None means that a number is computed from the data.
    lo, hi : float
        Smallest and largest valid value of an option that is a number.
    choices : tuple of str
        Valid words of a str option.
    text : str
        Description in one line.
    """

    name: str
    default: bool | int | float | str | None
    lo: float = -np.inf
    hi: float = np.inf
    choices: tuple[str, ...] = ()
    text: str = ""

    @property
    def rule(self) -> str:
        """Description of the valid values, for error messages."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if isinstance(self.default, bool):
            return "true or false"
        return f"{'an int' if isinstance(self.default, int) else 'a float'} in [{self.lo:g}, {self.hi:g}]"

    @property
    def shown_default(self) -> str:
        """Text of the default value, for lists of options."""
        if self.default is None:
            return "from the data"
        if isinstance(self.default, float):
            return f"{self.default:g}"
        return str(self.default).lower() if isinstance(self.default, bool) else str(self.default)

    def check(self, value: Any) -> Any:
        """Convert a value to the type of the option; an invalid value raises an InputError."""
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
    """Return the values of all options of a kind: given values after a check, and default values of all other options.

    An unknown option raises an InputError that lists the valid options. An invalid value also raises an InputError.
    """
    rows = {o.name: o for o in table}
    for name in given:
        if name not in rows:
            legal = ", ".join(f"{o.name} ({o.rule})" for o in table) or "none"
            raise InputError(f"An option of {method} must be one of: {legal}. Got {name!r} instead.")
    return {name: o.check(given[name]) if name in given else o.default for name, o in rows.items()}


@dataclass(frozen=True)
class Candidate:
    """A candidate of ``auto``: a kind of model with some of its options.

    Parameters
    ----------
    memory : str
        Memory class. `CLOSES` is a static kind whose minor loops close. `OPENS` is a static kind whose minor loops stay
        open. `LAGS` is a rate-dependent kind. `LATE` is a kind with linear dynamics after an operator whose minor loops
        stay open; an input with one speed is enough to show its dynamics. `ANY` is a kind whose parameters decide
        whether minor loops close, or stay open because of creep or lags.
    seconds, per_1000 : float
        Estimated duration of a fit (s): a fixed part, and a part per 1000 rows up to the last training row.
    options : dict
        Options of the kind that differ from its default options.
    quick : dict
        Options of a short trial fit. A candidate is fitted with its full options only if the error of the trial fit is
        not too large. The trial may be coarser than the full fit, but its model must contain the same components. With
        an empty dict there is no such trial.
    local : bool
        Whether each parameter affects only some states of the memory. The data then cannot determine the parameters for
        states that do not occur in the record. For a network this is False, because its coverage is computed
        separately.
    structured : bool
        Whether the fit chooses its components on validation blocks. Its results then contain the dict `STRUCTURE`: the
        options of the kind with which a fit to other rows has the same components.
    """

    memory: str
    seconds: float
    per_1000: float
    options: Mapping[str, Any] = field(default_factory=dict)
    quick: Mapping[str, Any] = field(default_factory=dict)
    local: bool = False
    structured: bool = False

    def cost(self, rows: int) -> float:
        """Return the estimated duration (s) of a fit to data with this number of rows up to the last training row."""
        return self.seconds + self.per_1000 * rows / 1000

    def tries(self, rows: int) -> bool:
        """Return whether a short trial fit precedes the full fit."""
        return bool(self.quick) or self.cost(rows) > EXPENSIVE

    def named(self, key: str) -> str:
        """Return the name of the candidate: the kind and its options, for example ``zhao_tan_mlp memory=last``."""
        return " ".join([key, *(f"{k}={v}" for k, v in self.options.items())])


@dataclass(frozen=True)
class Memory:
    """Memory that a fit of a kind of model needs, from measurements.

    `per_row` is the peak memory of a fit with the default options, in bytes per row of a long record. The peak is
    proportional to the value of the option `option`, raised to the power `power`. If `option` is empty, the peak
    depends on no option.
    """

    per_row: float
    option: str = ""
    power: int = 1

    def grown(self, given: Mapping[str, Any], default: float) -> float:
        """Return the memory (bytes per row) of a fit with the options `given`; `default` is the default of `option`."""
        size = float(given.get(self.option, default))
        return float(self.per_row * (size / default) ** self.power)


@dataclass(frozen=True)
class Row:
    """A row of the table of kinds.

    Parameters
    ----------
    text : str
        Description in one line.
    build : function
        Function that fits a model (see `Build`).
    options : tuple of Option
        Options of the fit.
    candidates : tuple of Candidate
        Candidates of ``auto``. Without candidates, ``auto`` does not try the kind.
    memory : Memory
        Memory that a fit needs.
    records : bool
        Whether the kind can be fitted to several records, each simulated from the initial state.
    covariates : bool
        Whether models of the kind accept covariates.
    own_memory : bool
        Whether the fit itself estimates the initial memory of the device.
    """

    text: str
    build: Build
    options: tuple[Option, ...]
    candidates: tuple[Candidate, ...] = ()
    memory: Memory = Memory(LEAST)
    records: bool = False
    covariates: bool = False
    own_memory: bool = False


def method(key: str) -> Row:
    """Import the module of a kind of model, except ``auto``, and return the kind.

    An unknown key raises an InputError.
    """
    if key == AUTO or key not in METHODS:
        raise InputError(f"The model must be one of {', '.join(METHODS)}. Got {key!r} instead.{meant(key, METHODS)}")
    found: Row = importlib.import_module(f"{methods.__name__}.{methods.MODULES.get(key, key)}").KINDS[key]
    return found


def candidates() -> dict[str, tuple[str, Candidate]]:
    """Return all candidates: a dict from name (for example ``zhao_tan_mlp memory=last``) to kind and candidate."""
    return {row.named(key): (key, row) for key in METHODS if key != AUTO for row in method(key).candidates}


def description(key: str) -> str:
    """Return the description of the kind `key`, or of ``auto``, in one line."""
    return AUTO_TEXT if key == AUTO else method(key).text


def options(key: str) -> tuple[Option, ...]:
    """Return the options of the kind `key`; ``auto`` has no options."""
    return () if key == AUTO else method(key).options


def too_large(rows: int, key: str, given: Options) -> str:
    """Return the reason why a fit to `rows` rows needs too much memory, or an empty text if it does not.

    For the key ``"auto"``, the kind that needs the least memory is assumed. `given` contains the options that differ
    from their default values.
    """
    have = _memory()
    if have is None:
        return ""
    taken = Memory(LEAST) if key == AUTO else method(key).memory
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
    """Return the smaller of the memory of the computer and the limit of the container (bytes); None if not known."""
    found = []
    with suppress(AttributeError, ValueError, OSError):  # not on Windows
        found.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    with suppress(OSError, ValueError):  # "max" without a limit
        found.append(float(Path("/sys/fs/cgroup/memory.max").read_text()))
    return min(found, default=None)


def device(
    data: Dataset,
    nodes: Sequence[Node],
    wires: Sequence[tuple[str, str]],
    to: Sequence[str] = ("input.u",),
    source: str = "readout.y",
    start: float | None = None,
    beside: Sequence[Input] = (),
    sort: bool = True,
) -> Graph:
    """Return a graph with the input `u` and the output `y`, in the units of measure of the record.

    `nodes` and `wires` are the blocks and their connections. The input u is connected to the endpoints `to`, and its
    start value is `start`, by default the first input of the record. The output y is the endpoint `source`. `beside`
    contains further inputs. If `sort` is False, the blocks are in the order of evaluation.
    """
    first = Input("u", tuple(to), data.unit_u, float(data.u[0]) if start is None else start)
    return Graph(nodes, wires, [first, *beside], [Output("y", source, data.unit_y)], sort=sort)


def scaled_input(seen: Array, span: float = 2.0) -> tuple[Node, float, float]:
    """Return a block that scales the values `seen` to a range of width `span` around 0, and its gain and offset."""
    gain = span / float(np.ptp(seen))
    offset = -gain * float(seen.min() + seen.max()) / 2
    return Node("input", "scaling", {"n": 1}, {"gain": gain, "offset": offset}), gain, offset


def wired(nodes: list[Node]) -> list[tuple[str, str]]:
    """Return the wires that connect nodes in series, from the output y of a node to the input u of the next node."""
    return [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]


def covariate_inputs(data: Dataset, to: Sequence[tuple[str, ...]]) -> list[Input]:
    """Return one graph input for each covariate.

    `to` contains the endpoints of each input. The start value is the mean of the covariate over the training rows.
    """
    return [
        Input(name, ends, unit, float(values[data.train].mean()), "covariate")
        for (name, unit, values), ends in zip(data.covariates, to, strict=True)
    ]
