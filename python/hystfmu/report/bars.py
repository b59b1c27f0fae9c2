"""Shares as bars with intervals, as inline SVG. The style sheet of the page sets the colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hystfmu.base.printable import escape

WIDTH, ROW, LEFT, RIGHT, BOTTOM = 480, 40, 8, 16, 40


@dataclass(frozen=True)
class Bar:
    """A share in percent with its text and its interval. A part of the bar may be darker."""

    name: str
    share: float
    text: str
    interval: tuple[float, float] | None = None
    part: float | None = None


@dataclass(frozen=True)
class Bars:
    """A diagram of shares from 0 to 100 %."""

    title: str
    label: str
    bars: Sequence[Bar]

    def svg(self) -> str:
        """Return the diagram as an <svg> element."""
        bottom = ROW * len(self.bars) + 6
        across = (WIDTH - LEFT - RIGHT) / 100

        def x(share: float) -> str:
            return f"{LEFT + min(max(share, 0.0), 100.0) * across:.1f}"

        said = "; ".join(f"{b.name}: {b.text}" for b in self.bars)
        name = escape(f"{self.title}. {said}")
        out = [f'<svg viewBox="0 0 {WIDTH} {bottom + BOTTOM}" role="img" aria-label="{name}">']
        for v in range(0, 101, 20):
            out.append(f'<path class="grid" d="M{x(v)} 0V{bottom}"/>')
            out.append(f'<text class="tick" x="{x(v)}" y="{bottom + 15}" text-anchor="middle">{v}</text>')
        out.append(f'<path class="frame" d="M{x(0)} 0V{bottom}H{x(100)}"/>')
        for k, b in enumerate(self.bars):
            top = k * ROW
            width = float(x(b.share)) - LEFT
            out.append(f'<text class="name" x="{LEFT + 5}" y="{top + 16}">{escape(b.name)}</text>')
            out.append(f'<text class="name" x="{x(100)}" y="{top + 16}" text-anchor="end">{escape(b.text)}</text>')
            out.append(f'<rect class="bar" x="{LEFT}" y="{top + 22}" width="{width:.1f}" height="13"/>')
            if b.part is not None:
                part = float(x(b.part)) - LEFT
                out.append(f'<rect class="bar part" x="{LEFT}" y="{top + 22}" width="{part:.1f}" height="13"/>')
            if b.interval is not None:
                lo, hi = map(x, b.interval)
                out.append(f'<path class="whisker" d="M{lo} {top + 28.5}H{hi}M{lo} {top + 23}v11M{hi} {top + 23}v11"/>')
        out.append(f'<text class="tick" x="{WIDTH / 2}" y="{bottom + 33}" text-anchor="middle">')
        return "".join([*out, f"{escape(self.label)}</text></svg>"])
