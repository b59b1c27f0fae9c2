"""The score of a journal: killed of decided, per room, and the survivors."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

WANTED = 0.90  # the goal
LEAST = (
    0.87  # three standard errors of 500 below the last score, 91.6 %: a run below it has lost tests, not had bad luck
)
ENOUGH = 500
VERDICTS = ("killed", "survived", "equivalent", "listed", "invalid")


def rows(journal: Path) -> list[dict[str, Any]]:
    """Return the rows of a journal; an interrupted last line is left out."""
    lines = journal.read_text().splitlines() if journal.exists() else []
    return [json.loads(line) for line in lines if line.endswith("}")]


def score(some: Iterable[dict[str, Any]]) -> tuple[int, int]:
    """Return the numbers of killed and decided mutants."""
    verdicts = [r["verdict"] for r in some]
    killed = verdicts.count("killed")
    return killed, killed + verdicts.count("survived")


def table(some: list[dict[str, Any]]) -> str:
    """Return one line per room and one for all."""
    lines = [f"{'room':10} {'decided':>7} {'killed':>6} {'score':>7}   same code, listed, invalid"]
    for room in [*dict.fromkeys(r["room"] for r in some), "all"]:
        part = [r for r in some if room in (r["room"], "all")]
        killed, decided = score(part)
        left = ", ".join(str(sum(r["verdict"] == v for r in part)) for v in VERDICTS[2:])
        lines.append(f"{room:10} {decided:7} {killed:6} {100 * killed / max(decided, 1):6.1f}%   {left}")
    return "\n".join([*lines, f"the goal is {100 * WANTED:.0f} % of at least {ENOUGH} decided"])


def survivors(some: list[dict[str, Any]]) -> str:
    """Return file, line and change of every survivor."""
    left = sorted((r for r in some if r["verdict"] == "survived"), key=lambda r: (r["file"], r["line"]))
    return "\n".join(f"{r['file']}:{r['line']}\n  - {r['old']}\n  + {r['new']}" for r in left)
