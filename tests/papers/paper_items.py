"""Reads the table of the papers in python/docs/papers.md, and compares its verdicts with those of a computed table."""

import re
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parents[2] / "python" / "docs" / "papers.md"
TITLES = {"Zhao": "zhao_tan_2008", "Shen": "shen_ma_2017", "IPMC": "ipmc_bfbnn", "Yu": "yu_alici_2005_smc"}
RANGE = re.compile(r"(eq|fig)s\. (\d+)-(\d+)")


@dataclass(frozen=True)
class Item:
    """A row of the table; `places` are its equations, tables, figures or sections, one by one."""

    places: tuple[str, ...]
    command: str
    status: int
    verdict: str


def read():
    """Return the items of each paper."""
    found = {}
    for part in DOCS.read_text().split("\n## ")[1:]:
        items = found[TITLES[re.match(r"\w+", part)[0]]] = []
        for line in part.splitlines():
            if not line.startswith("| ") or line.startswith("| item"):
                continue
            place, _, command, status, verdict = (c.strip() for c in line.strip("|").split("|"))
            items.append(Item(_places(place), command.strip("`"), int(status), verdict))
    return found


def _places(text):
    several = RANGE.fullmatch(text)
    if several is None:
        return (text,)
    word, first, last = several.groups()
    return tuple(f"{word}. {n}" for n in range(int(first), int(last) + 1))


def check(report):
    """Compare "met" and "missed" of the table with the verdicts of the printed figures of a computed report."""
    for item in read()[report.name]:
        rows = [r for r in report.rows if r.place in item.places and r.printed_met is not None]
        if rows:
            assert ("missed" in item.verdict) == any(r.printed_met is False for r in rows), item.places
            assert (" met" in f" {item.verdict}") == any(r.printed_met for r in rows), item.places
    for row in report.rows:
        if row.printed is not None and row.where == "paper":
            assert any(row.place in i.places for i in read()[report.name]), row.place
    drawn = {d.place for d in report.drawings}
    said = {p for i in read()[report.name] if i.verdict.startswith("drawn") for p in i.places}
    assert said <= drawn, said - drawn
