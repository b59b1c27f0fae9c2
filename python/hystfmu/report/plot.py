"""A line plot as inline SVG, with round ticks and a legend.  The style sheet of the page sets the colours.

A notebook shows a `Plot`, or a `Figure` of several plots. `save` writes HTML or SVG; with matplotlib it also writes PNG
or PDF. `matplotlib` returns a figure of matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.printable import escape
from hystfmu.report.axis import axis, decades, sparse, tick, width, width_of
from hystfmu.report.by_matplotlib import SUFFIXES, figure, save_figure
from hystfmu.report.curve import dots, path, thin
from hystfmu.report.drawing import drawing, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

WIDTH, HEIGHT = 480, 300
LEFT, RIGHT, TOP, BOTTOM = 58, 10, 26, 42
LABEL, ROW = 28, 16  # room of the label beside the numbers, height of a row of the legend
T = TypeVar("T", float, Array)
COLOURS = 5  # of the style sheet
MOST_POINTS = 250  # per line; longer lines are thinned
LOOP_POINTS = 5000  # of a loop with many reversals


@dataclass(frozen=True)
class Line:
    """A curve, dots, or the shaded area inside a curve. x and y have the same shape (n,)."""

    name: str
    x: Array
    y: Array
    dots: bool = field(default=False, kw_only=True)
    shade: bool = field(default=False, kw_only=True)

    def __repr__(self) -> str:
        return f"Line({self.name!r}, {len(self.x)} points)"


@dataclass(frozen=True)
class Plot:
    """A diagram with one or more lines. Labels include the units of measure.

    `envelope` keeps the extremes of dense signals. At most `points` points of each line are drawn. `height` is the
    height of the drawing for a width of 480 points. `log_x` makes the x axis logarithmic; all x must be above 0.
    """

    title: str
    x_label: str
    y_label: str
    lines: Sequence[Line]
    envelope: bool = False
    points: int = MOST_POINTS
    height: int = HEIGHT
    log_x: bool = False

    def __repr__(self) -> str:
        return f"Plot({self.title!r}, {', '.join(line.name for line in self.lines)})"

    def _repr_html_(self) -> str:
        """Return HTML for a notebook."""
        return Figure([self])._repr_html_()

    def save(self, path: str | Path) -> Path:
        """Write the diagram to `path`, see `Figure.save`."""
        return Figure([self]).save(path)

    def matplotlib(self) -> MatplotlibFigure:
        """Return the diagram as a figure of matplotlib, see `Figure.matplotlib`."""
        return Figure([self]).matplotlib()

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        curves = [
            thin(np.asarray(c.x, dtype=float), np.asarray(c.y, dtype=float), self.points, self.envelope and not c.dots)
            for c in self.lines
        ]
        xs, x_ticks = (decades if self.log_x else axis)(np.concatenate([x for x, _ in curves]))
        curves = [(np.log10(x), y) for x, y in curves] if self.log_x else curves
        names = [tick(float(f"{10**v:.3g}") if self.log_x else v) for v in x_ticks]
        ys, y_ticks = axis(np.concatenate([y for _, y in curves]))
        left, right = max(LEFT, LABEL + width(y_ticks)), WIDTH - RIGHT
        legend, rows = self._legend(left)
        top, height = TOP + ROW * (rows - 1), self.height + ROW * (rows - 1)
        bottom = height - BOTTOM
        across, down = (right - left) / (xs[1] - xs[0]), (bottom - top) / (ys[1] - ys[0])

        def px(v: T) -> T:
            return left + (v - xs[0]) * across

        def py(v: T) -> T:
            return bottom - (v - ys[0]) * down

        ranges = f'data-x="{xs[0]!r} {xs[1]!r}" data-y="{ys[0]!r} {ys[1]!r}" data-label="{escape(self.x_label)}"'
        ranges += " data-log" if self.log_x else ""
        out = [f'<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{escape(self.title)}" {ranges}>']
        out.append('<g class="axes">')
        for v, name in sparse(x_ticks, names, right - left):
            out.append(f'<path class="grid" d="M{px(v):.1f} {top}V{bottom}"/>')
            out.append(f'<text class="tick" x="{px(v):.1f}" y="{bottom + 15}" text-anchor="middle">{name}</text>')
        for v in y_ticks:
            out.append(f'<path class="grid" d="M{left:.1f} {py(v):.1f}H{right}"/>')
            out.append(f'<text class="tick" x="{left - 5:.1f}" y="{py(v) + 4:.1f}" text-anchor="end">{tick(v)}</text>')
        out.append("</g>")
        out.append(f'<rect class="frame" x="{left:.1f}" y="{top}" width="{right - left:.1f}" height="{bottom - top}"/>')
        for k, (line, (x, y)) in enumerate(zip(self.lines, curves, strict=True)):
            d = (dots if line.dots else path)(px(x), py(y))
            named = f'data-name="{escape(line.name)}" transform="scale(.1)"'
            out.append(f'<path class="line {_kind(k, line)}" {named} d="{d}"/>')
        out += legend
        middle = f'x="{(left + right) / 2:.1f}" y="{height - 8}" text-anchor="middle"'
        out.append(f'<text class="tick" {middle}>{escape(self.x_label)}</text>')
        turned = f'x="14" y="{(top + bottom) / 2}" transform="rotate(-90 14 {(top + bottom) / 2})"'
        room = 2 * min((top + bottom) / 2, height - (top + bottom) / 2) - 12
        short = f' textLength="{room:.0f}"' if width_of(self.y_label) > room else ""
        out.append(f'<text class="tick" {turned} text-anchor="middle"{short}>{escape(self.y_label)}</text></svg>')
        return "".join(out)

    def _legend(self, left: float) -> tuple[list[str], int]:
        """Return the legend above the frame, and the number of its rows."""
        out, at, y = [], left, 15
        for k, line in enumerate(self.lines):
            wide = 30 + 8.5 * len(line.name)
            if at > left and at + wide - 12 > WIDTH:
                at, y = left, y + ROW
            d = f"M{at + 7:.1f} {y}z" if line.dots else f"M{at:.1f} {y}h14"
            d = f"M{at:.1f} {y - 5}h14v10h-14z" if line.shade else d
            out.append(f'<path class="line {_kind(k, line)}" d="{d}"/>')
            out.append(f'<text class="tick" x="{at + 18:.1f}" y="{y + 4}">{escape(line.name)}</text>')
            at += wide
        return out, (y - 15) // ROW + 1


@dataclass(frozen=True)
class Figure:
    """Diagrams side by side."""

    plots: Sequence[Plot]

    def __repr__(self) -> str:
        return f"Figure({', '.join(repr(p.title) for p in self.plots)})"

    def _repr_html_(self) -> str:
        """Return HTML for a notebook."""
        return drawing([(p.title, p.svg()) for p in self.plots], WIDTH, HEIGHT)

    def save(self, path: str | Path) -> Path:
        """Write the diagrams to `path`: ``*.html`` or ``*.svg``; with matplotlib also ``*.png`` or ``*.pdf``.

        Raises
        ------
        InputError
            The suffix is another one, the file cannot be written, or matplotlib is needed and not installed.
        """
        if Path(path).suffix in SUFFIXES:
            return save_figure(self.plots, Path(path))
        return save(path, self.plots[0].title if self.plots else "HystFMU", self._repr_html_())

    def matplotlib(self) -> MatplotlibFigure:
        """Return the diagrams, with all rows of their data, as a figure of matplotlib.

        Raises
        ------
        MissingExtra
            matplotlib is not installed (``pip install 'hystfmu[notebook]'``).

        Examples
        --------
        >>> import hystfmu as hy
        >>> figure = hy.synthetic.piezo(60, 1000.0).plot().matplotlib()
        >>> [axes.get_xlabel() for axes in figure.axes]
        ['u (V)']
        """
        return figure(self.plots)


def _kind(k: int, line: Line) -> str:
    return f"c{k % COLOURS}{' dots' if line.dots else ' shade' if line.shade else ''}"
