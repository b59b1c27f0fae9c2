"""Parallel coordinates as inline SVG: a row for each axis, and a line across all rows for each draw.

The axes are horizontal, one below the other. Therefore any number of axis names fits on a narrow screen. In a page, a
reader can choose a range on an axis (`parallel.js`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.printable import escape
from hystfmu.report.axis import tick
from hystfmu.report.curve import path

LIMIT = " (red mark: the limit)"
WIDTH, ROW, LEFT, RIGHT, TOP = 480, 54, 14, 14, 30


@dataclass(frozen=True)
class Coordinate:
    """An axis: name with unit of measure, range, position of each draw (0 to 1, shape (n,)), and a limit."""

    name: str
    lo: float
    hi: float
    at: Array
    limit: float | None = None


@dataclass(frozen=True)
class Parallel:
    """A diagram of draws across axes.

    Parameters
    ----------
    title : str
    axes : sequence of Coordinate
    good : array of bool, shape (n,)
        Whether each draw is inside the limits.
    words : (str, str)
        Text of the legend for good draws, and for all other draws.
    """

    title: str
    axes: Sequence[Coordinate]
    good: Array
    words: tuple[str, str]

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        wide, height = WIDTH - LEFT - RIGHT, TOP + ROW * len(self.axes)
        heights: Array = TOP + ROW * (np.arange(len(self.axes), dtype=np.float64) + 0.6)
        out = [
            f'<svg viewBox="0 0 {WIDTH} {height}" role="group" aria-label="{escape(self.title)}" class="parallel" '
            f'data-good="{escape(self.words[0])}">'
        ]
        for k in np.argsort(self.good, kind="stable"):  # the good ones on top
            x = LEFT + wide * np.array([axis.at[k] for axis in self.axes])
            kind = "c0" if self.good[k] else "c1"
            out.append(f'<path class="draw {kind}" transform="scale(.1)" d="{path(x, heights)}"/>')
        at = LEFT
        for kind, word in zip(("c0", "c1"), self.words, strict=True):
            out.append(f'<path class="line {kind}" d="M{at} 12h14"/><text class="tick" x="{at + 18}" y="16">')
            out.append(f"{escape(word)}</text>")
            at += 40 + 7 * len(word)
        for axis, y in zip(self.axes, heights.tolist(), strict=True):
            out.append(f'<g class="axis" data-name="{escape(axis.name)}" data-ends="{axis.lo!r} {axis.hi!r}">')
            out.append(f'<path class="frame" d="M{LEFT} {y:.1f}h{wide}"/>')
            if axis.limit is not None:
                out.append(f'<path class="limit" d="M{LEFT + wide * axis.limit:.1f} {y - 9:.1f}v18"/>')
            for value, end, anchor in ((axis.lo, LEFT, "start"), (axis.hi, LEFT + wide, "end")):
                out.append(f'<text class="tick" x="{end}" y="{y + 15:.1f}" text-anchor="{anchor}">')
                out.append(f"{tick(float(f'{value:.4g}'))}</text>")
            name = axis.name + (LIMIT if axis.limit is not None else "")
            out.append(f'<text class="name" x="{LEFT}" y="{y - 7:.1f}">{escape(name)}</text></g>')
        return "".join([*out, "</svg>"])
