"""A line plot as inline SVG, with round ticks and a legend.  The style sheet of the page sets the colours.

A notebook shows a `Plot`, or a `Figure` of several.  `save` writes HTML or SVG, with matplotlib PNG or PDF too, and
`matplotlib` gives its figure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.report.by_matplotlib import SUFFIXES, figure, save_figure
from hystfmu.report.drawing import drawing, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

WIDTH, HEIGHT = 480, 300
LEFT, RIGHT, TOP, BOTTOM = 58, 10, 26, 42
T = TypeVar("T", float, Array)
LONGEST_TICK = 5  # characters
COLOURS = 5  # of the style sheet
MOST_POINTS = 250  # per line; longer lines are thinned
LOOP_POINTS = 5000  # of a loop with many reversals


@dataclass(frozen=True)
class Line:
    """One curve, or dots: x and y of equal shape (n,)."""

    name: str
    x: Array
    y: Array
    dots: bool = field(default=False, kw_only=True)

    def __repr__(self) -> str:
        return f"Line({self.name!r}, {len(self.x)} points)"


@dataclass(frozen=True)
class Plot:
    """A diagram with one or more lines; labels carry the units.

    `envelope` keeps the extremes of dense signals; `points` are drawn of each line at most; `height` is that of the
    drawing, 480 points wide.
    """

    title: str
    x_label: str
    y_label: str
    lines: Sequence[Line]
    envelope: bool = False
    points: int = MOST_POINTS
    height: int = HEIGHT

    def __repr__(self) -> str:
        return f"Plot({self.title!r}, {', '.join(line.name for line in self.lines)})"

    def _repr_html_(self) -> str:
        """As a notebook shows it."""
        return Figure([self])._repr_html_()

    def save(self, path: str | Path) -> Path:
        """Write the diagram to `path`, as `Figure.save` does."""
        return Figure([self]).save(path)

    def matplotlib(self) -> MatplotlibFigure:
        """The diagram as a figure of matplotlib, as `Figure.matplotlib` gives it."""
        return Figure([self]).matplotlib()

    def svg(self) -> str:
        """The diagram as an <svg> element."""
        lines = [_thin(line, self.envelope, self.points) for line in self.lines]
        xs, x_ticks = _axis(np.concatenate([line.x for line in lines]))
        ys, y_ticks = _axis(np.concatenate([line.y for line in lines]))
        across = (WIDTH - LEFT - RIGHT) / (xs[1] - xs[0])
        down = (self.height - TOP - BOTTOM) / (ys[1] - ys[0])

        def px(v: T) -> T:
            return LEFT + (v - xs[0]) * across

        def py(v: T) -> T:
            return self.height - BOTTOM - (v - ys[0]) * down

        ranges = f'data-x="{xs[0]!r} {xs[1]!r}" data-y="{ys[0]!r} {ys[1]!r}" data-label="{escape(self.x_label)}"'
        out = [f'<svg viewBox="0 0 {WIDTH} {self.height}" role="img" aria-label="{escape(self.title)}" {ranges}>']
        bottom, right = self.height - BOTTOM, WIDTH - RIGHT
        out.append('<g class="axes">')
        for v in x_ticks:
            out.append(f'<path class="grid" d="M{px(v):.1f} {TOP}V{bottom}"/>')
            out.append(f'<text class="tick" x="{px(v):.1f}" y="{bottom + 15}" text-anchor="middle">{tick(v)}</text>')
        for v in y_ticks:
            out.append(f'<path class="grid" d="M{LEFT} {py(v):.1f}H{right}"/>')
            out.append(f'<text class="tick" x="{LEFT - 5}" y="{py(v) + 4:.1f}" text-anchor="end">{tick(v)}</text>')
        out.append("</g>")
        out.append(f'<rect class="frame" x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}"/>')
        for k, line in enumerate(lines):
            name, d = escape(line.name), (dots if line.dots else path)(px(line.x), py(line.y))
            out.append(f'<path class="line {_kind(k, line)}" data-name="{name}" transform="scale(.1)" d="{d}"/>')
        at = LEFT
        for k, line in enumerate(lines):
            out.append(f'<path class="line {_kind(k, line)}" d="{f"M{at + 7} 15z" if line.dots else f"M{at} 15h14"}"/>')
            out.append(f'<text class="tick" x="{at + 18}" y="19">{escape(line.name)}</text>')
            at += 34 + 7 * len(line.name)
        middle = (LEFT + right) / 2
        out.append(
            f'<text class="tick" x="{middle}" y="{self.height - 8}" text-anchor="middle">{escape(self.x_label)}</text>'
        )
        turned = f'x="12" y="{(TOP + bottom) / 2}" transform="rotate(-90 12 {(TOP + bottom) / 2})"'
        out.append(f'<text class="tick" {turned} text-anchor="middle">{escape(self.y_label)}</text></svg>')
        return "".join(out)


@dataclass(frozen=True)
class Figure:
    """Diagrams side by side."""

    plots: Sequence[Plot]

    def __repr__(self) -> str:
        return f"Figure({', '.join(repr(p.title) for p in self.plots)})"

    def _repr_html_(self) -> str:
        """As a notebook shows it."""
        return drawing([(p.title, p.svg()) for p in self.plots], WIDTH, HEIGHT)

    def save(self, path: str | Path) -> Path:
        """Write the diagrams to `path`, as ``*.html`` or ``*.svg``, with matplotlib also as ``*.png`` or ``*.pdf``.

        Raises
        ------
        InputError
            Another suffix, a file that cannot be written, or no matplotlib for one that needs it.
        """
        if Path(path).suffix in SUFFIXES:
            return save_figure(self.plots, Path(path))
        return save(path, self.plots[0].title if self.plots else "HystFMU", self._repr_html_())

    def matplotlib(self) -> MatplotlibFigure:
        """The diagrams as a figure of matplotlib, with all their rows, to add to or to save.

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


def tick(v: float) -> str:
    """Return a number beside an axis: with an exponent if it is long and that is shorter."""
    plain = f"{v:.6g}"
    mantissa, _, power = f"{v:.5e}".partition("e")
    other = f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"
    return other if len(plain.lstrip("-")) > LONGEST_TICK and len(other) < len(plain) else plain


def path(x: Array, y: Array) -> str:
    """Return a curve as SVG path data in relative steps of a tenth of a point, a third of the size of decimals."""
    points = np.column_stack([x, y])
    tenths = np.round(10 * points).astype(int)
    steps = np.diff(tenths, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    return f"M{tenths[0, 0]} {tenths[0, 1]}l" + " ".join(f"{a} {b}" for a, b in steps.tolist() or [[0, 0]])


def dots(x: Array, y: Array) -> str:
    """Return points as SVG path data: closed subpaths without length, which round ends make visible."""
    tenths = np.round(10 * np.column_stack([x, y])).astype(int)
    steps = np.diff(tenths, axis=0, prepend=0).tolist()
    return f"M{steps[0][0]} {steps[0][1]}z" + "".join(f"m{a} {b}z" for a, b in steps[1:])


def _kind(k: int, line: Line) -> str:
    return f"c{k % COLOURS}{' dots' if line.dots else ''}"


def _thin(line: Line, envelope: bool, points: int) -> Line:
    x, y = np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float)
    n = len(x)
    if n <= points:
        return Line(line.name, x, y, dots=line.dots)
    if not envelope:
        picked = np.unique(np.linspace(0, n - 1, points).round().astype(int))
        return Line(line.name, x[picked], y[picked], dots=line.dots)
    extremes = []  # keep the lowest and highest row of every piece, so that ripple and peaks stay visible
    for piece in np.array_split(np.arange(n), points // 2):
        extremes += sorted((piece[y[piece].argmin()], piece[y[piece].argmax()]))
    picked = np.array(extremes)
    return Line(line.name, x[picked], y[picked])


def _axis(values: Array) -> tuple[tuple[float, float], list[float]]:
    """Return the range of an axis and its ticks at 1, 2 or 5 times a power of ten."""
    lo, hi = float(values.min()), float(values.max())
    if hi - lo < 1e-9 * max(abs(lo), abs(hi), 1e-300):
        pad = max(abs(hi), 1e-12) * 0.5
        lo, hi = lo - pad, hi + pad
    rough = (hi - lo) / 5
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    room = 0.04 * (hi - lo)
    first, last = math.ceil((lo - room) / step), math.floor((hi + room) / step)
    return (lo - room, hi + room), [k * step for k in range(first, last + 1)]
