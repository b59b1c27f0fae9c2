"""Similar names for a misspelt one, for error messages."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from pathlib import Path

_MOST_ENTRIES = 1000  # of a folder, where a name is looked for


def meant(word: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` for the one or two names nearest to `word`; "" where none is near."""
    names = list(known)
    begins = {n[: len(word) + 1]: n for n in reversed(names)} if len(word) > 2 else {}
    near = difflib.get_close_matches(word, names, 2) or [n for n in names if word and n.startswith(word)][:2]
    near = near or [begins[b] for b in difflib.get_close_matches(word, begins, 2, 0.75)]
    return f" Did you mean {' or '.join(repr(n) for n in near)}?" if near else ""


def meant_file(path: str | Path) -> str:
    """Return the same for a missing path, from the entries of its last existing folder."""
    missing = Path(path)
    while not missing.parent.exists():
        missing = missing.parent
    try:
        entries = sorted(os.listdir(missing.parent))[:_MOST_ENTRIES]
    except OSError:  # a file, or a folder that may not be read
        return ""
    return meant(missing.name, entries)
