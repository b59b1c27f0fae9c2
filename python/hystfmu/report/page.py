"""HTML pages with tables, plots and explorers. A page is a single file and makes no network requests."""

import base64
import functools
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from hystfmu.base import escape
from hystfmu.report.explorer import Explorer


def policy(styles: Sequence[str], scripts: Sequence[str] = (), core: bool = False) -> str:
    """Return the <meta> element of the Content-Security-Policy, which must precede every style and script.

    The policy permits only the given styles and scripts, and no network requests. Each style or script is the complete
    text between its tags, including line ends. With `core`, the policy also permits WebAssembly.
    """
    allowed = [*map(_hash, scripts), *(["'wasm-unsafe-eval'"] if core else [])]
    rules = ["default-src 'none'", f"style-src {' '.join(map(_hash, styles))}"]
    rules += [f"script-src {' '.join(allowed)}"] if allowed else []
    rules += ["base-uri 'none'", "form-action 'none'"]
    return f'<meta http-equiv="Content-Security-Policy" content="{"; ".join(rules)}">'


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


FLOOR = 0.001  # percent; a smaller error is shown as less than this value


def percent(value: float) -> str:
    """Return the text of an error in percent."""
    return f"< {FLOOR}" if abs(value) < FLOOR else f"{value:.3g}"


def figure_of(value: float, kind: str) -> str:
    """Return the text of the value of a metric of the given kind."""
    return percent(value) if kind.endswith("_percent") else f"{value:.3g}"


NUMBER, ANSWER = ' class="num"', ' class="answer"'
FOLDED = "Tables"
SCRIPTS = ("common.js", "plots.js", "tables.js")
EXPLORER = '<div class="explorer">'
PARTS = {  # script for each kind of content that a page may have
    EXPLORER: ("core.js", "pictures.js", "explorer.js"),
    'class="parallel"': ("parallel.js",),
    " data-log": ("decades.js",),
}
_COMMENT = re.compile(r"(^|\s+)//\s.*|^/\*.*\*/$")
_PRINTED = re.compile(r"(< )?[+-]?(\d+(\.\d*)?(e[+-]?\d+)?|inf|nan|-?)")


@dataclass(frozen=True)
class Table:
    """A table with a heading, rows of texts or numbers, and a caption."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str = ""


class Diagram(Protocol):
    """Interface of objects that a page shows as a figure."""

    @property
    def title(self) -> str:
        """Caption of the figure."""
        ...

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        ...


@dataclass(frozen=True)
class Section:
    """A section of a page with text, tables, diagrams and an explorer.

    A reader can open and close its folded tables. The first section of a page, which states the result, has no title.
    """

    title: str
    text: str = ""
    tables: Sequence[Table] = field(default_factory=tuple)
    plots: Sequence[Diagram] = field(default_factory=tuple)
    explorer: Explorer | None = None
    folded: Sequence[Table] = field(default_factory=tuple)


def page(title: str, body: Sequence[str]) -> str:
    """Return a complete HTML page. `body` contains the parts of the page as HTML."""
    text, style = "\n".join(body), f"\n{_own('page.css')}"
    named = [*SCRIPTS, *(name for mark, names in PARTS.items() if mark in text for name in names)]
    script = "\n(() => {\n" + "\n".join(map(_own, named)) + "})();\n"
    rules = policy([style], [script], core=EXPLORER in text)
    parts = {"TITLE": escape(title), "POLICY": rules, "STYLE": style, "BODY": text, "SCRIPT": script}
    return re.sub("|".join(parts), lambda m: parts[m[0]], _PAGE)


@functools.cache
def _own(name: str) -> str:
    """Return the text of a file in the folder `script`, without comments, indentation and unnecessary line breaks."""
    lines = (Path(__file__).with_name("script") / name).read_text(encoding="utf-8").splitlines()
    kept = (_COMMENT.sub("", line.strip()) for line in lines)
    return "".join(line if line[-1] in ";,{" else f"{line}\n" for line in kept if line)


def _number(v: object) -> str:
    return f"{v:.3g}" if isinstance(v, float) else escape(str(v))


def _to_the_right(cells: Sequence[object]) -> bool:
    """Return whether the cells of a column contain only numbers, texts of numbers, or `-` for a missing value."""
    return all(not isinstance(c, bool) and _PRINTED.fullmatch(str(c)) for c in cells)


def table(t: Table) -> str:
    """Return a table as HTML. Numeric columns are aligned to the right."""
    right = [NUMBER if t.rows and _to_the_right(column) else "" for column in zip(*t.rows, strict=True)]
    right = right or [""] * len(t.head)
    head = "".join(f'<th scope="col"{r}>{escape(h)}</th>' for h, r in zip(t.head, right, strict=True))
    rows = [
        "<tr>" + "".join(f"<td{r}>{_number(c)}</td>" for c, r in zip(row, right, strict=True)) + "</tr>"
        for row in t.rows
    ]
    caption = f"<caption>{escape(t.caption)}</caption>" if t.caption else ""
    return f'<div class="wide"><table>{caption}<tr>{head}</tr>{"".join(rows)}</table></div>'


def section(s: Section) -> str:
    """Return a section as HTML."""
    head = f"<h2>{escape(s.title)}</h2>" if s.title else ""
    text = f"<p{'' if s.title else ANSWER}>{escape(s.text)}</p>" if s.text else ""
    parts = [*map(table, s.tables), figures(s.plots), s.explorer.html() if s.explorer else ""]
    if s.folded:
        parts.append(f"<details><summary>{FOLDED}</summary>{''.join(map(table, s.folded))}</details>")
    return f"<section>{head}{text}{''.join(parts)}</section>"


def hero(p: Diagram) -> str:
    """Return the first figure of a page, in full width, as HTML."""
    return f'<div class="hero">{figure(p)}</div>'


def figure(p: Diagram) -> str:
    """Return a plot with its title as HTML."""
    return f"<figure>{p.svg()}<figcaption>{escape(p.title)} </figcaption></figure>"


def figures(plots: Sequence[Diagram]) -> str:
    """Return plots side by side, each with its title, as HTML."""
    drawn = [figure(p) for p in plots]
    return f'<div class="plots">{"".join(drawn)}</div>' if drawn else ""


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">POLICY
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>TITLE</title>
<style>STYLE</style></head><body><main>
BODY
</main><script>SCRIPT</script></body></html>
"""
