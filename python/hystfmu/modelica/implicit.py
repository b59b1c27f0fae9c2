"""Model inside an implicit inverse as Modelica: a package whose function steps the blocks from port u to port h."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.modelica.literals import class_name, number, unique
from hystfmu.modelica.static_form import static_form

_WORDS = ("u", "state", "values", "state_new")  # of the function


@dataclass(frozen=True)
class Tried:
    """The model that an implicit inverse inverts, as Modelica.

    Attributes
    ----------
    package : str
        Name of the package.
    values, state0 : str
        Modifiers of the block of the inverse, as expressions of the record ``values``.
    text : str
        File of the package, without its first line (the mark).
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
    """Return the wires, without wires into h of an implicit inverse, whose package computes these values."""
    ends = {f"{n.name}.{n.block.tried}" for n in inverses(graph)}
    return [(a, b) for a, b in graph.wires if b.split("[")[0] not in ends]


def hidden(graph: Graph) -> set[str]:
    """Return the blocks that only the package of an implicit inverse uses."""
    tried = {n.name for i in inverses(graph) for n in between(graph, i)}
    needed = {o.source.split(".")[0] for o in graph.outputs} | {n.name for n in graph.nodes} - tried
    new = needed
    while new:
        new = {a.split(".")[0] for a, b in wires(graph) if b.split(".")[0] in new} - needed
        needed = needed | new
    return tried - needed


def between(graph: Graph, inverse: Node) -> tuple[Node, ...]:
    """Return the blocks that the input h of an implicit inverse depends on.

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
    graph.executor()  # refuses what is not static, with the name of the block
    return tuple(graph.nodes[k] for k in sorted(found))


def tried(graph: Graph, inverse: Node, within: str) -> Tried:
    """Return the package of an implicit inverse, and the modifiers of its block.

    Raises
    ------
    InputError
        As in `between`. Also: the library has no static form of a block, or the model reads covariates.
    """
    nodes = between(graph, inverse)
    forms = [static_form(graph, n) for n in nodes]
    names = unique(
        dict.fromkeys([*(n.name for n in nodes), *(f"{f.node.name}_inner" for f in forms if f.inner)]), _WORDS
    )
    declared: list[str] = []
    stated: list[str] = []
    n_values, n_state = 0, 1  # the output stands first
    for f in forms:
        name, z = names[f.node.name], names.get(f"{f.node.name}_inner", "")
        n_in = sum(f.node.sizes[v.name] for v in f.node.block.of("input"))
        x = [_source(graph, f.node, k, inverse, names) for k in range(n_in)]
        more = f.lines(name, z, x, n_values, n_state)
        declared += more[0]
        stated += more[1]
        n_values += sum(n for _, n in f.values.values())
        n_state += f.size
    output = _source(graph, inverse, inverse.block.trial - 1, inverse, names)
    kept = [names[f.node.name] for f in forms if f.size]
    stated.append(f"state_new := {_joined([f'{{{output}}}', *kept])}")
    package = package_of(inverse)
    values = _joined([text for f in forms for text, _ in f.values.values()] or ["{0}"])
    state0 = _joined(["{0}", *(v for f in forms for v in f.state0)])  # the output before the first input is never read
    text = f"""within {within};
package {package} "Blocks between output and trial input of {inverse.name}, as a static model"
  extends HystFMU.Inverse.BaseClasses.StaticModel;

  redeclare function extends step "State of the model after a new input"
  protected
{"".join(f"    {d};{chr(10)}" for d in declared)}  algorithm
{"".join(f"    {t};{chr(10)}" for t in stated)}    annotation (Documentation(info = "<html>
<p><b>Equation:</b> {", ".join(f"{n.name}: {n.type}" for n in nodes)}, wired as in the graph.</p>
<p><b>Source:</b> the equations of the blocks: see the ready block.</p>
<p><b>Limitations:</b> the sizes are fixed to the sizes of the model file.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>The implicit inverse tries candidates of its output on this model.</p>
</html>"));
end {package};
"""
    return Tried(package, values, state0, text)


def _joined(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"cat(1, {', '.join(parts)})"


def _source(graph: Graph, node: Node, place: int, inverse: Node, names: dict[str, str]) -> str:
    """Return the source of element `place` of the inputs of a block."""
    at = graph.nodes.index(node)
    for d, first, s, from_place, n in graph.links:
        if d == at and first <= place < first + n:
            if s < 0:
                raise InputError(
                    f"The model of {inverse.name!r} must read its input alone in Modelica. Got {node.name!r}, which "
                    "reads another input: export an FMU, or take the exact inverse."
                )
            source = graph.nodes[s]
            return "u" if source is inverse else f"{names[source.name]}[{from_place + place - first + 1}]"
    starts = [v.start for v in node.block.of("input") for _ in range(node.sizes[v.name])]
    return number(starts[place])
