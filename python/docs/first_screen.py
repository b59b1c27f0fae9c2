"""The picture on the first screen: the loop of a device, the device behind the inverse, the memory of the model.

It is computed here; `make generate` writes it, for the README is read where nothing is built.
"""

import re

import numpy as np

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.report.plot import Line, Plot

WIDTH, HEIGHT, SCALE = 480, 300, 0.68  # of a diagram, and of the diagrams in the picture
POINTS = 300  # of a curve
CELLS = 48  # along an axis of the plane
STYLE = """<style>
svg { font-family: system-ui, sans-serif; --back: #fff; --line: #dde3e8; --soft: #4d5a66; --a: #0b63b5; --b: #d1521b }
@media (prefers-color-scheme: dark) {
 svg { --back: #14181c; --line: #2c343c; --soft: #a9b6c2; --a: #5aa9f0; --b: #f08a55 } }
.back { fill: var(--back) } .grid { stroke: var(--line); fill: none } .frame { stroke: var(--soft); fill: none }
.tick { fill: var(--soft); font-size: 18px } .name { fill: var(--soft); font-size: 19px; font-weight: 600 }
.line { stroke: var(--a); stroke-width: 2; fill: none; stroke-linejoin: round; vector-effect: non-scaling-stroke }
.up { fill: var(--a); opacity: .55 } .stairs { stroke: var(--b); stroke-width: 3; fill: none }
</style>"""


def first_screen() -> str:
    """Return the picture as SVG that follows the colours of its reader."""
    data = hy.synthetic.piezo(60, 1000.0)
    inverse = hy.fit(data, "prandtl_ishlinskii").inverse()
    t = np.arange(4000) * 1e-3
    wanted = 1.0 + 15.0 * np.sin(2 * np.pi * t) * np.exp(-0.25 * t)
    slope, offset = np.polyfit(data.y, data.u, 1)
    gain = hy.synthetic.displacement(slope * wanted + offset, 1e-3)
    there = hy.synthetic.displacement(inverse.predict(wanted), 1e-3)
    parts = [
        _loop("before: a gain", wanted, gain),
        _loop("after: the inverse of a model", wanted, there),
        _memory("explorer: what the memory keeps", np.sin(4 * np.pi * t[:2400]) * np.exp(-0.5 * t[:2400])),
    ]
    width, height = round(WIDTH * SCALE * len(parts)), round(HEIGHT * SCALE)
    placed = "".join(
        f'<svg x="{round(k * WIDTH * SCALE)}" y="0" width="{round(WIDTH * SCALE)}" height="{height}" '
        f'viewBox="-8 0 {WIDTH + 8} {HEIGHT}">{part}</svg>'
        for k, part in enumerate(parts)
    )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    return f'{head}{STYLE}<rect class="back" width="{width}" height="{height}" rx="8"/>{placed}</svg>\n'


def _loop(title: str, x: Array, y: Array) -> str:
    drawn = Plot(title, "wanted (um)", "reached (um)", [Line("", x, y)], points=POINTS).svg()
    inner = drawn[drawn.index(">") + 1 : drawn.rindex("</svg>")]
    inner = re.sub(r'<path class="line c0" d="M[\d.]+ 15h14"/>', "", inner)
    return f"{inner}{_name(title)}"


def _name(title: str) -> str:
    return f'<text class="name" x="58" y="19">{title}</text>'


def _memory(title: str, u: Array) -> str:
    """Draw the relays that are up after an input, over the plane of thresholds, and the staircase between both."""
    low, high = float(u.min()), float(u.max())
    edges = np.linspace(low, high, CELLS + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    rose = np.array([np.flatnonzero(u >= a)[-1] for a in middle])  # the last time the input was at or above a threshold
    fell = np.array([np.flatnonzero(u <= b)[-1] for b in middle])
    left, top, side = 118, 30, 224
    cell = side / CELLS
    up, stairs = [], []
    for row in range(CELLS):
        count = int(np.count_nonzero(rose[row] > fell[: row + 1]))  # relays of one upper threshold: up from the left on
        y = top + side - (row + 1) * cell
        if count:
            up.append(f"M{left} {y:.1f}h{count * cell:.1f}v{cell:.1f}h-{count * cell:.1f}z")
        stairs.append((left + count * cell, y))
    path = "M" + "L".join(f"{x:.1f} {y + down:.1f}" for x, y in stairs for down in (cell, 0.0))
    bottom, right = top + side, left + side
    return (
        f'<path class="frame" d="M{left} {bottom}V{top}H{right}z"/><path class="up" d="{"".join(up)}"/>'
        f'<path class="stairs" d="{path}"/>{_name(title)}'
        f'<text class="tick" x="{left}" y="{HEIGHT - 8}">falls at</text>'
        f'<text class="tick" x="{left - 12}" y="{top + 60}" text-anchor="end">rises at</text>'
    )
