"""Maps from lines to tests, kept between runs: only modules of tests that are new or have changed run again."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

Table = dict[str, Any]  # seconds by test; lines: tests by file and line; codes: hash by file; modules: hash by module


def refresh(root: Path, modules: Sequence[str], target: Path, make: Callable[[list[str]], Table]) -> None:
    """Bring the map in `target` up to date: `make` returns that of the modules of tests that have changed."""
    now = {m: _hash(root / m) for m in modules}
    table: Table = {"seconds": {}, "lines": {}, "codes": {}, "modules": {}}
    if target.exists():
        table = json.loads(target.read_text())
    gone = {m for m in table["modules"] if m not in now}
    stale = [m for m, h in now.items() if table["modules"].get(m) != h]
    if stale or gone:
        merge(table, make(stale) if stale else {"seconds": {}, "lines": {}, "codes": {}}, {*stale, *gone})
        table["modules"] = now
        target.write_text(json.dumps(table))


def covered(root: Path, modules: list[str], part: Path) -> Table:
    """Return the map of some modules of tests, by coverage.py; a test that fails is left out."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "mutation.cover", "-p", "no:cacheprovider", *modules]
    environment = {**os.environ, "HYSTFMU_COVER": str(part), "PYTHONPATH": str(root / "tests")}
    subprocess.run(command, cwd=root, env=environment, check=False)
    table: Table = json.loads(part.read_text())
    return table


def merge(table: Table, part: Table, modules: set[str]) -> None:
    """Replace what `table` knows of the tests of `modules`."""

    def others(tests: list[str]) -> list[str]:
        return [t for t in tests if t.partition("::")[0] not in modules]

    table["seconds"] = {t: table["seconds"][t] for t in others(list(table["seconds"]))} | part["seconds"]
    for file in {**table["lines"], **part["lines"]}:
        old, new = table["lines"].get(file, {}), part["lines"].get(file, {})
        table["lines"][file] = {k: sorted({*others(old.get(k, [])), *new.get(k, [])}) for k in {**old, **new}}
    # a file that has changed keeps its old hash: its lines are no longer those of the older tests
    table["codes"] = part["codes"] | table["codes"]


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:8]
