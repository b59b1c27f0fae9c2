"""Model inside an implicit inverse, as a Modelica package with a function ``step``.

The function computes one step of the blocks on the path from the output u of the inverse to its input h.
"""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base import InputError
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.classes import matrix_rows, shipped_library
from hystfmu.modelica.literals import class_name, class_text, information, number, sentence, unique
from hystfmu.modelica.record import field

_STATED = re.compile(r"values = (?P<values>.+); state0 = (?P<state0>.+)\.</p>")


@dataclass(frozen=True)
class StaticForm:
    """A block of the inverted model, whose package in ``HystFMU.Inverse.Models`` has a function ``step``.

    Attributes
    ----------
    node : Node
    values, state0 : (str, int)
        Modelica vector of the parameters or of the initial state, and its number of elements. The state begins with the
        outputs.
    """

    node: Node
    values: tuple[str, int]
    state0: tuple[str, int]

    def call(self, x: list[str], n_values: int, n_state: int) -> str:
        """Return the expression of the new state for the inputs `x`, one expression for each element.

        Parameters
        ----------
        x : list of str
            Inputs of the block, one expression for each element.
        n_values, n_state : int
            Numbers of elements in the vectors ``values`` and ``state`` before the elements of this block.
        """
        if classes.is_large(self.node):
            return f"{classes.network_names(self.node)[0]}({_vector(x)})"
        u = x[0] if self.node.block.of("input")[0].size == "1" else _vector(x)
        state = f"state[{n_state + 1}:{n_state + self.state0[1]}]"
        values = f"values[{n_values + 1}:{n_values + self.values[1]}]"
        return f"HystFMU.Inverse.Models.{self.node.block.class_name}.step({u}, {state}, {values})"


def static_form(graph: Graph, node: Node) -> StaticForm:
    """Return the Modelica expressions of a block of the inverted model.

    The documentation of the package of the block states ``values`` and ``state0`` by the names of the parameters.

    Raises
    ------
    InputError
        The library has no package for the block.
    """
    file = shipped_library() / "HystFMU" / "Inverse" / "Models" / f"{node.block.class_name}.mo"
    if not file.is_file():
        raise InputError(
            f"block {node.name!r}: the Modelica library HystFMU has no static form of {node.type!r} for an implicit "
            "inverse"
        )
    stated = _STATED.search(file.read_text("utf-8"))
    assert stated is not None, file
    values, state0 = (_expression(graph, node, stated[k]) for k in ("values", "state0"))
    # the weights of a large network are constants of its function
    return StaticForm(node, ("", 0) if classes.is_large(node) else values, state0)


def _expression(graph: Graph, node: Node, stated: str) -> tuple[str, int]:
    """Return an expression of parameters with the names of the record, and its number of elements."""
    numbers = {v.name: node.value(v.name) for v in node.block.parameters}
    rows = {v.name: matrix_rows(v) for v in node.block.parameters if not v.choices}
    dims = classes.dims(node)
    words = {k: str(n) for k, n in dims.items()} | classes.choices(node) | {"Functions": "HystFMU.Functions"}

    def named(match: re.Match[str]) -> str:
        if match[0] in words or match[0] not in rows:
            return words.get(match[0], match[0])
        ref, count = f"values.{field(graph, node, match[0])}", rows[match[0]]
        return ", ".join(f"{ref}[{k + 1}, :]" for k in range(node.dims[count])) if count else ref

    stated = re.sub(r"Integer\((\w+)\)", lambda m: str(int(numbers[m[1]][0]) + 1), stated)
    text = re.sub(r"(?<![\w.])[A-Za-z_]\w*", named, stated)
    sizes = {v.name: v.size for v in node.block.parameters}
    known: dict[str, Any] = {k: v[0] if sizes[k] == "1" else v for k, v in numbers.items()} | dims
    known |= {"true": True, "false": False, "zeros": np.zeros, "cat": lambda _, *parts: np.concatenate(parts)}
    # safe: the text comes from the library of this package
    return text, len(eval(stated.replace("{", "[").replace("}", "]"), known | {"Functions": _Lengths()}))


class _Lengths:
    """Functions of the library, which return zeros in the number that their files declare."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        text = (shipped_library() / "HystFMU" / "Functions" / f"{name}.mo").read_text("utf-8")
        inputs, size = re.findall(r"(?m)^ *input [\w.]+ (\w+)", text), re.search(r"output Real \w+\[(.+)\] ", text)

        def zeros(*values: Any) -> Any:
            known = dict(zip(inputs, values, strict=True)) | {"div": operator.floordiv}
            return np.zeros(eval(size[1], known)) if size else 0.0  # safe: see above

        return zeros


def _vector(x: list[str]) -> str:
    """Return expressions as one Modelica vector. Consecutive elements of the same vector become a slice."""
    name = x[0].partition("[")[0]
    places = [e.partition("[")[2].rstrip("]") for e in x]
    if all(places) and [e.partition("[")[0] for e in x] == [name] * len(x):
        first = int(places[0])
        if [int(p) for p in places] == list(range(first, first + len(x))):
            return f"{name}[{first}:{first + len(x) - 1}]"
    return f"{{{', '.join(x)}}}"


_WORDS = ("u", "state", "values", "state_new")  # variables of the function ``step``


@dataclass(frozen=True)
class Tried:
    """The model that an implicit inverse inverts, as a Modelica package.

    Attributes
    ----------
    package : str
        Name of the package.
    values, state0 : str
        Expressions for the parameters `values` and `state0` of the block of the inverse. They refer to the record
        ``values``.
    text : str
        Text of the Modelica file of the package, without its first line (the mark of an exported file).
    """

    package: str
    values: str
    state0: str
    text: str


def inverses(graph: Graph) -> list[Node]:
    """Return the implicit inverses of a graph."""
    return [n for n in graph.nodes if n.block.trial]


def package_of(node: Node) -> str:
    """Return the name of the package of an implicit inverse."""
    return f"{class_name(node.name)}Model"


def wires(graph: Graph) -> list[tuple[str, str]]:
    """Return the wires of a graph without those to the input h of an implicit inverse.

    The package of the inverse computes the values of h.
    """
    ends = {f"{n.name}.{n.block.tried}" for n in inverses(graph)}
    return [(a, b) for a, b in graph.wires if b.split("[")[0] not in ends]


def hidden(graph: Graph) -> set[str]:
    """Return the names of the blocks that occur only inside the package of an implicit inverse."""
    tried = {n.name for i in inverses(graph) for n in between(graph, i)}
    needed = {o.source.split(".")[0] for o in graph.outputs} | {n.name for n in graph.nodes} - tried
    new = needed
    while new:
        new = {a.split(".")[0] for a, b in wires(graph) if b.split(".")[0] in new} - needed
        needed = needed | new
    return tried - needed


def between(graph: Graph, inverse: Node) -> tuple[Node, ...]:
    """Return the blocks on which the input h of an implicit inverse depends, in the order of the graph.

    Raises
    ------
    InputError
        There are no such blocks, or a block is not static.
    """
    at = graph.nodes.index(inverse)
    found, new = (
        set(),
        {s for d, place, s, _, _ in graph.links if d == at and place == inverse.block.trial - 1 and s >= 0},
    )
    while new:
        found |= new
        new = {s for d, _, s, _, _ in graph.links if d in new and s >= 0} - found - {at}
    if not found:
        raise InputError(f"block {inverse.name!r}: its input h must be wired to a block that depends on its output u")
    graph.executor()  # raises an error that names a block that is not static
    return tuple(graph.nodes[k] for k in sorted(found))


def tried(graph: Graph, inverse: Node, within: str) -> Tried:
    """Return the Modelica package with the model that an implicit inverse inverts.

    The result also contains the expressions for the parameters of the block of the inverse. `within` is the name of the
    package that contains the new package.

    Raises
    ------
    InputError
        As in `between`. The error is also raised if the library has no function that computes one step of a block, or
        if the model has covariates as inputs.
    """
    nodes = between(graph, inverse)
    forms = [static_form(graph, n) for n in nodes]
    names = unique(dict.fromkeys(n.name for n in nodes), _WORDS)
    declared: list[str] = []
    stated: list[str] = []
    n_values, n_state = 0, 1  # the output is the first element of the state
    for f in forms:
        name = names[f.node.name]
        n_in = sum(f.node.sizes[v.name] for v in f.node.block.of("input"))
        x = [_source(graph, f.node, k, inverse, names) for k in range(n_in)]
        declared.append(f"Real {name}[{f.state0[1]}] {sentence(f.node.block.text)}")
        stated.append(f"{name} := {f.call(x, n_values, n_state)}")
        n_values += f.values[1]
        n_state += f.state0[1]
    output = _source(graph, inverse, inverse.block.trial - 1, inverse, names)
    stated.append(f"state_new := {_joined([f'{{{output}}}', *names.values()])}")
    package = package_of(inverse)
    values = _joined([f.values[0] for f in forms if f.values[1]] or ["{0}"])
    state0 = _joined(["{0}", *(f.state0[0] for f in forms)])  # the output before the first input is never used
    told = information(
        f"<b>Equation:</b> {', '.join(f'{n.name}: {n.type}' for n in nodes)}, wired as in the graph.",
        "<b>Source:</b> the equations of the blocks: see the ready block.",
        "<b>Limitations:</b> the sizes are fixed to the sizes of the model file.",
    )
    lines = [
        *("  extends HystFMU.Inverse.BaseClasses.StaticModel;", ""),
        '  redeclare function extends step "State of the model after a new input"',
        *("  protected", *(f"    {d};" for d in declared)),
        *("  algorithm", *(f"    {t};" for t in stated)),
        *(f"    annotation (Documentation(info = {told}));", "  end step;", ""),
    ]
    about = f"Blocks between output and trial input of {inverse.name}, as a static model"
    info = information("The implicit inverse tries candidates of its output on this model.")
    return Tried(package, values, state0, class_text(f"package {package}", about, lines, info, within))


def _joined(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"cat(1, {', '.join(parts)})"


def _source(graph: Graph, node: Node, place: int, inverse: Node, names: dict[str, str]) -> str:
    """Return the expression of the signal that drives element `place` of the inputs of a block."""
    at = graph.nodes.index(node)
    for d, first, s, from_place, n in graph.links:
        if d == at and first <= place < first + n:
            if s < 0:
                raise InputError(
                    f"The model of {inverse.name!r} must depend only on its own input in Modelica. Got {node.name!r}, "
                    "which has another input: export an FMU, or use the exact inverse."
                )
            source = graph.nodes[s]
            return "u" if source is inverse else f"{names[source.name]}[{from_place + place - first + 1}]"
    starts = [v.start for v in node.block.of("input") for _ in range(node.sizes[v.name])]
    return number(starts[place])
