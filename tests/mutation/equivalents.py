"""Mutants that no test can kill: listed by hand with a reason, and found again by file and change."""

import tomllib
from pathlib import Path

from mutation import sample

LIST = Path(__file__).with_name("equivalents.toml")
Key = tuple[str, str, str]  # file, line before, line after; both without indentation


def listed() -> dict[Key, str]:
    """Return the reasons by file and change."""
    return {(e["file"], e["old"], e["new"]): e["reason"] for e in tomllib.loads(LIST.read_text())["equivalent"]}


def stale(root: Path) -> list[Key]:
    """Return the entries that no operator makes of today's files: the line has changed since."""
    left = []
    for key in listed():
        path = root / key[0]
        text = path.read_text() if path.exists() else ""
        if not text or all(m.change(text) != key[1:] for m in sample.mutants(key[0], text)):
            left.append(key)
    return left
