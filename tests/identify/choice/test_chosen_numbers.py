"""The numbers of fits, inverses, designs and loops that long measurements chose must not move unseen.

Grids of fits, drawn devices and random plants chose limits, starts and test signals; a test of seconds does not tell a
good number from a poor one. `chosen_numbers.toml` has them all: a change there states that it was measured again.
"""

import ast
import re
import tomllib
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import numpy as np
import pytest

import hystfmu
from hystfmu.identify.catalogue import Candidate, Option

WRITTEN = tomllib.loads(Path(__file__).with_name("chosen_numbers.toml").read_text())
LONG = 30  # a longer list is written by its ends and length
ROOMS = ("identify", "inverse", "design", "start")


def modules() -> list[str]:
    (package,) = hystfmu.__path__
    found = [m.name for room in ROOMS for m in walk_packages([f"{package}/{room}"], f"hystfmu.{room}.")]
    return [*ROOMS, *(name.removeprefix("hystfmu.") for name in found)]


def plain(value: Any) -> Any:
    """The numbers in a value as lists and tables; None for another value, such as a function."""
    match value:
        case bool() | int() | str():
            return value
        case None:
            return "none"
        case float():
            return float(f"{value:.12g}")  # the last digits of a computed one depend on the platform
        case np.ndarray() | tuple() | list():
            parts = [plain(v) for v in (value.tolist() if isinstance(value, np.ndarray) else value)]
            if len(parts) > LONG:
                parts = [*parts[:2], len(parts), parts[-1]]
            return None if None in parts else parts
        case dict():
            table = {str(k): plain(v) for k, v in value.items()}
            return None if None in table.values() else table
    if is_dataclass(value) and not isinstance(value, Option | Candidate):  # kinds.toml has those
        return plain([getattr(value, f.name) for f in fields(value)])
    return None


def numbers(name: str) -> dict[str, Any]:
    """The constants that a module states itself, except texts."""
    module = import_module(f"hystfmu.{name}")
    stated = [s for s in ast.parse(Path(module.__file__ or "").read_text()).body if isinstance(s, ast.Assign)]
    names = {n.id for s in stated for n in ast.walk(s) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    found = {n: plain(getattr(module, n)) for n in sorted(names) if n.isupper()}
    return {n: v for n, v in found.items() if v is not None and not isinstance(v, str) and re.search(r"\b\d", repr(v))}


@pytest.mark.parametrize("name", modules())
def test_a_number_is_the_one_that_was_chosen(name: str) -> None:
    assert numbers(name) == WRITTEN.get(name, {})
