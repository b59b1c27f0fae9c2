"""The tables of python/docs/papers.md, from what `hystfmu reproduce NAME --json` printed; records such an output.

hystfmu reproduce zhao_tan_2008 --json | python tests/papers_table.py
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

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
    """Write the output of the command, a row a line and without nulls."""
    for table in json.loads(printed):
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
    rows = [r for r in table["rows"] if r["group"] == "paper"]
    lines = [f"## {PAPERS[name]}", "", f"`hystfmu reproduce {name} --json`: {table['answer']}", ""]
    lines += [f"| {' | '.join(COLUMNS)} |", "|" + "---|" * len(COLUMNS), *map(_row, rows), ""]
    if table["drawings"]:
        lines += [f"`hystfmu reproduce {name} --report out` draws from our data: {', '.join(table['drawings'])}.", ""]
    omitted = [f"- {place}: {why}" for place, why in table["omitted"].items()]
    return "\n".join([*lines, *omitted, *([""] if omitted else []), *(f"- {n}" for n in table["notes"]), ""])


def _row(row: dict[str, Any]) -> str:
    why = row.get("note", "")
    figures = [_figure(row, name) for name in ("printed", "literal", "ours")]
    seeds = str(row["seeds"]) if row["seeds"] else ""
    return f"| {' | '.join([row['place'], row['quantity'], *figures, seeds, row.get('verdict', ''), why])} |"


def _figure(row: dict[str, Any], name: str) -> str:
    if name not in row:
        return ""
    ends = row.get(f"{name}_range")
    return f"{row[name]:.4g}" + ("" if ends is None else f" ({ends[0]:.3g} to {ends[1]:.3g})")


def _experiments() -> str:
    """Return the table of the experiments as FMUs, from the baselines."""
    lines = ["## Experiments, each box a FMU", "", "| command | case | metrics |", "|---|---|---|"]
    for file in sorted(SCENARIOS.glob("*/baseline.toml")):
        for case, of in tomllib.loads(file.read_text())["case"].items():
            metrics = ", ".join(f"{name} {value:.3g}" for name, value in of["metrics"].items())
            lines.append(f"| `hystfmu run scenarios/papers/{file.parent.name} --json` | {case} | {metrics} |")
    return "\n".join([*lines, ""])


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
    return [f"{word}. {n}" for n in range(int(first), int(last) + 1)]


if __name__ == "__main__":
    record(sys.stdin.read())
