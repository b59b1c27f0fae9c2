"""Ratios of figures to their bounds, shown as dots on a logarithmic axis in inline SVG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hystfmu.base.printable import escape

WIDTH, ROW, LEFT, RIGHT, BOTTOM = 480, 34, 10, 10, 40
LONGEST = 44  # letters of a name
FEW_DECADES = 2.5  # have ticks at 2 and 5, too
MOST_DECADES = 4.0  # on each side of 1; what is farther away stands at the edge


@dataclass(frozen=True)
class Ratio:
    """Ratio of a figure to its bound (> 0). Below 1 is better; `good` states whether the bound is met.

    `other` is a second ratio for comparison.
    """

    name: str
    value: float
    text: str
    good: bool
    other: float | None = None


@dataclass(frozen=True)
class Ratios:
    """A diagram of ratios. `words` contains the text of the legend for the figures and for the other ratios."""

    title: str
    label: str
    ratios: Sequence[Ratio]
    words: tuple[str, str]

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        lo, hi = self._decades()
        top, across = 26, (WIDTH - LEFT - RIGHT) / (hi - lo)
        bottom = top + ROW * len(self.ratios)

        def x(value: float) -> float:
            return LEFT + (min(max(math.log10(max(value, 1e-300)), lo), hi) - lo) * across

        said = "; ".join(f"{r.name}: {r.text}" for r in self.ratios)
        name = escape(f"{self.title}. {said}")
        out = [f'<svg viewBox="0 0 {WIDTH} {bottom + BOTTOM}" role="img" aria-label="{name}">']
        between = (1, 2, 5) if hi - lo < FEW_DECADES else (1,)
        for v in (m * 10.0**k for k in range(math.floor(lo), math.ceil(hi) + 1) for m in between):
            if lo <= math.log10(v) <= hi:
                out.append(f'<path class="grid" d="M{x(v):.1f} {top}V{bottom}"/>')
                out.append(f'<text class="tick" x="{x(v):.1f}" y="{bottom + 15}" text-anchor="middle">{v:g}</text>')
        out.append(f'<path class="frame" d="M{LEFT} {bottom}H{WIDTH - RIGHT}M{x(1):.1f} {top}V{bottom}"/>')
        at = LEFT
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
            y = top + ROW * k
            short = r.name if len(r.name) <= LONGEST else f"{r.name[: LONGEST // 2]}...{r.name[-LONGEST // 2 :]}"
            out.append(f'<text class="name" x="{LEFT}" y="{y + 14}">{escape(short)}</text>')
            out.append(f'<text class="name" x="{WIDTH - RIGHT}" y="{y + 14}" text-anchor="end">{escape(r.text)}</text>')
            out.append(f'<path class="grid" d="M{LEFT} {y + 25}H{WIDTH - RIGHT}"/>')
            if r.other is not None:
                out.append(f'<path class="whisker" d="M{x(r.other):.1f} {y + 20}v10"/>')
            kind = "c0" if r.good else "c1"
            out.append(f'<path class="line dots {kind} big" d="M{x(r.value):.1f} {y + 25}z"/>')
        out.append(f'<text class="tick" x="{WIDTH / 2}" y="{bottom + 33}" text-anchor="middle">')
        return "".join([*out, f"{escape(self.label)}</text></svg>"])

    def _decades(self) -> tuple[float, float]:
        """Return the ends of the axis as powers of ten. The axis contains 1."""
        values = [v for r in self.ratios for v in (r.value, r.other) if v is not None and 0 < v < math.inf]
        logs = [min(max(math.log10(v), -MOST_DECADES), MOST_DECADES) for v in values] or [0.0]
        return min(-0.5, min(logs) - 0.1), max(0.5, max(logs) + 0.1)
