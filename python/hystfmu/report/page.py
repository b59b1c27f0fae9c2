"""A self-contained HTML page of tables and plots in one style, without scripts or external requests."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

from hystfmu.report.plot import Plot

NUMBER = ' class="num"'
_PRINTED = re.compile(r"[+-]?(\d+(\.\d*)?(e[+-]?\d+)?|inf|nan|-?)")


@dataclass(frozen=True)
class Table:
    """A table: heading, rows of text or numbers, caption."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """A part of a page with tables and plots."""

    title: str
    text: str = ""
    tables: Sequence[Table] = field(default_factory=tuple)
    plots: Sequence[Plot] = field(default_factory=tuple)


def page(title: str, body: Sequence[str]) -> str:
    """Return a whole page as HTML; `body` holds its parts, which are HTML already."""
    return _PAGE.replace("TITLE", escape(title)).replace("BODY", "\n".join(body))


def _number(v: object) -> str:
    return f"{v:.4g}" if isinstance(v, float) else escape(str(v))


def _to_the_right(cells: Sequence[object]) -> bool:
    """Tell whether a column holds numbers or printed numbers only; `-` stands for no value."""
    return all(not isinstance(c, bool) and _PRINTED.fullmatch(str(c)) for c in cells)


def table(t: Table) -> str:
    """Return a table as HTML, with numeric columns aligned to the right."""
    right = [NUMBER if t.rows and _to_the_right(column) else "" for column in zip(*t.rows, strict=True)]
    right = right or [""] * len(t.head)
    head = "".join(f"<th{r}>{escape(h)}</th>" for h, r in zip(t.head, right, strict=True))
    rows = [
        "<tr>" + "".join(f"<td{r}>{_number(c)}</td>" for c, r in zip(row, right, strict=True)) + "</tr>"
        for row in t.rows
    ]
    caption = f"<caption>{escape(t.caption)}</caption>" if t.caption else ""
    return f'<div class="wide"><table>{caption}<tr>{head}</tr>{"".join(rows)}</table></div>'


def section(s: Section) -> str:
    """Return a section as HTML."""
    text = f"<p>{escape(s.text)}</p>" if s.text else ""
    return f"<section><h2>{escape(s.title)}</h2>{text}{''.join(map(table, s.tables))}{figures(s.plots)}</section>"


def figures(plots: Sequence[Plot]) -> str:
    """Return plots side by side, each with its title, as HTML."""
    drawn = [f"<figure>{p.svg()}<figcaption>{escape(p.title)}</figcaption></figure>" for p in plots]
    return f'<div class="plots">{"".join(drawn)}</div>' if drawn else ""


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>TITLE</title>
<style>
:root { --bg:#fff; --fg:#1b2733; --soft:#5d6b78; --line:#d9e0e6; --c0:#0b63b5; --c1:#d1521b; --c2:#2a8a4a; --c3:#8a3fa0;
  --ok:#1d7a3c; --bad:#b3261e; color-scheme:light dark }
@media (prefers-color-scheme: dark) { :root { --bg:#12181e; --fg:#e4e9ee; --soft:#9aa8b5; --line:#2c3742; --c0:#62aef2;
  --c1:#ff9a66; --c2:#6fd08c; --c3:#cf96e0; --ok:#6fd08c; --bad:#ff8a80 } }
body { margin:0 auto; max-width:1080px; padding:1rem; background:var(--bg); color:var(--fg);
  font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif }
h1 { font-size:1.6rem; margin:.5rem 0 }
h2 { font-size:1.2rem; margin:2rem 0 .5rem; border-bottom:1px solid var(--line) }
.lead { color:var(--soft) } .ok { color:var(--ok) } .bad { color:var(--bad) } a { color:var(--c0) }
.wide { overflow-x:auto } table { border-collapse:collapse; font-size:.88rem; margin:.5rem 0 }
th,td { text-align:left; padding:.2rem .7rem .2rem 0; border-bottom:1px solid var(--line); vertical-align:top }
th { color:var(--soft); font-weight:600 } .num { text-align:right; font-variant-numeric:tabular-nums }
caption { text-align:left; color:var(--soft); padding:.3rem 0 } details { margin:.4rem 0 } summary { cursor:pointer }
.plots { display:grid; grid-template-columns:repeat(auto-fit,minmax(min(100%,320px),1fr)); gap:1rem }
figure { margin:0 } figcaption { color:var(--soft); font-size:.85rem } svg { width:100%; height:auto; display:block }
small { color:var(--soft) }
.grid { stroke:var(--line); fill:none } .frame { stroke:var(--soft); fill:none }
.tick { fill:var(--soft); font-size:11px }
.line { vector-effect:non-scaling-stroke; fill:none; stroke-width:1.4; stroke-linejoin:round }
.c0 { stroke:var(--c0) } .c1 { stroke:var(--c1) } .c2 { stroke:var(--c2) } .c3 { stroke:var(--c3) }
</style></head><body>
BODY
</body></html>
"""
