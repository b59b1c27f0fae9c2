"""What a person sees in a terminal: tables, verdicts, a progress bar that stays quiet in a pipe, a loop in text."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from hystfmu.core import Array
    from hystfmu.scenario import Change, Result


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Columns as wide as their content; numbers to the right."""
    cells = [[str(c) for c in row] for row in (head, *rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(head))]
    right = [all(_is_number(row[k]) for row in cells[1:]) for k in range(len(head))]
    lines = [
        "  ".join(c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, widths, right, strict=True)) for row in cells
    ]
    lines.insert(1, "  ".join("-" * w for w in widths))
    return "\n".join(line.rstrip() for line in lines)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal, nothing in a pipe.  Call the yielded function with the fraction that is done, 0..1."""
    if not sys.stderr.isatty():
        yield lambda fraction: None
        return
    with click.progressbar(length=1000, label=label, file=sys.stderr) as bar:
        yield lambda fraction: bar.update(max(0, int(1000 * fraction) - bar.pos))


@contextmanager
def counter(label: str) -> Iterator[Callable[[int, int, float], None]]:
    """A bar with the rate and the time left.  Call the yielded function with done, total and rate (1/s)."""
    if not sys.stderr.isatty():
        yield lambda done, total, rate: None
        return
    with click.progressbar(length=1, label=label, file=sys.stderr, show_pos=True, item_show_func=str) as bar:

        def report(done: int, total: int, rate: float) -> None:
            bar.length = total
            bar.update(max(0, done - bar.pos), f"{rate:.0f} runs/s")

        yield report


def verdicts(results: Sequence[Result]) -> str:
    """One line per case, of several scenarios one each; below notes and failures: scenario, metric, value, limit."""
    groups: dict[str, list[Result]] = {}
    for r in results:
        groups.setdefault(r.scenario, []).append(r)
    if len(groups) > 1:
        rows = [
            [name, f"{sum(r.passed for r in g)} of {len(g)}", f"{sum(r.seconds for r in g):.2f}"]
            for name, g in groups.items()
        ]
        lines = [table(["scenario", "passed", "seconds"], rows)]
    else:
        rows = [[r.scenario, r.case, "ok" if r.passed else "FAILED", f"{r.seconds:.2f}"] for r in results]
        lines = [table(["scenario", "case", "verdict", "seconds"], rows)]
    failures = [line for r in results for line in (*r.notes, *_shortened(r.failures()))]
    passed = sum(r.passed for r in results)
    return "\n".join([*lines, *failures, f"{passed} of {len(results)} cases passed"])


def _shortened(failures: Sequence[str]) -> list[str]:
    """Every limit that is exceeded, but of what changed against the baseline only the first: the rest follows."""
    from hystfmu.scenario.baseline import CHANGED

    changed = [line for line in failures if CHANGED in line]
    lines = [line for line in failures if CHANGED not in line] + changed[:1]
    if len(changed) > 1:
        lines[-1] += f" (and {len(changed) - 1} more changed)"
    return lines


def changes(found: Sequence[Change], none: str = "the baseline does not change") -> str:
    """What changed: old, new, and the change in percent of the old value; `none` if nothing did."""
    if not found:
        return none

    def cell(v: float | str | None) -> str:
        return "-" if v is None else v if isinstance(v, str) else f"{v:.6g}"

    rows = []
    for c in found:
        share = "-" if c.relative is None else f"{100 * c.relative:+.3g}"
        rows.append([c.title, c.what, cell(c.old), cell(c.new), share])
    return table(["scenario/case", "what", "old", "new", "change %"], rows)


def loop(u: Array, y: Array, title: str, width: int = 72, height: int = 20) -> str:
    """A hysteresis loop, y over u, each (n,), as text of `width` by `height` characters."""
    import plotext as plt

    plt.clear_figure()
    plt.theme("clear")
    plt.plot(u.tolist(), y.tolist(), marker="braille")
    plt.title(title)
    plt.plotsize(width, height)
    return str(plt.uncolorize(plt.build()))
