"""`extends` and conditions in a scenario.toml. With `extends`, a file states only the differences from another file.

Tables are merged key by key. Numbers, texts and lists replace the earlier value. Three rules keep the result readable:

- A unit that names its source (model, block, graph, inverse_of, fmu) replaces the unit of that name as a whole.
- Of several files in a list, a later one has priority.
- A case states the differences from the case of the same name in the extended file. If a file lists cases, these run
  in this order; otherwise the cases of the extended file run. A name with ``*`` or ``?`` stands for all matching cases
  of the extended file that the file does not name elsewhere.

Conditions are settings, such as a corner, a signal or a delay, that are stated once for several cases. A case applies
its conditions in the order of its list. Later conditions have priority over earlier conditions, and the keys of the
case have the highest priority. A case without text has the texts of its conditions.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, TypeVar

from hystfmu.base.errors import InputError
from hystfmu.base.files import check, check_format, load_toml
from hystfmu.scenario.system.folders import inside, is_relative
from hystfmu.scenario.system.spec import FORMAT, SOURCES, CaseSpec, ConditionSpec, ScenarioSpec

MOST_BYTES = 2**20  # of each file
MOST_FILES = 8  # of a chain
_FILES = ("model", "inverse_of", "fmu")  # keys of a unit that name a file

Table = dict[str, Any]


def read_scenario(file: Path) -> ScenarioSpec:
    """Read a scenario.toml and the files that it extends, and check the merged result.

    An error names the file with the wrong key, the key, the rule and the value. A chain of files that is too long,
    returns to a file or leaves the folder of the scenarios is an InputError.
    """
    layers = _chain(file)
    try:
        merged, run = layers[-1][1], _length(layers[-1][1])
        for k, (path, own) in reversed(list(enumerate(layers[:-1]))):
            _names_once(merged.get("case"), path)
            if isinstance(own.get("case"), list):
                own = own | {"case": _chosen(merged.get("case"), run, own["case"], path)}
                layers[k], run = (path, own), _length(own)
            merged = _merge(merged, own)
        if isinstance(merged.get("case"), list):
            merged["case"] = merged["case"][:run]  # those that only give what others state come after
    except RecursionError:
        raise InputError(f"{file}: tables are nested too deep") from None
    return with_conditions(check(merged, ScenarioSpec, lambda key: _origin(layers, merged, key)), file)


def _chain(file: Path) -> list[tuple[Path, Table]]:
    """Return the file and the files that it extends, with their tables. Paths are relative to the first file."""
    layers: list[tuple[Path, Table]] = []
    waiting, seen = [file], [file.resolve()]
    while waiting:
        path = waiting.pop(0)
        try:
            table = load_toml(path, MOST_BYTES)
        except InputError as e:
            raise InputError(f"{layers[-1][0]}: extends: {e}" if layers else str(e)) from None
        check_format(table, FORMAT, path)
        below, where = table.pop("extends", []), f"{path}: extends"
        names = below if isinstance(below, list) else [below]
        if not all(isinstance(name, str) for name in names):
            raise InputError(
                f"{where}: must be the path of a scenario file, or a list of them; got {str(below)[:80]!r}"
            )
        layers.append((path, _rebased(table, path.parent, file.parent)))
        targets = [inside(path.parent, name, where, file.parent) for name in names]
        for name, target in zip(names, targets, strict=True):
            if target in seen:
                raise InputError(f"{where}: returns to {name!r}: files must not extend each other")
            seen.append(target)
        if len(seen) > MOST_FILES:
            raise InputError(f"{where}: at most {MOST_FILES} files may extend each other")
        waiting = [*reversed(targets), *waiting]  # of a list the last file wins, with what it extends
    return layers


def _merge(below: Table, own: Mapping[str, Any]) -> Table:
    """Merge `own` into `below` by the rules of this module. `own` has priority."""
    merged = dict(below)
    for key, value in own.items():
        was = below.get(key)
        if key == "case" and isinstance(value, list) and isinstance(was, list):
            merged[key] = _merge_cases(was, value)
        elif isinstance(value, dict) and isinstance(was, dict) and not value.keys() & SOURCES:
            merged[key] = _merge(was, value)
        else:
            merged[key] = value
    return merged


def _merge_cases(below: list[Any], own: list[Any]) -> list[Any]:
    """Return the cases of `own`, each merged with the case of the same name in `below`, then the other cases."""
    base = {c["name"]: c for c in below if _is_named(c)}
    names = [c["name"] for c in own if _is_named(c)]
    merged = [_merge(base.get(c["name"], {}), c) if _is_named(c) else c for c in own]
    return merged + [c for name, c in base.items() if name not in names]


def _chosen(below: Any, run: int, own: list[Any], path: Path) -> list[Any]:
    """Return `own`, where the first `run` cases of `below` replace the patterns that they match."""
    patterns = [c for c in own if _is_named(c) and set(c["name"]) & set("*?")]
    taken = {c["name"] for c in own if _is_named(c)}
    found: list[Any] = []
    for case in own:
        if not any(case is p for p in patterns):
            found.append(case)
            continue
        free = [c["name"] for c in below[:run] if _is_named(c)] if isinstance(below, list) else []
        names = [name for name in free if name not in taken and fnmatchcase(name, case["name"])]
        if not names:
            raise InputError(f"{path}: case {case['name']}: no other case of the file that it extends has such a name")
        taken.update(names)
        found += [case | {"name": name} for name in names]
    return found


def _length(table: Table) -> int:
    return len(table["case"]) if isinstance(table.get("case"), list) else 0


def _is_named(case: Any) -> bool:
    return isinstance(case, dict) and isinstance(case.get("name"), str)


def _names_once(cases: Any, path: Path) -> None:
    names = [c["name"] for c in cases if _is_named(c)] if isinstance(cases, list) else []
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: extends: two cases have the name {name!r}")


def _rebased(table: Table, home: Path, folder: Path) -> Table:
    """Return the table with paths relative to `folder` instead of `home`, the folder of its file."""
    if home == folder:
        return table
    way = os.path.relpath(home.resolve(), folder.resolve())
    cases, conditions = table.get("case"), table.get("conditions")
    owners = [
        *(cases if isinstance(cases, list) else ()),
        *(conditions.values() if isinstance(conditions, dict) else ()),
    ]
    for owner in (table, *owners):
        units = owner.get("units") if isinstance(owner, dict) else None
        for unit in units.values() if isinstance(units, dict) else ():
            for key in _FILES:
                name = unit.get(key) if isinstance(unit, dict) else None
                if isinstance(name, str) and is_relative(name):
                    unit[key] = Path(os.path.normpath(f"{way}/{name}")).as_posix()
    return table


def _origin(layers: Sequence[tuple[Path, Table]], merged: Table, key: Sequence[str | int]) -> Path:
    """Return the file that states a key of the merged table; the first file if no file states the key."""

    def known(table: Any) -> int:
        """Return the number of parts of the key that a file states."""
        for depth, part in enumerate(key):
            if depth == 1 and key[0] == "case" and isinstance(table, list):
                table = {i: own for i, case in enumerate(merged["case"]) for own in table if _are_same(own, case)}
            try:
                table = table[part]
            except (LookupError, TypeError):
                return depth
        return len(key)

    return max(layers, key=lambda layer: known(layer[1]))[0]


def _are_same(own: Any, case: Any) -> bool:
    """Return whether a case of a file is part of this case of the merged table."""
    return own is case or (_is_named(own) and _is_named(case) and own["name"] == case["name"])


Spec = TypeVar("Spec", CaseSpec, ScenarioSpec)
_LAST = ("stop", "after", "order")  # the last one that is stated holds


def with_conditions(spec: ScenarioSpec, file: Path) -> ScenarioSpec:
    """Return the scenario with complete cases and without conditions. An unknown condition is an InputError."""
    cases = [_complete(case, spec, file) if case.conditions else case for case in spec.case]
    return _without_conditions(spec.model_copy(update={"case": cases} if cases else {}))


def _complete(case: CaseSpec, spec: ScenarioSpec, file: Path) -> CaseSpec:
    for name in case.conditions:
        if name not in spec.conditions:
            where = f"{file}: case {case.name}: conditions"
            raise InputError(f"{where}: no condition {name!r}; there are {sorted(spec.conditions)}")
    layers: list[ConditionSpec] = [*(spec.conditions[name] for name in case.conditions), case]
    found: dict[str, Any] = {"text": case.text or ", ".join(c.text for c in layers if c.text)}
    for key in ("set", "units", "connections", "limits"):
        found[key] = {name: value for c in layers for name, value in getattr(c, key).items()}
    for key in _LAST:
        found[key] = next((value for c in reversed(layers) if (value := getattr(c, key)) is not None), None)
    return _without_conditions(
        case.model_copy(update={key: value for key, value in found.items() if value not in (None, "", {})})
    )


def _without_conditions(spec: Spec) -> Spec:
    """Return a copy without conditions, so that a saved file has none."""
    made = spec.model_copy(update={"conditions": type(spec.conditions)()})
    made.model_fields_set.discard("conditions")
    return made
