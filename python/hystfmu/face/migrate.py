"""Migration of model, scenario and baseline files to the present format."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.base.files import check_newest, load_toml, read_bytes, write_text
from hystfmu.base.replacing import own
from hystfmu.base.toml_keys import Rename, renamed, renamed_text
from hystfmu.model.model import FORMAT as MODEL
from hystfmu.scenario.system.older import renamed_in_baseline, renamed_in_scenario
from hystfmu.scenario.system.spec import FORMAT as SCENARIO


def migrate(path: str | Path) -> list[str]:
    """Convert a file to the present format, in place; comments and layout do not change.

    Parameters
    ----------
    path : str or Path
        A ``*.model.toml``, ``scenario.toml`` or ``baseline.toml``.

    Returns
    -------
    list of str
        What changed, a line each; empty if the file has the present format already.

    Raises
    ------
    InputError
        Not a file of these kinds, a file of a newer version, or keys that must be changed by hand.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hystfmu.face.migrate import migrate
    >>> import hystfmu as hy
    >>> hy.Model.of_block(hy.blocks.Creep()).save("old.model.toml")
    >>> text = Path("old.model.toml").read_text()
    >>> characters = Path("old.model.toml").write_text(text.replace("format = 1", "# no format yet"))
    >>> migrate("old.model.toml")
    ['format = 1']
    """
    table = load_toml(path)
    newest, rename = _kind(table, path)
    text = read_bytes(path).decode("utf-8-sig")
    told: list[str] = []

    def noted(key: tuple[str, ...], value: Any) -> tuple[str, Any] | None:
        new = rename(key, value)
        if new is not None:
            told.append(f"{'.'.join(key)} -> {new[0]}" + ("" if new[1] == value else f" = {new[1]!r}"))
        return new

    wanted, changed = renamed(table, noted), renamed_text(text, rename)
    if newest and table.get("format") != newest:
        check_newest(table, newest, path)
        wanted, changed = {**wanted, "format": newest}, _stated(changed, table.get("format"), newest)
        told.insert(0, f"format = {newest}")
    if not told:
        return []
    try:
        same = tomllib.loads(changed) == wanted
    except tomllib.TOMLDecodeError:
        same = False
    if not same:
        raise InputError(f"{path}: The old keys must stand in lines of their own. Change by hand: {', '.join(told)}.")
    own(path)
    write_text(path, changed)
    return told


def _kind(table: dict[str, Any], path: str | Path) -> tuple[int, Rename]:
    """Return the newest format of the kind of a file, 0 if it states none, and its renamed keys."""
    if {"key", "blocks"} <= table.keys():
        return MODEL, lambda key, value: None
    if table.keys() & {"order", "units", "extends", "metrics"}:
        return SCENARIO, renamed_in_scenario
    cases = table.get("case")
    if set(table) == {"case"} and isinstance(cases, dict) and all("metrics" in c for c in cases.values()):
        return 0, renamed_in_baseline
    keys = ", ".join(list(table)[:4]) or "none"
    raise InputError(f"{path}: The file must be a model, a scenario or a baseline. Got the keys {keys}.")


def _stated(text: str, old: object, newest: int) -> str:
    """Return the text with `format` in place of the old one, or before the first key."""
    lines = text.splitlines(keepends=True)
    line = f"format = {newest}\n"
    for k, found in enumerate(lines):
        if found.lstrip().startswith("format") and old is not None:
            return "".join([*lines[:k], line, *lines[k + 1 :]])
        if found.strip() and not found.lstrip().startswith("#") and old is None:
            return "".join([*lines[:k], line, *lines[k:]])
    return line + text
