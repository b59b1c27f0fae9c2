"""The model of an implicit inverse as Modelica: a package whose function steps the blocks between its ports u and h."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from hystfmu.core import IMPLICIT
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes, network
from hystfmu.modelica.literals import class_name, number, unique
from hystfmu.modelica.record import field

# what `step` of a package in HystFMU.Inverse.Models, or the text below, takes of a block, in this order
_VALUES = {
    "backlash_sum": "w0 r w",
    "bouc_wen": "A beta gamma n alpha k z0",
    "constraint_factor": "a0 d_max memory x0 a",
    "dead_zones": "w0 r w",
    "duhem": "k w_max du_max w0 a_rise b_rise c_rise a_fall b_fall c_fall",
    "krasnoselskii_pokrovskii": "a offset p1 p2 w",
    "mlp": "W1 b1 W2 b2",
    "play_bank": "r",
    "prandtl_ishlinskii": "w0 u0 r w",
    "preisach": "lo hi origin virgin E",
    "scaling": "gain offset lo hi",
    "sum": "offset k",
    "zhao_tan": "x0 memory",
}
_REST = {"prandtl_ishlinskii": "u0", "zhao_tan": "x0", "constraint_factor": "x0"}  # where the memory of extrema begins
_WORDS = ("u", "state", "values", "state_new")  # of the function
_INNER = {"mlp": "Hidden layer", "duhem": "State after the input"}  # values of a block that its output is made of
DUHEM_STEPS = 20  # the default of Operators.Sampled.Duhem


@dataclass(frozen=True)
class Tried:
    """What hangs on an implicit inverse.

    Attributes
    ----------
    nodes : tuple of Node
        Between u and h, in the order of evaluation.
    package : str
        Name of the package.
    values, start : str
        What the block of the inverse is given: expressions of the record ``values``.
    text : str
        The package, without the mark of its file.
    """

    nodes: tuple[Node, ...]
    package: str
    values: str
    start: str
    text: str


def inverses(graph: Graph) -> list[Node]:
    """The implicit inverses of a graph."""
    return [n for n in graph.nodes if n.block.flags & IMPLICIT]


def package_of(node: Node) -> str:
    """Name of the package of an implicit inverse."""
    return f"{class_name(node.name)}Model"


def wires(graph: Graph) -> list[tuple[str, str]]:
    """The wires without those into h of an implicit inverse: they are no connections, but what its package computes."""
    ends = {f"{n.name}.h" for n in inverses(graph)}
    return [(a, b) for a, b in graph.wires if b.split("[")[0] not in ends]


def hidden(graph: Graph) -> set[str]:
    """Blocks that only an implicit inverse needs: they stand in its package and nowhere else."""
    tried = {n.name for i in inverses(graph) for n in between(graph, i)}
    needed = {o.source.split(".")[0] for o in graph.outputs} | {n.name for n in graph.nodes} - tried
    new = needed
    while new:
        new = {a.split(".")[0] for a, b in wires(graph) if b.split(".")[0] in new} - needed
        needed = needed | new
    return tried - needed


def between(graph: Graph, inverse: Node) -> tuple[Node, ...]:
    """The blocks that the input h of an implicit inverse depends on.

    Raises
    ------
    InputError
        There are none, or one of them is not static.
    """
    at = graph.nodes.index(inverse)
    found, new = set(), {s for d, place, s, _, _ in graph.links if d == at and place == 1 and s >= 0}
    while new:
        found |= new
        new = {s for d, _, s, _, _ in graph.links if d in new and s >= 0} - found - {at}
    if not found:
        raise InputError(f"block {inverse.name!r}: nothing that hangs on its output u is wired to its input h")
    graph.executor()  # refuses what is not static, with the name of the block
    return tuple(graph.nodes[k] for k in sorted(found))


class _Pieces(NamedTuple):
    """Expressions of the record and how many numbers they are."""

    texts: list[str]
    sizes: list[int]


def tried(graph: Graph, inverse: Node, within: str) -> Tried:
    """The package of an implicit inverse, and what its block is given.

    Raises
    ------
    InputError
        As `between`; or the library has no static form of a block.
    """
    nodes = between(graph, inverse)
    inner = [f"{n.name}_inner" for n in nodes if n.type in _INNER]
    names = unique(dict.fromkeys([*(n.name for n in nodes), *inner]), _WORDS)
    values: list[str] = []
    start = ["{0}"]  # the output, which nothing reads before the first input
    locals_, lines, kept = [], [], []
    n_values, n_state = 0, 1
    for node in nodes:
        if node.type not in _VALUES:
            raise InputError(
                f"block {node.name!r}: the Modelica library HystFMU has no static form of {node.type!r} for the "
                f"implicit inverse {inverse.name!r}"
            )
        given = _values(graph, node)
        memory, size = _start(graph, node)
        slices = {}
        for key, n in zip(_VALUES[node.type].split(), given.sizes, strict=True):
            slices[key] = (n_values + 1, n_values + n)
            n_values += n
        name = names[node.name]
        state = f"state[{n_state + 1}:{n_state + size}]"
        x = [_source(graph, node, k, inverse, names) for k in range(sum(node.sizes[v.name] for v in node.block.of("input")))]
        n_out = sum(node.sizes[v.name] for v in node.block.of("output"))
        locals_.append(f'    Real {name}[{size or n_out}] "{node.block.text}";')
        z = names.get(f"{node.name}_inner", "")
        if node.type in _INNER and not classes.is_large(node):
            locals_.append(f'    Real {z}[{node.dims["n_hidden"] if node.type == "mlp" else 1}] "{_INNER[node.type]}";')
            lines.append(f"    {z} := {_inner(node, x, n_state, slices)};")
        lines.append(f"    {name} := {_call(node, x, z, state, slices)};")
        values += given.texts
        if size:
            n_state += size
            start += memory
            kept.append(name)
    at = graph.nodes.index(inverse)
    h = next((s, p) for d, place, s, p, _ in graph.links if d == at and place == 1)
    output = f"{names[graph.nodes[h[0]].name]}[{h[1] + 1}]"
    package = package_of(inverse)
    body = "\n".join(
        [
            f"within {within};",
            f'package {package} "What hangs on {inverse.name}, as a static model"',
            "  extends HystFMU.Inverse.BaseClasses.StaticModel;",
            "",
            '  redeclare function extends step "State of the model after a new input"',
            "  protected",
            *locals_,
            "  algorithm",
            *lines,
            f"    state_new := cat(1, {', '.join([f'{{{output}}}', *kept])});",
            '    annotation (Documentation(info = "<html>',
            f"<p><b>Equation:</b> {' then '.join(n.type for n in nodes)}, wired as in the graph.</p>",
            "<p><b>Source:</b> the equations of the blocks: see the ready block.</p>",
            "<p><b>Limitations:</b> the sizes are those of the model file.</p>",
            '</html>"));',
            "  end step;",
            "",
            '  annotation (Documentation(info = "<html><p>What the implicit inverse tries its output on.</p></html>"));',
            f"end {package};\n",
        ]
    )
    return Tried(nodes, package, _joined(values), _joined(start), body)


def _joined(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"cat(1, {', '.join(parts)})"


def _values(graph: Graph, node: Node) -> _Pieces:
    """Vectors of the record that a block takes."""
    texts, sizes = [], []
    for key in _VALUES[node.type].split():
        if node.type == "mlp" and classes.is_large(node):
            texts, sizes = [*texts], [*sizes, 0]  # constants of its function
            continue
        ref = f"values.{field(graph, node, key)}"
        rows = {v.name: v for v in node.block.parameters}
        if key in ("origin", "virgin"):
            text, size = _preisach(graph, node, key)
        elif rows[key].choices:
            text, size = f"{{{int(node.value(key)[0])}}}", 1
        elif node.type == "mlp" and key in ("W1", "W2"):
            count = node.dims["n_hidden" if key == "W1" else "n_out"]
            text, size = ", ".join(f"{ref}[{k + 1}, :]" for k in range(count)), node.value(key).size
        else:
            size = node.value(key).size
            text = f"{{{ref}}}" if rows[key].size == "1" else ref
        texts.append(text)
        sizes.append(size)
    return _Pieces(texts, sizes)


def _preisach(graph: Graph, node: Node, key: str) -> tuple[str, int]:
    """Where the first branch begins, and that branch, as in Operators.Sampled.Preisach."""

    def of(k: str) -> str:
        return f"values.{field(graph, node, k)}"

    word, n = classes.word(node, "start"), node.dims["n"]
    if key == "origin":
        middle = f"0.5*{of('lo')} + 0.5*{of('hi')}"
        return f"{{{of('lo') if word == 'low' else of('hi') if word == 'high' else middle}}}", 1
    if word == "demagnetised":
        return f"HystFMU.Functions.demagnetisedBranch({n}, {of('E')}, {of('offset')})", 2 * n + 1
    kind = classes.choices(node)["start"]
    return f"HystFMU.Functions.saturatedBranch({n}, {of('E')}, {of('offset')}, {kind})", 2 * n + 1


def _start(graph: Graph, node: Node) -> tuple[list[str], int]:
    """State of a block before the first input, output first, and its size; 0: a function."""

    def of(k: str) -> str:
        return f"values.{field(graph, node, k)}"

    if node.type in (*_REST, "preisach"):
        depth = classes.dims(node)["depth"]
        rest = _preisach(graph, node, "origin")[0] if node.type == "preisach" else f"{{{of(_REST[node.type])}}}"
        return ["{0, 0, 0}", rest, f"zeros({2 * depth})"], 4 + 2 * depth
    match node.type:
        case "backlash_sum":
            return ["{0}", of("z0")], 1 + node.dims["n"]
        case "play_bank":
            return [of("z0")], node.dims["n"]
        case "krasnoselskii_pokrovskii":
            return ["{0}", of("k0")], 1 + node.dims["n"]
        case "bouc_wen" | "duhem":
            return ["{0, 0, 0, 0}"], 4
    return [], 0


def _source(graph: Graph, node: Node, place: int, inverse: Node, names: dict[str, str]) -> str:
    """What feeds element `place` of the inputs of a block."""
    at = graph.nodes.index(node)
    for d, first, s, from_place, n in graph.links:
        if d == at and first <= place < first + n:
            source = graph.nodes[s]
            return "u" if source is inverse else f"{names[source.name]}[{from_place + place - first + 1}]"
    starts = [v.start for v in node.block.of("input") for _ in range(node.sizes[v.name])]
    return number(starts[place])


def _call(node: Node, x: list[str], z: str, state: str, at: dict[str, tuple[int, int]]) -> str:
    """State or outputs of a block after its inputs `x`; `z`: see `_inner`."""
    v = {k: f"values[{a}:{b}]" for k, (a, b) in at.items()}
    one = {k: f"values[{a}]" for k, (a, _) in at.items()}
    inputs = _vector(x)
    match node.type:
        case "play_bank":
            return f"HystFMU.Functions.play({x[0]}, {v['r']}, {state})"
        case "dead_zones":
            return f"{{{one['w0']}*{x[0]} + {v['w']}*HystFMU.Functions.deadZone({x[0]}, {v['r']})}}"
        case "sum":
            return f"{{{one['offset']} + {v['k']}*{inputs}}}"
        case "scaling":

            def element(key: str, i: int) -> str:
                return f"values[{at[key][0] + i}]"

            return "{" + ", ".join(
                f"min({element('hi', i)}, max({element('lo', i)}, {xi}))*{element('gain', i)} + {element('offset', i)}"
                for i, xi in enumerate(x)
            ) + "}"
        case "mlp" if classes.is_large(node):
            return f"{network.names(node)[0]}({inputs})"
        case "mlp":
            return f"{v['b2']} + {_products(at['W2'], z, node.dims['n_hidden'])}"
        case "duhem":
            return f"{{{one['k']}*{x[0]} + {z}[1], {z}[1], {x[0]}, 1}}"
    first, last = min(a for a, _ in at.values()), max(b for _, b in at.values())
    return f"HystFMU.Inverse.Models.{node.block.class_name}.step({x[0]}, {state}, values[{first}:{last}])"


def _inner(node: Node, x: list[str], before: int, at: dict[str, tuple[int, int]]) -> str:
    """What a block computes on the way to its output; its state stands after `before` other elements."""
    v = {k: f"values[{a}:{b}]" for k, (a, b) in at.items()}
    one = {k: f"values[{a}]" for k, (a, _) in at.items()}
    if node.type == "mlp":
        sums = f"{v['b1']} + {_products(at['W1'], _vector(x), len(x))}"
        return f"HystFMU.Functions.activation({sums}, {classes.choices(node)['activation']})"
    w, u, begun = (f"state[{before + k}]" for k in (2, 3, 4))
    rise, fall = (
        f"HystFMU.Functions.duhem({x[0]}, {u}, {w}, {v[f'a_{way}']}, {v[f'b_{way}']}, {v[f'c_{way}']}, "
        f"{node.dims['q']}, {one['w_max']}, {one['du_max']}, {DUHEM_STEPS})"
        for way in ("rise", "fall")
    )
    return f"{{if {begun} < 0.5 then {one['w0']} elseif {x[0]} >= {u} then {rise} else {fall}}}"


def _products(rows: tuple[int, int], x: str, n: int) -> str:
    """A matrix, of which the values hold one row after the other, times a vector."""
    return "{" + ", ".join(f"values[{a}:{a + n - 1}]*{x}" for a in range(rows[0], rows[1] + 1, n)) + "}"


def _vector(x: list[str]) -> str:
    """Expressions as a vector; elements of a vector that follow each other as a slice."""
    name = x[0].partition("[")[0]
    places = [e.partition("[")[2].rstrip("]") for e in x]
    if all(places) and [e.partition("[")[0] for e in x] == [name] * len(x):
        first = int(places[0])
        if [int(p) for p in places] == list(range(first, first + len(x))):
            return f"{name}[{first}:{first + len(x) - 1}]"
    return f"{{{', '.join(x)}}}"
