"""Diagrams drawn by matplotlib, for papers (PDF), for slides (PNG), and for changes by the user."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from hystfmu.base.arrays import Array
from hystfmu.base.errors import extras

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

SUFFIXES = (".png", ".pdf")
ACROSS = 2  # diagrams in a row
INCHES = 5.0, 3.4  # of a diagram
DOTS_PER_INCH = 150


class Curve(Protocol):
    """Drawn data of a line: x and y of equal shape (n,)."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def x(self) -> Array: ...  # noqa: D102
    @property
    def y(self) -> Array: ...  # noqa: D102
    @property
    def dots(self) -> bool: ...  # noqa: D102
    @property
    def shade(self) -> bool: ...  # noqa: D102


class Diagram(Protocol):
    """Drawn data of a plot."""

    @property
    def title(self) -> str: ...  # noqa: D102
    @property
    def x_label(self) -> str: ...  # noqa: D102
    @property
    def y_label(self) -> str: ...  # noqa: D102
    @property
    def log_x(self) -> bool: ...  # noqa: D102
    @property
    def lines(self) -> Sequence[Curve]: ...  # noqa: D102


def figure(plots: Sequence[Diagram]) -> MatplotlibFigure:
    """Draw diagrams from all rows of their data.

    Parameters
    ----------
    plots : sequence of Diagram

    Raises
    ------
    MissingExtra
        matplotlib is not installed.
    """
    with extras("a figure of matplotlib"):
        from matplotlib.figure import Figure  # not pyplot: no window, and nothing that lives on
    across = min(ACROSS, max(len(plots), 1))
    down = -(-len(plots) // across) or 1
    made = Figure((INCHES[0] * across, INCHES[1] * down), layout="constrained")
    for k, p in enumerate(plots):
        axes = made.add_subplot(down, across, k + 1)
        for line in p.lines:
            if line.shade:
                axes.fill(line.x, line.y, color="gray", alpha=0.2, linewidth=0, label=_plain(line.name))
                continue
            axes.plot(line.x, line.y, "." if line.dots else "-", linewidth=1.2, label=_plain(line.name))
        axes.set(title=_plain(p.title), xlabel=_plain(p.x_label), ylabel=_plain(p.y_label))
        axes.set_xscale("log" if p.log_x else "linear")
        axes.grid(alpha=0.3)
        if len(p.lines) > 1:
            axes.legend(fontsize="small")
    return made


def _plain(text: str) -> str:
    """Return text that matplotlib shows unchanged. An unescaped dollar would begin a formula."""
    return text.replace("$", r"\$")


def save_figure(plots: Sequence[Diagram], path: Path) -> Path:
    """Write diagrams to a file whose suffix is one of `SUFFIXES`. After an error no incomplete file remains."""
    import io

    from hystfmu.base.files import write_bytes

    content = io.BytesIO()
    figure(plots).savefig(content, format=path.suffix[1:], dpi=DOTS_PER_INCH)
    write_bytes(path, content.getvalue())
    return path
