"""Positions of components and ports in a diagram. A source is placed to the left of the components that it drives."""

from collections.abc import Sequence
from dataclasses import dataclass

_DISTANCE, _SIZE = 40, 20
Point = tuple[float, float]


@dataclass(frozen=True)
class Spots:
    """Positions in the diagram.

    `of` contains the centre of each component by name. `corner` is the centre of the record. `edge` is the horizontal
    distance of the ports from the centre of the diagram.
    """

    of: dict[str, tuple[int, int]]
    corner: tuple[int, int]
    edge: int = 110


def spots(nodes: Sequence[str], wires: Sequence[tuple[str, str]]) -> Spots:
    """Return the positions of components. The column of a block is the number of wires on the longest path to it.

    Blocks of the same column are below each other.
    """
    column: dict[str, int] = {}
    for node in nodes:  # sources come before the blocks that they drive
        before = [column[a.split(".")[0]] for a, b in wires if b.split(".")[0] == node]
        column[node] = 1 + max(before, default=-1)
    columns = [[n for n in column if column[n] == k] for k in range(max(column.values()) + 1)]
    middle = (len(columns) - 1) * _DISTANCE // 2
    of = {
        name: (k * _DISTANCE - middle, (len(names) - 1) * _DISTANCE // 2 - i * _DISTANCE)
        for k, names in enumerate(columns)
        for i, name in enumerate(names)
    }
    edge = max(110, middle + _DISTANCE)
    return Spots(of, (-80, _DISTANCE + max(y for _, y in of.values())), edge)


def placed(x: float, y: float, half: int = _SIZE // 2) -> str:
    """Return the annotation of a component with its centre at (x, y); `half` is half the size of the component."""
    return f"Placement(transformation(extent = {{{{{x - half:g}, {y - half:g}}}, {{{x + half:g}, {y + half:g}}}}}))"


def port_placed(is_input: bool, i: int, n: int, edge: int = 110) -> str:
    """Return the annotation of port i of n at the left or right edge of the icon.

    In a wide diagram, `edge` is the distance of the port from the centre of the diagram.
    """
    icon = placed(*port_at(is_input, i, n))
    if edge == 110:
        return icon
    inner = icon.replace("Placement(transformation", "iconTransformation")[:-1]
    return f"{placed(*port_at(is_input, i, n, edge))[:-1]}, {inner})"


def port_at(is_input: bool, i: int, n: int, edge: int = 110) -> Point:
    """Return the centre of port i of n at the left edge (inputs) or the right edge (outputs)."""
    return -edge if is_input else edge, (n - 1 - 2 * i) * 80 // n


def on_component(port: Point, centre: Point, half: float = _SIZE / 2) -> Point:
    """Return the position of a port in a diagram that contains the icon of its component.

    `port` is the position in the icon, `centre` is the position of the icon in the diagram, and `half` is half the size
    of the icon.
    """
    return centre[0] + port[0] * half / 100, centre[1] + port[1] * half / 100


def line(a: Point, b: Point, color: str = "{0, 0, 127}") -> str:
    """Return the annotation of a wire between two ports.

    The ends of the wire are horizontal. A wire from right to left passes below the components.
    """
    (x1, y1), (x2, y2) = a, b
    if y1 == y2 and x1 < x2:
        points = [a, b]
    elif x1 < x2:
        middle = (x1 + x2) / 2
        points = [a, (middle, y1), (middle, y2), b]
    else:
        low = min(y1, y2) - _SIZE
        points = [a, (x1 + 6, y1), (x1 + 6, low), (x2 - 6, low), (x2 - 6, y2), b]
    text = ", ".join(f"{{{x:g}, {y:g}}}" for x, y in points)
    return f"annotation (Line(points = {{{text}}}, color = {color}))"
