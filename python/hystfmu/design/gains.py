"""The gains of a controller with their units: a number without its unit cannot be carried to another loop."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.base.arrays import Array
from hystfmu.graph import Node


@dataclass(frozen=True)
class Gain:
    """One parameter of a controller.

    Parameters
    ----------
    name, text : str
        As in the block's table.
    value : array, shape (n,)
    unit : str
        Of the values; "1" where the table has none.
    """

    name: str
    value: Array
    unit: str
    text: str

    def __str__(self) -> str:
        values = ", ".join(f"{v:.6g}" for v in self.value)
        return f"{self.name} = {values}{'' if self.unit == '1' else ' ' + self.unit}  ({self.text})"


def gains(node: Node) -> list[Gain]:
    """The numbers that a designer sets, in the order of the block's table.

    Parameters
    ----------
    node : Node
        Of any block; words (enumerations) are left out.
    """
    return [Gain(v.name, node.value(v.name), v.unit, v.text) for v in node.block.parameters if not v.choices]
