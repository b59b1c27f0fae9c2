"""Which class of the library HystFMU stands for a block of a graph, and what it is given."""

from __future__ import annotations

from hystfmu.core import Array, BlockType, Var
from hystfmu.errors import InputError
from hystfmu.graph import Node

DEPTH = 32  # extrema that an exported operator remembers: a step takes time in proportion; 32 nested loops are rare
MOST_DEGREE = 3  # of Networks.PolynomialNarx
MOST_PARAMETERS = 1000  # a larger network becomes a function: tools handle thousands of parameters one by one

# package of the class of a block; True: it acts at 0, Ts, 2 Ts, ... and has the parameter Ts
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
_ENUMERATIONS = {
    "dominant|last": "Memory",
    "sigmoid|tanh|relu": "Activation",
    "demagnetised|low|high": "Magnetisation",
    "rest|steady": "Start",
    "smooth|saturation": "Switching",
}


def word(node: Node, name: str) -> str:
    """The word of a choice, e.g. ``"tanh"``."""
    v = next(v for v in node.block.parameters if v.name == name)
    return v.choices[int(node.value(name)[0])]


def is_sampled(node: Node) -> bool:
    """Whether its class acts at 0, Ts, 2 Ts, ... only."""
    return place(node)[1]


def place(node: Node) -> tuple[str, bool]:
    """Package of the class, and whether it is sampled.

    Raises
    ------
    InputError
        The library has no such class, or not for these values.
    """
    if node.type not in PLACES:
        raise InputError(f"block {node.name!r}: the Modelica library HystFMU has no class for {node.type!r}")
    if node.type == "polynomial_narx" and node.dims["q"] > MOST_DEGREE:
        raise InputError(
            f"block {node.name!r}: the class PolynomialNarx of the Modelica library takes a degree q up to "
            f"{MOST_DEGREE}; got {node.dims['q']}"
        )
    return PLACES[node.type]


def class_of(node: Node) -> str:
    """Qualified name of its class.

    Raises
    ------
    InputError
        As `place`.
    """
    package = place(node)[0]
    if node.type == "transfer_function":
        return "HystFMU.Dynamics.StateSpace"  # discretised for the step, as in the unit
    if node.type == "reference":
        shape = "".join(w.capitalize() for w in word(node, "shape").split("_"))
        return f"HystFMU.{package}.{shape}"
    return f"HystFMU.{package}.{node.block.class_name}"


def is_large(node: Node) -> bool:
    """Whether it is a network that becomes a function."""
    return node.type == "mlp" and node.parameters().size > MOST_PARAMETERS


def dims(node: Node) -> dict[str, int]:
    """The sizes that its class takes."""
    foreign = _of_other_shapes(node)
    return {k: min(n, DEPTH) if k == "depth" else n for k, n in node.dims.items() if k not in foreign}


def values(node: Node) -> dict[str, tuple[Var, Array]]:
    """The numeric parameters that its class takes: row of the table and value, a matrix in its shape."""
    found = {}
    for v in node.block.parameters:
        if v.choices or v.name in _of_other_shapes(node):
            continue
        value = node.value(v.name)
        rows = {"W1": "n_hidden", "W2": "n_out"}.get(v.name) if node.type == "mlp" else None
        found[v.name] = (v, value.reshape(node.dims[rows], -1) if rows else value)
    return found


def choices(node: Node) -> dict[str, str]:
    """The choices that its class takes, as words of the library's enumerations."""
    rows = [v for v in node.block.parameters if v.choices and v.name != "shape"]  # a shape is a class
    return {v.name: f"HystFMU.Types.{_ENUMERATIONS['|'.join(v.choices)]}.{word(node, v.name)}" for v in rows}


def missing(block: BlockType, shape: str = "") -> set[str]:
    """Parameters and sizes of a block that its class lacks; `shape` for ``reference``."""
    if block.name == "reference":
        return {"shape", *set.union(*SHAPES.values())} - SHAPES[shape]
    return set()


def _of_other_shapes(node: Node) -> set[str]:
    return missing(node.block, word(node, "shape")) if node.type == "reference" else set()
