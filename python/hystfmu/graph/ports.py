"""Interface of a graph: inputs and outputs, and the variables and states that an importer sees."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.base.calls import checked
from hystfmu.core.library import Var


def element_names(name: str, size: int) -> tuple[str, ...]:
    """Return one name per element of a variable: `w`, or `w_1`, `w_2`, ... for an array."""
    return (name,) if size == 1 else tuple(f"{name}_{i + 1}" for i in range(size))


@checked
@dataclass(frozen=True)
class Input:
    """An input of a graph.

    Parameters
    ----------
    name : str
        Name of the port.
    to : tuple of str
        Endpoints that the input drives.
    unit : str
        Unit of measure.
    start : float
        Start value.
    text : str
        Description.
    starts : tuple of float
        Start values of the elements of an array, instead of `start`; model files do not keep them.

    Examples
    --------
    >>> import hystfmu as hy
    >>> hy.Input("u", to=("hysteresis.u",), unit="V").name
    'u'
    """

    name: str
    to: tuple[str, ...]
    unit: str = ""
    start: float = 0.0
    text: str = ""
    starts: tuple[float, ...] = ()


@checked
@dataclass(frozen=True)
class Output:
    """An output of a graph.

    Parameters
    ----------
    name : str
        Name of the port.
    source : str
        Endpoint that the output reads.
    unit : str
        Unit of measure.
    text : str
        Description.

    Examples
    --------
    >>> import hystfmu as hy
    >>> hy.Output("y", source="hysteresis.y", unit="um").source
    'hysteresis.y'
    """

    name: str
    source: str
    unit: str = ""
    text: str = ""


@dataclass(frozen=True)
class Port:
    """A variable of the unit as an importer sees it; the value references of its elements begin at `reference`.

    Attributes
    ----------
    name, kind, text : str
        Name, kind (param, fixed, input, output) and description.
    node : int
        Index of the block of the variable in the graph.
    var : Var
        Row of the block's table.
    place : int
        Index of the first element among the inputs of the graph, or within the variable of the block.
    reference, size : int
        First value reference and number of elements.
    unit : str
        Unit of measure.
    start : tuple of float
        Start values, one per element.
    """

    name: str
    kind: str
    node: int
    var: Var
    place: int
    reference: int
    size: int
    unit: str
    text: str
    start: tuple[float, ...]

    @property
    def is_parameter(self) -> bool:
        """True if the variable is a parameter, tunable or fixed."""
        return self.kind in ("param", "fixed")

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of the elements of the variable."""
        return element_names(self.name, self.size)


@dataclass(frozen=True)
class ContinuousState:
    """One continuous state of the unit, with its name in Model Exchange; its derivative is `der(name)`."""

    name: str
    unit: str
    text: str
