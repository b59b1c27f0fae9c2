"""Place of the class of a block in the library HystFMU, and the features that the class lacks."""

from __future__ import annotations

import re

from hystfmu.core.library import BlockType, Var

DEPTH = 16  # extrema that an operator remembers: a step takes time in proportion; 16 nested loops are rare
_PRODUCT = re.compile(r"(\w+) ?\* ?\w+\Z")

# package of a family; a plant, which is continuous in the library, stands apart from the linear dynamics
_PACKAGES = {
    "operators": "Operators",
    "inverses": "Inverse",
    "networks": "Networks",
    "dynamics": "Dynamics",
    "controllers": "Control",
    "sources": "Sources",
}
_PLANTS = {"bouc_wen_oscillator", "duhem_oscillator"}
_LEARNS = {"adaptive_inverse"}  # an inverse that learns from samples has no realisation but the sampled one
# a class of Sources is one shape of the unit `reference`: parameters that belong to a shape, besides those of all
SHAPES = {
    "sine": {"frequency", "phase"},
    "triangle": {"frequency", "phase", "turn"},
    "decaying_sine": {"frequency", "phase", "decay"},
    "multisine": {"m", "f", "a", "ph"},
    "steps": {"m", "levels", "T"},
    "random_reversals": {"m", "frequency", "seed"},
}
# what a class has not of its block
_LACKS = {
    "transfer_function": {"hold"},  # continuous: its input is not sampled
}


# the enumerations of Types that are written by hand, by their words
_ENUMERATIONS = {
    "dominant|last": "Memory",
    "sigmoid|tanh|relu": "Activation",
    "corrected|printed|plain": "Recursion",
    "demagnetised|low|high": "Magnetisation",
    "rest|steady": "Start",
    "smooth|saturation": "Switching",
}


def enumeration(block: BlockType, v: Var) -> str:
    """Return the name below HystFMU of the enumeration of the words of a choice.

    An enumeration that is not written by hand is in the generated package Choices, with a name from block and
    parameter.
    """
    if name := _ENUMERATIONS.get(v.type):
        return f"Types.{name}"
    return f"Choices.{block.class_name}{camel(v.name)}"


def camel(key: str) -> str:
    """Return the name of a class: ``DecayingSine`` for ``decaying_sine``."""
    return "".join(w.capitalize() for w in key.split("_"))


def package_of(block: BlockType) -> str:
    """Return the package of the class of a block, below HystFMU; for an operator, of its sampled realisation."""
    package = "Plants" if block.name in _PLANTS else _PACKAGES[block.family]
    return f"{package}.Sampled" if _is_realised(block) else package


def is_sampled_class(block: BlockType) -> bool:
    """Return whether the class acts at 0, Ts, 2 Ts, ... and has the parameter Ts."""
    return block.rate == "sampled" or _is_realised(block)


def _is_realised(block: BlockType) -> bool:
    """Return whether a block has up to three realisations: an operator or inverse with memory and without learning."""
    return block.family in ("operators", "inverses") and block.rate != "function" and block.name not in _LEARNS


def matrix_rows(v: Var) -> str:
    """Return the name of the size that is the number of rows of a matrix in Modelica; "" for other variables."""
    product = _PRODUCT.match(v.size)
    return product[1] if product else ""


def has_shapes(block: BlockType) -> bool:
    """Return whether each shape of the block is a class."""
    return block.name == "reference"


def class_names(block: BlockType) -> list[str]:
    """Return the names of the classes of a block: one, or one for each shape."""
    return [camel(s) for s in SHAPES] if has_shapes(block) else [block.class_name]


def lacks(block: BlockType, class_name: str) -> frozenset[str]:
    """Return the parameters, sizes and ports of a block that its class does not have."""
    if has_shapes(block):
        own = next(rows for shape, rows in SHAPES.items() if camel(shape) == class_name)
        return frozenset({"shape", *set.union(*SHAPES.values())} - own)
    # the model of an output found by trial is a package of functions, and hangs on no port
    return frozenset({*_LACKS.get(block.name, ()), *((block.tried,) if block.tried else ())})
