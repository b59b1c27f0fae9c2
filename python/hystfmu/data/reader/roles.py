"""Roles of columns (time, input, output), stated by the user or recognised by names and units of measure."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from hystfmu.base import InputError
from hystfmu.data.columns import identifier
from hystfmu.data.reader.table import DRIVES, KNOWN, LENGTHS, TIME, Column, Kind, Table

NAMES = {  # lower-case names for each role, the most typical name first
    "time": (
        ("t",),
        ("time", "zeit", "temps", "tiempo", "tempo", "x_value", "timestamp", "time stamp", "elapsed time"),
        ("datetime", "zeitstempel", "uhrzeit", "clock", "epoch", "unixtime", "unix time"),
        ("index",),
    ),
    "input": (
        ("u",),
        ("input", "drive", "command", "excitation", "u_in", "v_in", "vin", "vi", "eingang", "stellspannung"),
    ),
    "output": (("y",), ("output", "response", "y_out", "ausgang", "sensor", "measured")),
}
UNITS = {"time": tuple(TIME), "input": DRIVES, "output": LENGTHS}
QUANTITIES = {  # units of an actuator; for a sensor, input and output are exchanged, see `chosen`
    "time": (),
    "input": ("voltage", "spannung", "current", "strom", "tension", "field"),
    "output": (
        "displacement",
        "disp",
        "position",
        "deflection",
        "weg",
        "auslenkung",
        "hub",
        "stroke",
        "verschiebung",
        "déplacement",
    ),
}

_MATRIX = re.compile(r"|.*\(:,\d+\)")  # columns of an array without names
_NUMBERED = re.compile(
    rf"{_MATRIX.pattern}|(?:ch|chan|channel|kanal|ai|c)?[ _]?\d+|(?:ch|channel|kanal) ?[a-h]", re.IGNORECASE
)  # names that do not indicate a role


@dataclass(frozen=True)
class Roles:
    """Indices of the columns with each role, counted from 0. None means that there is no column with this role.

    `by_order` states whether input and output were distinguished only by the order of the columns.
    """

    time: int | None
    input: int
    output: int | None
    record: int | None
    covariates: tuple[int, ...] = ()
    by_order: bool = False

    @property
    def order(self) -> list[int]:
        """Indices of the columns of input, output and covariates, if they exist."""
        return [k for k in (self.input, self.output, *self.covariates) if k is not None]


def chosen(
    table: Table,
    time: str | int,
    input: str | int,
    output: str | int | None,
    record: str | int | None,
    rate: float | None,
    covariates: Sequence[str | int] = (),
) -> Roles:
    """Find the columns of time, input, output, record number and covariates in a table.

    A column is given by its heading, with or without the unit of measure, or by its number, counted from 1. If the
    column of time, input or output is not given, it is recognised by its name, or otherwise by its unit of measure. If
    `output` or `record` is None, there is no such column. If a sampling `rate` (Hz) is given, no time column is needed.

    Raises
    ------
    InputError
        A column does not exist, several columns are possible for one role, or one column is given for two roles.
    """
    given = {"time": time, "input": input, "output": output, "record": record}
    found = {role: _named(table, key, role) for role, key in given.items() if key not in ("", None)}
    for role, k in found.items():
        if (first := next(r for r in found if found[r] == k)) != role:
            raise InputError(f"{table.where}The {role} must be a column of its own. Got {table.title(k)}, the {first}.")
    beside = tuple(_named(table, key, "covariate") for key in covariates)
    taken: set[int | None] = {*found.values()}
    marked = found.get("record")
    for k in beside:
        if k in taken:
            raise InputError(
                f"{table.where}A covariate must be a column of its own. Got {table.title(k)}, which has another role."
            )
        taken.add(k)
    if rate is not None and found.pop("time", None) is None:
        taken.add(_recognised(table, "time", taken))  # the time column is not the input
    if rate is None and time == "":
        place = _recognised(table, "time", taken)
        left = _free(table, taken)
        if place is None and len(left) == 3 and all(_MATRIX.fullmatch(table.columns[k].name) for k in left):
            place = left[0]
        if place is None and not table.step:
            raise InputError(
                f"{table.where}The columns must include a time. Got {_listed(table)} instead. State its name or number "
                "with --time, or the sample rate in Hz with --rate."
            )
        if place is not None:
            found["time"] = place
            taken.add(place)
    if input == output == "" and (pair := _pair(table, taken)):
        return Roles(found.get("time"), *pair, marked, beside, True)
    for role in ("input", "output"):
        if given[role] != "":
            continue
        place = _recognised(table, role, taken)
        if place is not None:
            found[role] = place
            taken.add(place)
    missing = [role for role in ("input", "output") if given[role] == "" and role not in found]
    left, known = _free(table, taken), {"input", "output"} & found.keys()
    if known and len(missing) == len(left) == 1:  # only one column remains for the role that is still missing
        found[missing[0]] = left[0]
        taken.add(left[0])
    unknown = [k for k in _free(table, taken) if table.columns[k].label]
    if "input" not in found or (output == "" and "output" not in found and unknown):
        role = "output" if "input" in found else "input"
        raise InputError(
            f"{table.where}The {role} must be one of the columns. Got {_listed(table)}, of which none is known as "
            f"{role}: name or number it, e.g. --{role} 2."
        )
    if output == "" and "output" not in found:  # its numbers may be in a form that the reader does not know
        unread = _recognised(table, "output", taken, "text")
        found |= {} if unread is None else {"output": unread}
    by_unit = input == "" and output == "" and "output" in found
    named = any(_last(table.columns[found["input"]]) in names for names in NAMES["input"])
    if by_unit and found["output"] < found["input"] and not named:
        raise InputError(
            f"{table.where}The input must be clear. Got {_listed(table)}, which may be an actuator driven by "
            f"{table.title(found['input'])} or a sensor of {table.title(found['output'])}: name the columns with "
            "--input and --output."
        )
    return Roles(found.get("time"), found["input"], found.get("output"), marked, beside)


def _pair(table: Table, taken: Collection[int | None]) -> tuple[int, int] | None:
    """Return the two remaining columns if their names and units do not distinguish input and output; otherwise None."""
    left = _free(table, taken)
    if len(left) != 2 or not all(_NUMBERED.fullmatch(table.columns[k].name) for k in left):
        return None
    first, second = (table.columns[k].unit for k in left)
    return (left[0], left[1]) if first == second or not (first and second) else None


def _named(table: Table, key: str | int | None, role: str) -> int:
    """Return the index of the column with the heading or the number `key`."""
    text = re.sub(r"\s+", " ", str(key)).strip().replace("\u03bc", "\u00b5")
    columns = list(enumerate(table.columns))
    for part in ("label", "name"):
        same = [k for k, c in columns if getattr(c, part).replace("\u03bc", "\u00b5") == text]
        if len(same) > 1:
            numbers = " and ".join(str(k + 1) for k in same[:2])
            raise InputError(
                f"{table.where}The column {text!r} must occur once. Got two in {_listed(table)}: number it, {numbers}."
            )
        if same:
            return same[0]
    written = [k for k, c in columns if text == identifier(c.name, f"column_{k + 1}")]
    if role == "covariate" and len(written) == 1:  # `key` may be the name that a model gives to the covariate
        return written[0]
    if re.fullmatch(r"\d{1,6}", text):
        if not 1 <= int(text) <= len(columns):
            raise InputError(
                f"{table.where}The number of the {role} column must be from 1 to {len(columns)}. Got {text} instead."
            )
        return int(text) - 1
    hint = " Name the columns with --time, --input, --output, or number them from 1."
    hint = hint.replace("--output,", "--output, --covariate,") if role == "covariate" else hint
    hint += " Without a time column give the sample rate in Hz (--rate)." if role == "time" else ""
    raise InputError(f"{table.where}The columns must include {text!r}. Got {_listed(table)} instead.{hint}")


def _recognised(table: Table, role: str, taken: Collection[int | None], kind: Kind = "number") -> int | None:
    """Return the column of a role, recognised by its name or else by its unit of measure; None if there is none.

    The cells of the column are of the `kind`, those of a time also text or times of day.
    """
    fitting = ("number", "text", "clock") if role == "time" else (kind,)
    free = [(k, c) for k, c in enumerate(table.columns) if k not in taken and c.kind in fitting]
    if role == "time":
        free = [(k, c) for k, c in free if c.unit in TIME or c.unit not in KNOWN]  # not a temperature "T [degC]"
    tests = [[k for k, c in free if _last(c) in names] for names in NAMES[role]]
    tests.append([k for k, c in free if c.unit in UNITS[role]])
    tests.append([k for k, c in free if _last(c) in QUANTITIES[role] and not c.unit])
    tests.append([k for k, c in free if role == "time" and c.kind == "clock"])
    for hits in tests:
        if len(hits) == 1:
            return hits[0]
        if hits:
            labels = " and ".join(repr(table.columns[k].label) for k in hits[:3])
            raise InputError(
                f"{table.where}The {role} must be one of the columns. Got {labels}, which both match: select one with "
                f"--{role} {table.columns[hits[0]].label!r} or --{role} {hits[0] + 1}."
            )
    return None


def _last(column: Column) -> str:
    *above, last = column.name.lower().split("/")
    return above[-1] if above and last in ("data", "value", "values") else last


def _free(table: Table, taken: Collection[int | None]) -> list[int]:
    return [k for k, c in enumerate(table.columns) if c.kind == "number" and k not in taken]


def _listed(table: Table) -> str:
    if not any(c.label for c in table.columns):
        return f"{len(table.columns)} columns without names"
    return ", ".join(c.label for c in table.columns)[:200]
