"""Modelica class of a block of a graph: location of the library HystFMU, name and parameters of the class."""

import re
from pathlib import Path

from hystfmu.base import PACKAGE, Array, InputError
from hystfmu.core.library import BlockType, Var
from hystfmu.graph import Node
from hystfmu.modelica.layout import port_placed
from hystfmu.modelica.literals import array, class_name, class_text, information, link, string


def library_date() -> str:
    """Return the date of the library version, for example ``2026-11-21``.

    Exports contain this date instead of the current date, so that two exports are bit-identical.
    """
    found = re.search(r'versionDate = "([\d-]+)"', (shipped_library() / "HystFMU" / "package.mo").read_text("utf-8"))
    assert found is not None
    return found[1]


def shipped_library() -> Path:
    """Return the folder for the library path (MODELICAPATH); this folder contains the library HystFMU.

    Raises
    ------
    InputError
        The package was installed without the library.
    """
    for folder in (PACKAGE / "_modelica", PACKAGE.parents[1] / "modelica"):
        if (folder / "HystFMU" / "package.mo").is_file():
            return folder
    raise InputError(f"no Modelica library in {PACKAGE / '_modelica'}: install the package with 'pip install .'")


DEPTH = 16  # extrema that an operator stores: the computing time grows in proportion, and 16 nested loops are rare
_PRODUCT = re.compile(r"(\w+) ?\* ?\w+\Z")

# package of each family of blocks; plants are not in Dynamics, because they are continuous in the library
_PACKAGES = {
    "operators": "Operators",
    "inverses": "Inverse",
    "networks": "Networks",
    "dynamics": "Dynamics",
    "controllers": "Control",
    "sources": "Sources",
}
# each shape of the unit `reference` is a class of Sources: parameters that only this shape has
SHAPES = {
    "sine": {"frequency", "phase"},
    "triangle": {"frequency", "phase", "turn"},
    "decaying_sine": {"frequency", "phase", "decay"},
    "multisine": {"m", "f", "a", "ph"},
    "steps": {"m", "levels", "T"},
    "random_reversals": {"m", "frequency", "seed"},
}


# hand-written enumerations of the package Types, by their words
_ENUMERATIONS = {
    "dominant|last": "Memory",
    "sigmoid|tanh|relu": "Activation",
    "corrected|printed|plain": "Recursion",
    "demagnetised|low|high": "Magnetisation",
    "rest|steady": "Start",
    "smooth|saturation": "Switching",
}


def enumeration(block: BlockType, v: Var) -> str:
    """Return the name, inside HystFMU, of the enumeration with the allowed words of the choice parameter `v`.

    Hand-written enumerations are in the package Types. All others are in the generated package Choices, and their name
    consists of block and parameter.
    """
    if name := _ENUMERATIONS.get(v.type):
        return f"Types.{name}"
    return f"Choices.{block.class_name}{camel(v.name)}"


def camel(key: str) -> str:
    """Return a key in the form of a class name, for example ``DecayingSine`` for ``decaying_sine``."""
    return "".join(w.capitalize() for w in key.split("_"))


def package_of(block: BlockType) -> str:
    """Return the name, inside HystFMU, of the package that contains the class of a block.

    For an operator, the package of the sampled realisation is returned.
    """
    is_plant = block.rate == "continuous" and block.tolerance == "integration"
    package = "Plants" if is_plant else _PACKAGES[block.family]
    return f"{package}.Sampled" if _is_realised(block) else package


def is_sampled_class(block: BlockType) -> bool:
    """Return whether the class computes outputs only at 0, Ts, 2 Ts, ... and so has the parameter Ts."""
    return block.rate == "sampled" or _is_realised(block)


def _is_realised(block: BlockType) -> bool:
    """Return whether a block can have several realisations: an operator or inverse with memory that does not learn.

    A sampled inverse learns if it is not the exact inverse of an operator.
    """
    learns = block.rate == "sampled" and not block.inverts
    return block.family in ("operators", "inverses") and block.rate != "function" and not learns


def matrix_rows(v: Var) -> str:
    """Return the name of the size parameter that is the number of rows of a matrix; "" if `v` is not a matrix."""
    product = _PRODUCT.match(v.size)
    return product[1] if product else ""


def has_shapes(block: BlockType) -> bool:
    """Return whether each shape of the block has its own class."""
    return block.parameter("shape") is not None


def class_names(block: BlockType) -> list[str]:
    """Return the names of the classes of a block: one name, or one name for each shape."""
    return [camel(s) for s in SHAPES] if has_shapes(block) else [block.class_name]


def lacks(block: BlockType, class_name: str) -> frozenset[str]:
    """Return the parameters, sizes and ports of a block that its class does not have."""
    if has_shapes(block):
        own = next(rows for shape, rows in SHAPES.items() if camel(shape) == class_name)
        return frozenset({"shape", *set.union(*SHAPES.values())} - own)
    # the class of a block with `hold` is continuous, so that its input is not sampled; an implicit inverse calls its
    # model as a package of functions, so that the port for trial outputs does not exist
    return frozenset({"hold", *((block.tried,) if block.tried else ())})


# blocks whose lags and periods are numbers of samples
COUNTED = ("delay", "iterative_learning", "narx_network", "polynomial_narx", "repetitive")
MOST_DEGREE = 3  # largest degree of Networks.PolynomialNarx
MOST_PARAMETERS = 1000  # a larger network becomes a function, because tools are slow with thousands of parameters


def word(node: Node, name: str) -> str:
    """Return the word that a choice parameter of a block is set to, for example ``"tanh"``."""
    v = node.block.parameter(name)
    assert v is not None
    return v.choices[int(node.value(name)[0])]


def is_sampled(node: Node) -> bool:
    """Return whether the class of a block computes outputs only at 0, Ts, 2 Ts, ..."""
    return place(node)[1]


def place(node: Node) -> tuple[str, bool]:
    """Return the package of the class of a block, and whether the class is sampled.

    Raises
    ------
    InputError
        The library has no class for the block, or no class for these values of its parameters.
    """
    if any("monomials" in v.size for v in node.block.vars) and node.dims["q"] > MOST_DEGREE:
        raise InputError(
            f"block {node.name!r}: the class {node.block.class_name} of the Modelica library takes a degree q up to "
            f"{MOST_DEGREE}; got {node.dims['q']}"
        )
    return package_of(node.block), is_discretised(node) or is_sampled_class(node.block)


def is_discretised(node: Node) -> bool:
    """Return whether Dynamics.StateSpace replaces the continuous class of a block.

    The matrices of the state space are discretised for the sample period, as in the co-simulation unit of the model.
    """
    return node.block.parameter("hold") is not None


def is_tied(node: Node) -> bool:
    """Return whether the parameters of a block are valid for one sample period only.

    These parameters are discretised matrices, or lags in samples.
    """
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
    is_static = node.block.family == "networks" and node.block.rate == "function"
    return is_static and node.parameters().size > MOST_PARAMETERS


def dims(node: Node) -> dict[str, int]:
    """Return the size parameters of the class of a block, by name."""
    foreign = _of_other_shapes(node)
    return {k: min(n, DEPTH) if k == "depth" else n for k, n in node.dims.items() if k not in foreign}


def values(node: Node) -> dict[str, tuple[Var, Array]]:
    """Return the numeric parameters of the class of a block, by name.

    Each one is a pair: the row of the C table that describes the parameter, and the value. A value has the shape (1,),
    (n,) or, for a matrix, (n, m).
    """
    found = {}
    for v in node.block.parameters:
        if v.choices or v.name in _of_other_shapes(node):
            continue
        value = node.value(v.name)
        rows = matrix_rows(v)
        found[v.name] = (v, value.reshape(node.dims[rows], -1) if rows else value)
    return found


def choices(node: Node) -> dict[str, str]:
    """Return the values of the choice parameters of a block by name, as literals of the library enumerations."""
    rows = [v for v in node.block.parameters if v.choices and v.name != "shape"]  # a shape is a class
    return {v.name: f"HystFMU.{enumeration(node.block, v)}.{word(node, v.name)}" for v in rows}


def _of_other_shapes(node: Node) -> frozenset[str]:
    return lacks(node.block, camel(word(node, "shape"))) if has_shapes(node.block) else frozenset()


def network_names(node: Node) -> tuple[str, str]:
    """Return the names of the function and of the block that are exported for a large network."""
    return f"{node.name}Output", f"{class_name(node.name)}Network"


def network_classes(node: Node, within: str) -> dict[str, str]:
    """Return the text of the function and of the block of a large network, by class name.

    The texts do not contain the first line of a file (see `record.mark`).
    """
    n_in, n_hidden, n_out = (node.dims[k] for k in ("n_in", "n_hidden", "n_out"))
    function, block = network_names(node)
    text = f"Network {node.name}: {n_in} inputs, {n_hidden} hidden neurons, {n_out} outputs"
    weights = [
        f"  constant Real {k}[{', '.join(map(str, w.shape))}] = {array(w)} {string(v.text)};"
        for k, (v, w) in values(node).items()
    ]
    activation = choices(node)["activation"]
    source = "<b>Source:</b> trained by hystfmu."
    computed = [
        "  extends HystFMU.Icons.Function;",
        f'  input Real u[{n_in}] "Inputs";',
        f'  output Real y[{n_out}] "Outputs";',
        *("protected", *weights, "algorithm"),
        f"  y := b2 + W2*HystFMU.Functions.activation(b1 + W1*u, {activation});",
    ]
    told = information(
        "<b>Equation:</b> y = b2 + W2 f(b1 + W1 u), f the activation.",
        source,
        "<b>Limitations:</b> the weights are constants, so that tools need not handle thousands of parameters.",
    )
    wired = [
        "  extends HystFMU.Icons.Block;",
        f'  HystFMU.Interfaces.RealInput u[{n_in}] "Inputs" annotation ({port_placed(True, 0, 1)});',
        f'  HystFMU.Interfaces.RealOutput y[{n_out}] "Outputs" annotation ({port_placed(False, 0, 1)});',
        *("equation", f"  y = {function}(u);"),
    ]
    about = information(
        f"<b>Equation:</b> y = {function}(u).",
        source,
        "<b>Limitations:</b> memoryless; the weights cannot be changed.",
        f"<b>Example:</b> {link(f'{within}.Example')}.",
        f"<b>See also:</b> {link('HystFMU.Networks.Mlp')}.",
    )
    return {
        function: class_text(f"function {function}", text, computed, told, within),
        block: class_text(f"block {block}", text, wired, about, within),
    }
