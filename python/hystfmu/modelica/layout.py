"""Placement of components and ports in the diagram: sources stand left of their sinks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_DISTANCE, _SIZE = 40, 20


@dataclass(frozen=True)
class Spots:
    """Centres in the diagram: of each component by its name, and of the record in a corner."""

    of: dict[str, tuple[int, int]]
    corner: tuple[int, int]


def spots(nodes: Sequence[str], wires: Sequence[tuple[str, str]]) -> Spots:
    """A column for each distance from the inputs, blocks of one column below each other."""
    column: dict[str, int] = {}
    for node in nodes:  # sources first
        before = [column[a.split(".")[0]] for a, b in wires if b.split(".")[0] == node]
        column[node] = 1 + max(before, default=-1)
    columns = [[n for n in column if column[n] == k] for k in range(max(column.values()) + 1)]
    middle = (len(columns) - 1) * _DISTANCE // 2
    of = {
        name: (k * _DISTANCE - middle, (len(names) - 1) * _DISTANCE // 2 - i * _DISTANCE)
        for k, names in enumerate(columns)
        for i, name in enumerate(names)
    }
    return Spots(of, (-80, _DISTANCE + max(y for _, y in of.values())))


def placed(x: int, y: int, half: int = _SIZE // 2) -> str:
    """The annotation of a component around (x, y)."""
    return f"Placement(transformation(extent = {{{{{x - half}, {y - half}}}, {{{x + half}, {y + half}}}}}))"


def port_placed(is_input: bool, i: int, n: int) -> str:
    """The annotation of port i of n at the left or right edge of the icon."""
    return placed(-110 if is_input else 110, (n - 1 - 2 * i) * 80 // n)
