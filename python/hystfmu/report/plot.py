"""Line plots as inline SVG, with axes and a legend. The style sheet of the page defines the colours.

A notebook displays a `Plot`, or a `Figure` of several plots. The method `save` writes HTML or SVG and, if matplotlib is
installed, PNG or PDF. The method `matplotlib` returns a figure of matplotlib, which the user can change.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hystfmu.base import Array, InputError, escape, extras, write_bytes, write_text
from hystfmu.report.axis import axis, decades, dots, path, sparse, thin, tick, width, width_of
from hystfmu.report.page import policy

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

WIDTH, HEIGHT = 480, 300
LEFT, RIGHT, TOP, BOTTOM = 58, 10, 26, 42
LABEL, ROW = 28, 16  # width of the label beside the tick labels, height of a row of the legend
T = TypeVar("T", float, Array)
COLOURS = 5  # number of line colours in the style sheet
MOST_POINTS = 250  # maximum number of points of a line; longer lines are thinned
LOOP_POINTS = 5000  # maximum number of points of a hysteresis loop with many reversals
ACROSS, TITLE = 2, 24  # number of diagrams in a row; height of a title
INCHES, DOTS_PER_INCH = (5.0, 3.4), 150  # size and resolution of a diagram of matplotlib
_STYLE = (
    ".hystfmu{background:#fff;font-family:system-ui,sans-serif}.hystfmu .grid{stroke:#d9e0e6;fill:none}"
    ".hystfmu .frame{stroke:#5d6b78;fill:none}.hystfmu .tick{fill:#5d6b78;font-size:11px}"
    ".hystfmu .title{fill:#1b2733;font-size:13px}"
    ".hystfmu .line{vector-effect:non-scaling-stroke;fill:none;stroke-width:1.4;stroke-linejoin:round}"
    ".hystfmu .c0{stroke:#0b63b5}.hystfmu .c1{stroke:#c24a17}.hystfmu .c2{stroke:#2a7f45}.hystfmu .c3{stroke:#8a3fa0}"
    ".hystfmu .c4{stroke:#8a6500}.hystfmu .dots{stroke-width:4;stroke-linecap:round}"
    ".hystfmu .shade{stroke:none;fill:#5d6b78;fill-opacity:.18}"
)


@dataclass(frozen=True)
class Line:
    """A line, a set of dots, or a shaded area inside a curve. x and y have the same shape (n,)."""

    name: str
    x: Array
    y: Array
    dots: bool = field(default=False, kw_only=True)
    shade: bool = field(default=False, kw_only=True)

    def __repr__(self) -> str:
        return f"Line({self.name!r}, {len(self.x)} points)"


@dataclass(frozen=True)
class Plot:
    """A diagram with one or more lines. The labels of the axes include the units of measure.

    At most `points` points of each line are drawn. With `envelope`, the extrema of a dense signal are drawn. `height`
    is the height of the drawing for a width of 480 points. With `log_x`, the x axis is logarithmic, and all x must be
    greater than 0.
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
        """Return the diagram as HTML for a notebook."""
        return Figure([self])._repr_html_()

    def save(self, path: str | Path) -> Path:
        """Write the diagram to the file `path`, like `Figure.save`."""
        return Figure([self]).save(path)

    def matplotlib(self) -> "MatplotlibFigure":
        """Return the diagram as a figure of matplotlib, like `Figure.matplotlib`."""
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
        """Return the SVG elements of the legend above the frame, and the number of its rows."""
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
    """Several diagrams side by side."""

    plots: Sequence[Plot]

    def __repr__(self) -> str:
        return f"Figure({', '.join(repr(p.title) for p in self.plots)})"

    def _repr_html_(self) -> str:
        """Return the diagrams as HTML for a notebook, in one <svg> element with its style."""
        columns = min(ACROSS, max(len(self.plots), 1))
        whole = columns * WIDTH, -(-len(self.plots) // columns) * (HEIGHT + TITLE)
        parts = [
            f'<svg class="hystfmu" xmlns="http://www.w3.org/2000/svg" width="{whole[0]}" height="{whole[1]}" '
            f'viewBox="0 0 {whole[0]} {whole[1]}"><style>{_STYLE}</style>'
        ]
        for k, p in enumerate(self.plots):
            x, y = k % columns * WIDTH, k // columns * (HEIGHT + TITLE)
            parts.append(f'<text class="title" x="{x + 8}" y="{y + 16}">{escape(p.title)}</text>')
            parts.append(
                p.svg().replace("<svg ", f'<svg x="{x}" y="{y + TITLE}" width="{WIDTH}" height="{HEIGHT}" ', 1)
            )
        return "".join([*parts, "</svg>"])

    def save(self, path: str | Path) -> Path:
        """Write the diagrams to the file `path`, whose suffix selects the format HTML, SVG, PNG or PDF.

        The formats PNG and PDF need matplotlib.

        Raises
        ------
        InputError
            The suffix is not one of these, the file cannot be written, or matplotlib is needed but not installed.
        """
        path = Path(path)
        if path.suffix in (".png", ".pdf"):
            content = BytesIO()  # written to memory first, so that an error leaves no incomplete file
            self.matplotlib().savefig(content, format=path.suffix[1:], dpi=DOTS_PER_INCH)
            write_bytes(path, content.getvalue())
        elif path.suffix == ".svg":
            write_text(path, self._repr_html_() + "\n")
        elif path.suffix == ".html":
            title = escape(self.plots[0].title if self.plots else "HystFMU")
            head = f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">{policy([_STYLE])}'
            write_text(path, f"{head}<title>{title}</title></head><body>\n{self._repr_html_()}\n</body></html>\n")
        else:
            raise InputError(
                f"{path}: The file of a plot must end in .html, .svg, .png or .pdf. Got {path.suffix!r} instead."
            )
        return path

    def matplotlib(self) -> "MatplotlibFigure":
        """Return the diagrams with all rows of their data as a figure of matplotlib.

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
        with extras("a figure of matplotlib"):
            from matplotlib.figure import Figure  # not pyplot, which opens windows and stores figures
        across = min(ACROSS, max(len(self.plots), 1))
        down = -(-len(self.plots) // across) or 1
        made = Figure((INCHES[0] * across, INCHES[1] * down), layout="constrained")
        for k, p in enumerate(self.plots):
            axes = made.add_subplot(down, across, k + 1)
            for line in p.lines:
                if line.shade:
                    axes.fill(line.x, line.y, color="gray", alpha=0.2, linewidth=0, label=_plain(line.name))
                else:
                    axes.plot(line.x, line.y, "." if line.dots else "-", linewidth=1.2, label=_plain(line.name))
            axes.set(title=_plain(p.title), xlabel=_plain(p.x_label), ylabel=_plain(p.y_label))
            axes.set_xscale("log" if p.log_x else "linear")
            axes.grid(alpha=0.3)
            if len(p.lines) > 1:
                axes.legend(fontsize="small")
        return made


def _plain(text: str) -> str:
    """Return a text that matplotlib displays unchanged. An unescaped dollar sign would begin a formula."""
    return text.replace("$", r"\$")


def _kind(k: int, line: Line) -> str:
    return f"c{k % COLOURS}{' dots' if line.dots else ' shade' if line.shade else ''}"
