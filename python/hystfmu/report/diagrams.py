"""Diagrams of studies as inline SVG: bars of fractions, dots of ratios, and parallel coordinates of random devices.

The style sheet of the page defines the colours. A diagram consists of rows, one below the other, so that any number of
names fits on a narrow screen. In a page, a reader can select a range on an axis of parallel coordinates
(`parallel.js`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, escape
from hystfmu.report.axis import path, tick

WIDTH = 480
BAR_ROW, BAR_LEFT, BAR_RIGHT, BAR_BOTTOM = 40, 8, 16, 40


@dataclass(frozen=True)
class Bar:
    """A bar for a fraction in percent, with a text and a confidence interval. A part of the bar may be darker."""

    name: str
    share: float
    text: str
    interval: tuple[float, float] | None = None
    part: float | None = None


@dataclass(frozen=True)
class Bars:
    """A bar diagram of fractions from 0 to 100 %."""

    title: str
    label: str
    bars: Sequence[Bar]

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        bottom = BAR_ROW * len(self.bars) + 6
        across = (WIDTH - BAR_LEFT - BAR_RIGHT) / 100

        def x(share: float) -> str:
            return f"{BAR_LEFT + min(max(share, 0.0), 100.0) * across:.1f}"

        said = "; ".join(f"{b.name}: {b.text}" for b in self.bars)
        name = escape(f"{self.title}. {said}")
        out = [f'<svg viewBox="0 0 {WIDTH} {bottom + BAR_BOTTOM}" role="img" aria-label="{name}">']
        for v in range(0, 101, 20):
            out.append(f'<path class="grid" d="M{x(v)} 0V{bottom}"/>')
            out.append(f'<text class="tick" x="{x(v)}" y="{bottom + 15}" text-anchor="middle">{v}</text>')
        out.append(f'<path class="frame" d="M{x(0)} 0V{bottom}H{x(100)}"/>')
        for k, b in enumerate(self.bars):
            top = k * BAR_ROW
            width = float(x(b.share)) - BAR_LEFT
            out.append(f'<text class="name" x="{BAR_LEFT + 5}" y="{top + 16}">{escape(b.name)}</text>')
            out.append(f'<text class="name" x="{x(100)}" y="{top + 16}" text-anchor="end">{escape(b.text)}</text>')
            out.append(f'<rect class="bar" x="{BAR_LEFT}" y="{top + 22}" width="{width:.1f}" height="13"/>')
            if b.part is not None:
                part = float(x(b.part)) - BAR_LEFT
                out.append(f'<rect class="bar part" x="{BAR_LEFT}" y="{top + 22}" width="{part:.1f}" height="13"/>')
            if b.interval is not None:
                lo, hi = map(x, b.interval)
                out.append(f'<path class="whisker" d="M{lo} {top + 28.5}H{hi}M{lo} {top + 23}v11M{hi} {top + 23}v11"/>')
        out.append(f'<text class="tick" x="{WIDTH / 2}" y="{bottom + 33}" text-anchor="middle">')
        return "".join([*out, f"{escape(self.label)}</text></svg>"])


RATIO_ROW, RATIO_LEFT, RATIO_RIGHT, RATIO_BOTTOM = 34, 10, 10, 40
LONGEST = 44  # maximum number of characters of a name
FEW_DECADES = 2.5  # number of decades up to which an axis also has ticks at 2 and 5 times a power of ten
MOST_DECADES = 4.0  # maximum number of decades on each side of 1; other values are drawn at the edge


@dataclass(frozen=True)
class Ratio:
    """Ratio of a metric to its bound, greater than 0. A ratio below 1 is better.

    `good` states whether the bound is met. `other` is a second ratio for comparison.
    """

    name: str
    value: float
    text: str
    good: bool
    other: float | None = None


@dataclass(frozen=True)
class Ratios:
    """A dot diagram of ratios. `words` contains the legend of the ratios and the legend of the ratios `other`."""

    title: str
    label: str
    ratios: Sequence[Ratio]
    words: tuple[str, str]

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        lo, hi = self._decades()
        top, right = 26, WIDTH - RATIO_RIGHT
        across = (right - RATIO_LEFT) / (hi - lo)
        bottom = top + RATIO_ROW * len(self.ratios)

        def x(value: float) -> float:
            return RATIO_LEFT + (min(max(math.log10(max(value, 1e-300)), lo), hi) - lo) * across

        said = "; ".join(f"{r.name}: {r.text}" for r in self.ratios)
        name = escape(f"{self.title}. {said}")
        out = [f'<svg viewBox="0 0 {WIDTH} {bottom + RATIO_BOTTOM}" role="img" aria-label="{name}">']
        between = (1, 2, 5) if hi - lo < FEW_DECADES else (1,)
        for v in (m * 10.0**k for k in range(math.floor(lo), math.ceil(hi) + 1) for m in between):
            if lo <= math.log10(v) <= hi:
                out.append(f'<path class="grid" d="M{x(v):.1f} {top}V{bottom}"/>')
                out.append(f'<text class="tick" x="{x(v):.1f}" y="{bottom + 15}" text-anchor="middle">{v:g}</text>')
        out.append(f'<path class="frame" d="M{RATIO_LEFT} {bottom}H{right}M{x(1):.1f} {top}V{bottom}"/>')
        at = RATIO_LEFT
        others = any(r.other is not None for r in self.ratios)
        words = [*(("met", "c0") for _ in range(any(r.good for r in self.ratios)))]
        words += [("missed", "c1")] if not all(r.good for r in self.ratios) else []
        for word, kind in [(f"{self.words[0]}, {w}", k) for w, k in words]:
            out.append(f'<path class="line dots {kind} big" d="M{at + 5} 11z"/>')
            out.append(f'<text class="tick" x="{at + 14}" y="15">{escape(word)}</text>')
            at += 30 + 7 * len(word)
        if others:
            out.append(f'<path class="whisker" d="M{at + 5} 6v10"/>')
            out.append(f'<text class="tick" x="{at + 14}" y="15">{escape(self.words[1])}</text>')
        for k, r in enumerate(self.ratios):
            y = top + RATIO_ROW * k
            short = r.name if len(r.name) <= LONGEST else f"{r.name[: LONGEST // 2]}...{r.name[-LONGEST // 2 :]}"
            out.append(f'<text class="name" x="{RATIO_LEFT}" y="{y + 14}">{escape(short)}</text>')
            out.append(f'<text class="name" x="{right}" y="{y + 14}" text-anchor="end">{escape(r.text)}</text>')
            out.append(f'<path class="grid" d="M{RATIO_LEFT} {y + 25}H{right}"/>')
            if r.other is not None:
                out.append(f'<path class="whisker" d="M{x(r.other):.1f} {y + 20}v10"/>')
            kind = "c0" if r.good else "c1"
            out.append(f'<path class="line dots {kind} big" d="M{x(r.value):.1f} {y + 25}z"/>')
        out.append(f'<text class="tick" x="{WIDTH / 2}" y="{bottom + 33}" text-anchor="middle">')
        return "".join([*out, f"{escape(self.label)}</text></svg>"])

    def _decades(self) -> tuple[float, float]:
        """Return the ends of the axis as decimal logarithms. The axis contains the ratio 1."""
        values = [v for r in self.ratios for v in (r.value, r.other) if v is not None and 0 < v < math.inf]
        logs = [min(max(math.log10(v), -MOST_DECADES), MOST_DECADES) for v in values] or [0.0]
        return min(-0.5, min(logs) - 0.1), max(0.5, max(logs) + 0.1)


LIMIT = " (red mark: the limit)"
DRAW_ROW, DRAW_LEFT, DRAW_RIGHT, DRAW_TOP = 54, 14, 14, 30


@dataclass(frozen=True)
class Coordinate:
    """An axis of parallel coordinates.

    It has a name with a unit of measure, a range, the position (n,) of each random device (0 to 1), and a limit.
    """

    name: str
    lo: float
    hi: float
    at: Array
    limit: float | None = None


@dataclass(frozen=True)
class Parallel:
    """A diagram of random devices in parallel coordinates. Each device is a line across all axes.

    `good` (n,) states whether each device is inside the limits. `words` contains the legend of these devices, and the
    legend of all other devices.
    """

    title: str
    axes: Sequence[Coordinate]
    good: Array
    words: tuple[str, str]

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        wide, height = WIDTH - DRAW_LEFT - DRAW_RIGHT, DRAW_TOP + DRAW_ROW * len(self.axes)
        heights: Array = DRAW_TOP + DRAW_ROW * (np.arange(len(self.axes), dtype=np.float64) + 0.6)
        out = [
            f'<svg viewBox="0 0 {WIDTH} {height}" role="group" aria-label="{escape(self.title)}" class="parallel" '
            f'data-good="{escape(self.words[0])}">'
        ]
        for k in np.argsort(self.good, kind="stable"):  # good devices are drawn last
            x = DRAW_LEFT + wide * np.array([axis.at[k] for axis in self.axes])
            kind = "c0" if self.good[k] else "c1"
            out.append(f'<path class="draw {kind}" transform="scale(.1)" d="{path(x, heights)}"/>')
        at = DRAW_LEFT
        for kind, word in zip(("c0", "c1"), self.words, strict=True):
            out.append(f'<path class="line {kind}" d="M{at} 12h14"/><text class="tick" x="{at + 18}" y="16">')
            out.append(f"{escape(word)}</text>")
            at += 40 + 7 * len(word)
        for axis, y in zip(self.axes, heights.tolist(), strict=True):
            out.append(f'<g class="axis" data-name="{escape(axis.name)}" data-ends="{axis.lo!r} {axis.hi!r}">')
            out.append(f'<path class="frame" d="M{DRAW_LEFT} {y:.1f}h{wide}"/>')
            if axis.limit is not None:
                out.append(f'<path class="limit" d="M{DRAW_LEFT + wide * axis.limit:.1f} {y - 9:.1f}v18"/>')
            for value, end, anchor in ((axis.lo, DRAW_LEFT, "start"), (axis.hi, DRAW_LEFT + wide, "end")):
                out.append(f'<text class="tick" x="{end}" y="{y + 15:.1f}" text-anchor="{anchor}">')
                out.append(f"{tick(float(f'{value:.4g}'))}</text>")
            name = axis.name + (LIMIT if axis.limit is not None else "")
            out.append(f'<text class="name" x="{DRAW_LEFT}" y="{y - 7:.1f}">{escape(name)}</text></g>')
        return "".join([*out, "</svg>"])
