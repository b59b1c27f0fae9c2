"""The tables of python/docs/papers.md, from what `hystfmu reproduce NAME --json` printed; records such an output.

hystfmu reproduce zhao_tan_2008 --json | python tests/papers_table.py
"""

import json
import re
import sys
import textwrap
import tomllib
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "scenarios"))

import page_table

from papers.table import Report, Row, verdict

ROOT = Path(__file__).parents[1]
RECORDS = ROOT / "python" / "docs" / "papers"
SCENARIOS = ROOT / "scenarios" / "papers"
PAPERS = {
    "zhao_tan_2008": "Zhao & Tan 2008: hysteretic operator, inverse operator, 2-12-1 network",
    "shen_ma_2017": "Shen & Ma 2017: constraint factor, odd polynomial, 2-5-1 network, PI model",
    "ipmc_bfbnn": "IPMC paper: basis-function network with an auxiliary function",
    "yu_alici_2005_smc": "Yu, Alici, Shirinzadeh & Smith 2005: rate-dependent network and sliding mode",
}
COLUMNS = ("place", "statement or figure", "printed", "literal", "ours", "seeds", "verdict", "why, where it is missed")


def recorded(name: str) -> dict[str, Any]:
    """What the command printed for a paper; a row lacks what is null."""
    (table,) = json.loads((RECORDS / f"{name}.json").read_text())
    return dict(table)


def record(printed: str) -> None:
    """Write outputs of the command, one a line, as files with a row a line and without nulls."""
    for (table,) in map(json.loads, printed.splitlines()):
        table["rows"] = [{k: v for k, v in row.items() if v not in (None, "")} for row in table["rows"]]
        parts = [f'"{key}": {_listed(value)}' for key, value in table.items()]
        (RECORDS / f"{table['name']}.json").write_text("[{\n" + ",\n".join(parts) + "\n}]\n")


def _listed(value: Any) -> str:
    if isinstance(value, list):
        return "[\n" + ",\n".join(json.dumps(v) for v in value) + "\n]"
    return json.dumps(value)


def markdown() -> str:
    """Return the whole generated part of the page."""
    return "\n".join([*(_paper(name, recorded(name)) for name in PAPERS), _experiments()])


def _paper(name: str, table: dict[str, Any]) -> str:
    report = Report(name, table["source"], tuple(map(row_of, table["rows"])))
    rows = [r for r in report.rows if r.place]
    answer = textwrap.fill(
        f"`hystfmu reproduce {name} --json` prints this table. {report.answer()}", 118, break_on_hyphens=False
    )
    lines = [f"## {PAPERS[name]}", "", answer, ""]
    lines += [page_table.table(COLUMNS, map(_cells, rows)), ""]
    if table["drawings"]:
        figures = ", ".join(table["drawings"])
        drawn = f"`hystfmu reproduce {name} --report out` draws these figures of the paper from our data: {figures}."
        lines += [textwrap.fill(drawn, 118, break_on_hyphens=False), ""]
    told = [f"{place}: {why}" for place, why in table["omitted"].items()] + table["notes"]
    return "\n".join([*lines, *(textwrap.fill(f"- {n}", 118, subsequent_indent="  ") for n in told), ""])


def row_of(recorded: dict[str, Any]) -> Row:
    """Return the row that was recorded, with its verdicts computed anew."""
    return Row(**{f.name: recorded[f.name] for f in fields(Row) if f.name in recorded})


def _cells(row: Row) -> list[str]:
    figures = [_figure(row.printed, None), _figure(row.literal, row.literal_range), _figure(row.ours, row.ours_range)]
    cells = [row.place, row.quantity, *figures, str(row.seeds or ""), verdict(row), row.note]
    return [c.replace("|", chr(92) + "|") for c in cells]


def _figure(value: float | None, ends: Sequence[float] | None) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" + ("" if ends is None else f" ({ends[0]:.3g} to {ends[1]:.3g})")


def _experiments() -> str:
    """Return the table of the experiments as FMUs, from the baselines."""
    rows = []
    for file in sorted(SCENARIOS.glob("*/baseline.toml")):
        for case, of in tomllib.loads(file.read_text())["case"].items():
            metrics = ", ".join(f"{name} {value:.3g}" for name, value in of["metrics"].items())
            rows.append([f"`hystfmu run scenarios/papers/{file.parent.name} --json`", case, metrics])
    return "\n".join(["## Experiments with FMUs", "", page_table.table(("command", "case", "metrics"), rows), ""])


def places(name: str) -> set[str]:
    """Equations, tables, figures and sections of which the record of a paper has a row, a drawing or a reason."""
    table = recorded(name)
    named = [r["place"] for r in table["rows"] if "place" in r] + [*table["drawings"], *table["omitted"]]
    return {one for place in named for one in _single(place)}


def _single(place: str) -> list[str]:
    several = re.fullmatch(r"(eq|fig|remark)s\.? (\d+)-(\d+)", place)
    if several is None:
        return [place]
    word, first, last = several.groups()
    return [f"{word}{'' if word == 'remark' else '.'} {n}" for n in range(int(first), int(last) + 1)]


if __name__ == "__main__":
    record(sys.stdin.read())
