"""Class of the library HystFMU for a block of a graph, and the modifiers of this class."""

from __future__ import annotations

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.core.library import Var
from hystfmu.graph import Node
from hystfmu.modelica.places import (
    DEPTH,
    camel,
    enumeration,
    has_shapes,
    is_sampled_class,
    lacks,
    matrix_rows,
    package_of,
)

# their lags and periods are numbers of samples
COUNTED = ("delay", "iterative_learning", "narx_network", "polynomial_narx", "repetitive")
MOST_DEGREE = 3  # of Networks.PolynomialNarx
MOST_PARAMETERS = 1000  # a larger network becomes a function: tools handle thousands of parameters one by one


def word(node: Node, name: str) -> str:
    """Return the word of a choice, e.g. ``"tanh"``."""
    v = next(v for v in node.block.parameters if v.name == name)
    return v.choices[int(node.value(name)[0])]


def is_sampled(node: Node) -> bool:
    """Return whether the class of a block acts only at 0, Ts, 2 Ts, ..."""
    return place(node)[1]


def place(node: Node) -> tuple[str, bool]:
    """Return the package of the class, and whether the class is sampled.

    Raises
    ------
    InputError
        The library has no class for the block, or no class for these values.
    """
    if node.type == "polynomial_narx" and node.dims["q"] > MOST_DEGREE:
        raise InputError(
            f"block {node.name!r}: the class PolynomialNarx of the Modelica library takes a degree q up to "
            f"{MOST_DEGREE}; got {node.dims['q']}"
        )
    return package_of(node.block), is_discretised(node) or is_sampled_class(node.block)


def is_discretised(node: Node) -> bool:
    """Return whether a StateSpace, discretised for the step as in the unit, replaces the continuous class."""
    return node.type == "transfer_function"


def is_tied(node: Node) -> bool:
    """Return whether a block depends on the sample period, by its matrices or by lags in samples."""
    return is_discretised(node) or node.type in COUNTED


def class_of(node: Node) -> str:
    """Return the qualified name of the class of a block.

    Raises
    ------
    InputError
        As in `place`.
    """
    package = place(node)[0]
    if is_discretised(node):
        return "HystFMU.Dynamics.StateSpace"
    if has_shapes(node.block):
        return f"HystFMU.{package}.{camel(word(node, 'shape'))}"
    return f"HystFMU.{package}.{node.block.class_name}"


def is_large(node: Node) -> bool:
    """Return whether a block is a network that is exported as a function."""
    return node.type == "mlp" and node.parameters().size > MOST_PARAMETERS


def dims(node: Node) -> dict[str, int]:
    """Return the sizes that the class of a block takes."""
    foreign = _of_other_shapes(node)
    return {k: min(n, DEPTH) if k == "depth" else n for k, n in node.dims.items() if k not in foreign}


def values(node: Node) -> dict[str, tuple[Var, Array]]:
    """Return the numeric parameters of the class of a block: row of the table, and value, a matrix in its shape."""
    found = {}
    for v in node.block.parameters:
        if v.choices or v.name in _of_other_shapes(node):
            continue
        value = node.value(v.name)
        rows = matrix_rows(v)
        found[v.name] = (v, value.reshape(node.dims[rows], -1) if rows else value)
    return found


def choices(node: Node) -> dict[str, str]:
    """Return the choices that the class of a block takes, as words of the enumerations of the library."""
    rows = [v for v in node.block.parameters if v.choices and v.name != "shape"]  # a shape is a class
    return {v.name: f"HystFMU.{enumeration(node.block, v)}.{word(node, v.name)}" for v in rows}


def _of_other_shapes(node: Node) -> frozenset[str]:
    return lacks(node.block, camel(word(node, "shape"))) if has_shapes(node.block) else frozenset()
