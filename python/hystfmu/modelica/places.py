"""Where the class of a block stands in the library HystFMU, and what the class lacks."""

from __future__ import annotations

import re

from hystfmu.core.library import BlockType, Var

_PRODUCT = re.compile(r"(\w+) ?\* ?\w+\Z")

_PACKAGES = {
    ("Operators.Sampled", True): (
        "backlash_sum bouc_wen constraint_factor creep duhem krasnoselskii_pokrovskii play_bank prandtl_ishlinskii "
        "preisach zhao_tan"
    ),
    ("Operators", False): "dead_zones",
    ("Inverse.Sampled", True): (
        "constraint_factor_inverse implicit_inverse prandtl_ishlinskii_inverse zhao_tan_inverse "
        "zhao_tan_inverse_reconstructed"
    ),
    ("Dynamics", True): "delay differentiator transfer_function",
    ("Dynamics", False): "scaling sum",
    ("Networks", True): "polynomial_narx",
    ("Networks", False): "mlp",
    ("Plants", False): "bouc_wen_oscillator",
    ("Control", True): "disturbance_observer iterative_learning lead_lag pid sliding_mode super_twisting",
    ("Control", False): "feedforward",
    ("Sources", True): "noise",
    ("Sources", False): "disturbance reference",
}
PLACES = {block: place for place, blocks in _PACKAGES.items() for block in blocks.split()}
# a class of Sources is one shape of the unit `reference`: parameters that belong to a shape, besides those of all
SHAPES = {
    "sine": {"frequency", "phase"},
    "triangle": {"frequency", "phase"},
    "decaying_sine": {"frequency", "phase", "decay"},
    "multisine": {"m", "f", "a", "ph"},
    "steps": {"m", "levels", "T"},
    "random_reversals": {"m", "frequency", "seed"},
}
# what a class has not of its block
_LACKS = {
    "transfer_function": {"hold"},  # continuous: its input is not sampled
    "implicit_inverse": {"h"},  # its model is a package of functions, and hangs on no port
}


def camel(key: str) -> str:
    """``decaying_sine`` as a class: ``DecayingSine``."""
    return "".join(w.capitalize() for w in key.split("_"))


def package_of(block: BlockType) -> str:
    """Package of the class of a block, below HystFMU; for an operator that of its sampled realisation."""
    return PLACES[block.name][0]


def is_sampled_class(block: BlockType) -> bool:
    """Whether the class acts at 0, Ts, 2 Ts, ... and has the parameter Ts."""
    return PLACES[block.name][1]


def matrix_rows(v: Var) -> str:
    """The size that counts the rows of a row of a C table which is a matrix in Modelica, or ""."""
    product = _PRODUCT.match(v.size)
    return product[1] if product else ""


def class_names(block: BlockType) -> list[str]:
    """Names of its classes: one, or one for each shape of ``reference``."""
    return [camel(s) for s in SHAPES] if block.name == "reference" else [block.class_name]


def lacks(block: BlockType, class_name: str) -> frozenset[str]:
    """Parameters, sizes and ports of a block that a class of it has not."""
    if block.name == "reference":
        own = next(rows for shape, rows in SHAPES.items() if camel(shape) == class_name)
        return frozenset({"shape", *set.union(*SHAPES.values())} - own)
    return frozenset(_LACKS.get(block.name, ()))
