"""Modelica record with all numeric parameters of a model, under the same names as in the FMU."""

import numpy as np

from hystfmu.base import Array, InputError, escape
from hystfmu.graph import Graph, Node
from hystfmu.model import Model
from hystfmu.modelica import classes
from hystfmu.modelica.literals import array, class_text, number, sentence, string
from hystfmu.modelica.realisation import kinds


def span(model: Model) -> tuple[float, float] | None:
    """Return smallest and largest input of the identification data in the unit of the data; None if unknown."""
    found = model.provenance.get("span_u")
    if (
        isinstance(found, list)
        and len(found) == 2
        and all(isinstance(v, int | float) for v in found)
        and found[0] < found[1]
    ):
        return float(found[0]), float(found[1])
    return None


TEXTS = {
    "A": "state of the last step",
    "b_new": "new input",
    "b_old": "input before it",
    "c": "output row",
    "d": "direct term",
    "x_steady": "state at a first input of 1",
}


def state_space(node: Node, h: float) -> dict[str, Array]:
    """Return the matrices of a ``transfer_function`` for the step `h` (s), in the form of `Dynamics.StateSpace`.

    As in the co-simulation unit of the model, the input is constant at its new value over the step (``hold = "zoh"``),
    or it changes linearly from the last value to the new value ("foh"). One matrix exponential gives the integrals for
    the old and the new input (Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404).

    Returns
    -------
    dict
        A (n, n); b_new, b_old, c, x_steady (n,); d (1,).

    Raises
    ------
    InputError
        The block has an integrator, and its parameter ``start`` requires a steady state.
    """
    from scipy.linalg import expm

    a, b = node.value("a"), node.value("b")
    n = len(a) - 1
    numerator = np.concatenate([np.zeros(n + 1 - len(b)), b]) / a[0]
    alpha = a[1:] / a[0]
    # controllable canonical form, with time scaled by the last coefficient, so that the matrix elements are near 1
    sigma = abs(alpha[-1]) ** (1 / n) if alpha[-1] != 0 else 1.0
    weights = sigma ** np.arange(1, n + 1)
    scaled = alpha / weights
    F = np.eye(n, k=1)
    F[-1] = -scaled[::-1]
    block = np.zeros((n + 2, n + 2))
    block[:n, :n], block[n - 1, n], block[n, n + 1] = F * sigma * h, sigma * h, 1.0
    E = expm(block)
    whole, ramp = E[:n, n], E[:n, n + 1]
    straight = node.value("hold")[0] == 1
    steady = np.zeros(n)
    if node.value("start")[0] == 1:
        if scaled[-1] == 0:
            raise InputError(f"block {node.name!r}: start = steady: an integrator has no steady state")
        steady[0] = 1 / scaled[-1]
    return {
        "A": E[:n, :n],
        "b_new": ramp if straight else whole,
        "b_old": whole - ramp if straight else np.zeros(n),
        "c": ((numerator[1:] - numerator[0] * alpha) / weights)[::-1],
        "d": numerator[:1],
        "x_steady": steady,
    }


Declared = tuple[str, str, str, str]  # type, size, value and description


def mark(source: str) -> str:
    """Return the first line of an exported file. This line marks the file as generated, see `is_ours`."""
    return f"// generated from {' '.join(source.split())} by hystfmu export --modelica - do not edit"


def is_ours(text: str) -> bool:
    """Return whether the text of a file begins with a line of `mark`."""
    first = text.partition("\n")[0]
    return first.startswith("// generated from ") and first.endswith(" by hystfmu export --modelica - do not edit")


def field(graph: Graph, node: Node, key: str) -> str:
    """Return the name of a parameter in the record. It is also the name in the FMU."""
    return key if len(graph.nodes) == 1 else f"{node.name}_{key}"


def step(model: Model) -> float:
    """Return the sample period (s) of the exported block.

    It is the time step of `Model.predict`. If the model has neither a step nor a sampled block, the result is 1 s.

    Raises
    ------
    InputError
        A block is sampled, and the model has no step.
    """
    if model.step is not None:
        return float(model.step)
    if any(classes.is_sampled(n) for n in model.graph.nodes):
        raise InputError("the model has no sample period: give --step SECONDS, or step in the model file")
    return 1.0


def record(model: Model, name: str, within: str, source: str, history: str = "") -> str:
    """Return the text of the file of the parameter record of a model, without its first line (see `mark`).

    Parameters
    ----------
    model : Model
    name, within : str
        Name of the record, and name of its package.
    source : str
        Origin of the values, for the documentation.
    history : str
        Fit quality and provenance as HTML.

    Raises
    ------
    InputError
        The library has no class for a block, or two values would have the same name.
    """
    lines: list[str] = []
    names = ["key", "Ts", "rms_percent", "max_percent"]
    for node in model.graph.nodes:
        classes.class_of(node)  # raises
        fields = _fields(model, node)
        names += fields
        lines += [f"  parameter {text};" for text in fields.values()]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise InputError(f"two values of the Modelica record would have the name {twice[0]!r}; rename a block")
    fit = [f"{k} = {number(model.fit[k])}" for k in ("rms_percent", "max_percent") if k in model.fit]
    about = ", ".join([f"key = {string(model.key)}", f"Ts = {number(step(model))}", *fit])
    lines.insert(0, f"  extends HystFMU.Data.IdentifiedModel({about});")
    info = string(_documentation(model, source, history))
    return class_text(f"record {name}", model.text or model.key, lines, info, within)


def _documentation(model: Model, source: str, history: str) -> str:
    return (
        f"<html><p>Values of a model of kind <em>{escape(model.key)}</em>: {escape(model.text)}. A name is that of the "
        f"block and that of its parameter, as in the FMU.</p>{history}"
        f"<p><b>Source:</b> {escape(source)}.</p>"
        "<p><b>Limitations:</b> valid within the range of the identification data.</p></html>"
    )


def _fields(model: Model, node: Node) -> dict[str, str]:
    """Return the declarations of the parameters of a node, by name."""
    graph = model.graph
    if classes.is_large(node):
        return {}
    found: dict[str, Declared] = {}
    if classes.is_discretised(node):
        matrices = state_space(node, step(model))
        found[field(graph, node, "n")] = ("Integer", "", str(node.dims["na"]), "order")
        for key, value in matrices.items():
            size = "" if key == "d" else f"[{', '.join(map(str, value.shape))}]"
            found[field(graph, node, key)] = ("Real", size, _literal(value, size), TEXTS[key])
        if kinds(graph):  # the other realisations use the continuous form
            found |= _plain(graph, node)
    else:
        found |= _plain(graph, node)
    group = f"annotation (Dialog(group = {string(node.name)}))"
    return {n: f"{kind} {n}{size} = {value} {sentence(text)} {group}" for n, (kind, size, value, text) in found.items()}


def _plain(graph: Graph, node: Node) -> dict[str, Declared]:
    """Return the parameters of the library class of a node as declarations, by name."""
    found: dict[str, Declared] = {}
    sizes = {d.name: d.text for d in node.block.dims}
    for key, n in classes.dims(node).items():
        found[field(graph, node, key)] = ("Integer", "", str(n), sizes[key])
    for key, (v, value) in classes.values(node).items():
        size = "" if v.size == "1" else f"[{', '.join(map(str, value.shape))}]"
        kind = "Integer" if v.type == "int" else "Real"
        literal = str(int(value[0])) if v.type == "int" else _literal(value, size)
        found[field(graph, node, key)] = (kind, size, literal, v.text)
    return found


def _literal(value: Array, size: str) -> str:
    return array(value) if size else number(value[0])
