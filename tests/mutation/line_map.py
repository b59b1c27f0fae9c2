"""Maps from lines to tests, kept between runs: only modules of tests that are new or have changed run again."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

Table = dict[str, Any]  # seconds by test; lines: tests by file and line; codes: hash by file; modules: hash by module


def refresh(root: Path, modules: Sequence[str], target: Path, make: Callable[[list[str]], Table]) -> None:
    """Bring the map in `target` up to date: `make` returns that of some modules of tests.

    Those are the modules that have changed, and those with a test that ran a line of a source file that has changed.
    """
    now = {m: _hash(root / m) for m in modules}
    table: Table = {"seconds": {}, "lines": {}, "codes": {}, "modules": {}}
    if target.exists():
        table = json.loads(target.read_text())
    stale = out_of_date(table, now, lambda file: _hash(root / file) if (root / file).exists() else "")
    gone = {m for m in table["modules"] if m not in now}
    if stale or gone:
        merge(table, make(stale) if stale else {"seconds": {}, "lines": {}, "codes": {}}, {*stale, *gone})
        table["modules"] = now
        target.write_text(json.dumps(table))


def out_of_date(table: Table, now: Mapping[str, str], code: Callable[[str], str]) -> list[str]:
    """Return the modules whose tests must run again, for the hashes of today's modules and sources."""
    changed = [f for f, old in table["codes"].items() if code(f) != old]
    ran = {t.partition("::")[0] for f in changed for tests in table["lines"].get(f, {}).values() for t in tests}
    return [m for m, h in now.items() if table["modules"].get(m) != h or m in ran]


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
    table["lines"] = {f: lines for f, lines in table["lines"].items() if any(lines.values())}
    table["codes"] |= part["codes"]


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:8]
