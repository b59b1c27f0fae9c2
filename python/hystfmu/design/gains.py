"""Gains of a controller with units of measure. A gain needs its unit of measure for use in another loop."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.base.arrays import Array
from hystfmu.base.calls import checked
from hystfmu.graph import Node


@dataclass(frozen=True)
class Gain:
    """One parameter of a controller.

    Parameters
    ----------
    name, text : str
        Name and meaning from the table of the block.
    value : array, shape (n,)
        Values.
    unit : str
        Unit of measure; "1" for a dimensionless value.
    """

    name: str
    value: Array
    unit: str
    text: str

    def __str__(self) -> str:
        values = ", ".join(f"{v:.6g}" for v in self.value)
        return f"{self.name} = {values}{'' if self.unit == '1' else ' ' + self.unit}  ({self.text})"


@checked
def gains(node: Node) -> list[Gain]:
    """Return the numeric parameters of a block, in the order of its table.

    Parameters
    ----------
    node : Node
        Any block; enumerations are left out.
    """
    return [Gain(v.name, node.value(v.name), v.unit, v.text) for v in node.block.parameters if not v.choices]
