"""Model inside an implicit inverse, as a Modelica package with a function ``step``.

The function computes one step of the blocks on the path from the output u of the inverse to its input h.
"""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.classes import matrix_rows
from hystfmu.modelica.literals import class_name, number, sentence, unique
from hystfmu.modelica.record import field

# parameters of a block that `step` of a package in HystFMU.Inverse.Models, or the text below, needs, in this order
STATIC = {
    "backlash_sum": "w0 r w",
    "bouc_wen": "A beta gamma n alpha k",
    "coleman_hodgdon": "alpha b k",
    "constraint_factor": "a0 d_max memory x0 a",
    "dead_zones": "w0 r w",
    "duhem": "k w_max du_max a_rise b_rise c_rise a_fall b_fall c_fall",
    "jiles_atherton": "Ms a k c alpha steps",
    "krasnoselskii_pokrovskii": "a offset p1 p2 w",
    "mlp": "W1 b1 W2 b2",
    "play_bank": "r",
    "prandtl_ishlinskii": "w0 u0 r w",
    "preisach": "lo hi origin virgin E",
    "scaling": "gain offset lo hi",
    "sum": "offset k",
    "zhao_tan": "x0 memory",
}
_REST = {"prandtl_ishlinskii": "u0", "zhao_tan": "x0", "constraint_factor": "x0"}  # input at which the memory starts
_FIRST = {"bouc_wen": "z0", "duhem": "w0", "jiles_atherton": "m0"}  # parameter with the state at the input u0
_INNER = {"mlp": "Hidden layer", "duhem": "State after the input"}  # intermediate vector that gives the output


@dataclass(frozen=True)
class StaticForm:
    """A block of the inverted model, as Modelica expressions of its parameters, its state and its inputs.

    Attributes
    ----------
    node : Node
    values : dict of (str, int)
        Modelica vector and its number of elements, by the name of the parameter.
    state0 : tuple of str
        Modelica vectors of the initial state. The state begins with the outputs. The tuple is empty for a block without
        memory.
    size : int
        Number of elements of the state.
    """

    node: Node
    values: dict[str, tuple[str, int]]
    state0: tuple[str, ...]
    size: int

    @property
    def inner(self) -> bool:
        """True if the output of the block is computed from an intermediate vector, see `_inner`."""
        return self.node.type in _INNER and not classes.is_large(self.node)

    def lines(self, name: str, z: str, x: list[str], n_values: int, n_state: int) -> tuple[list[str], list[str]]:
        """Return the declarations and the statements of the block in the function ``step``.

        Parameters
        ----------
        name, z : str
            Name of the vector of outputs and state, and name of the intermediate vector.
        x : list of str
            Inputs of the block, one expression for each element.
        n_values, n_state : int
            Numbers of elements in the vectors ``values`` and ``state`` before the elements of this block.
        """
        node, at = self.node, {}
        for key, (_, n) in self.values.items():
            at[key] = (n_values + 1, n_values + n)
            n_values += n
        n_out = sum(node.sizes[v.name] for v in node.block.of("output"))
        declared = [f"Real {name}[{self.size or n_out}] {sentence(node.block.text)}"]
        stated = [f"{name} := {_call(node, x, z, f'state[{n_state + 1}:{n_state + self.size}]', at)}"]
        if self.inner:
            declared.append(f'Real {z}[{node.dims.get("n_hidden", 1)}] "{_INNER[node.type]}"')
            stated.insert(0, f"{z} := {_inner(node, x, n_state, at)}")
        return declared, stated


def static_form(graph: Graph, node: Node) -> StaticForm:
    """Return the Modelica expressions of a block of the inverted model.

    Raises
    ------
    InputError
        The library has no function that computes one step of the block.
    """
    if node.type not in STATIC:
        raise InputError(
            f"block {node.name!r}: the Modelica library HystFMU has no static form of {node.type!r} for an implicit "
            "inverse"
        )
    state0, size = _start(graph, node)
    return StaticForm(node, _values(graph, node), tuple(state0), size)


def _values(graph: Graph, node: Node) -> dict[str, tuple[str, int]]:
    if classes.is_large(node):
        return {}  # the weights of a large network are constants of its function
    found = {}
    rows = {v.name: v for v in node.block.parameters}
    for key in STATIC[node.type].split():
        ref = f"values.{field(graph, node, key)}"
        if key in ("origin", "virgin"):
            found[key] = _preisach(graph, node, key)
        elif key in ("a", "p1", "p2") and node.type == "krasnoselskii_pokrovskii":
            found[key] = _kernels(graph, node, key)
        elif key in node.dims:
            found[key] = f"{{{node.dims[key]}}}", 1
        elif rows[key].choices:
            found[key] = f"{{{int(node.value(key)[0])}}}", 1
        elif count := matrix_rows(rows[key]):
            found[key] = ", ".join(f"{ref}[{k + 1}, :]" for k in range(node.dims[count])), node.value(key).size
        else:
            found[key] = f"{{{ref}}}" if rows[key].size == "1" else ref, node.value(key).size
    return found


def _preisach(graph: Graph, node: Node, key: str) -> tuple[str, int]:
    """Return a Modelica vector of a Preisach operator, and its number of elements.

    The vector is the start input if `key` is "origin", otherwise the first branch. The expressions are those of
    Operators.Sampled.Preisach.
    """

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


def _kernels(graph: Graph, node: Node, key: str) -> tuple[str, int]:
    """Return the vector `key` of the kernels of a Krasnosel'skii-Pokrovskii operator, and its number of elements.

    The vector contains rise lengths, ramp positions or initial values, as in
    Operators.Sampled.KrasnoselskiiPokrovskii.
    """

    def of(k: str) -> str:
        return f"values.{field(graph, node, k)}"

    n = node.dims["n"]
    count, grid = n * (n + 1) // 2, f"{n}, {of('lo')}, {of('hi')}"
    if key == "a":
        return f"{{({of('hi')} - {of('lo')})/{n}}}", 1
    if key == "k0":
        return f"HystFMU.Functions.kernelStart({grid}, {of('u0')})", count
    return f"HystFMU.Functions.kernelGrid({grid}, {'false' if key == 'p1' else 'true'})", count


def _start(graph: Graph, node: Node) -> tuple[list[str], int]:
    """Return the vectors of the initial state of a block, and their number of elements; 0 for a block without memory.

    The initial state begins with the output of the block.
    """

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
            k0, n = _kernels(graph, node, "k0")
            return ["{0}", k0], 1 + n
        case "bouc_wen" | "duhem" | "jiles_atherton":
            return [f"{{0, {of(_FIRST[node.type])}, {of('u0')}}}"], 3
        case "coleman_hodgdon":
            return [f"{{0, {of('y0')} - {of('b')}*{of('u0')}, {of('u0')}}}"], 3
    return [], 0


def _call(node: Node, x: list[str], z: str, state: str, at: dict[str, tuple[int, int]]) -> str:
    """Return the expression of the new state of a block for its inputs `x`; without memory, of its outputs.

    `z` is the name of the intermediate vector, see `_inner`. `state` is the expression of the old state. `at` contains
    the first and the last index of each parameter in the vector ``values``.
    """
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
            keys = ("hi", "lo", "gain", "offset")
            rows = [[xi, *(f"values[{at[k][0] + i}]" for k in keys)] for i, xi in enumerate(x)]
            return "{" + ", ".join(f"min({hi}, max({lo}, {xi}))*{k} + {c}" for xi, hi, lo, k, c in rows) + "}"
        case "mlp" if classes.is_large(node):
            return f"{classes.network_names(node)[0]}({inputs})"
        case "mlp":
            return f"{v['b2']} + {_products(at['W2'], z, node.dims['n_hidden'])}"
        case "duhem":
            return f"{{{one['k']}*{x[0]} + {z}[1], {z}[1], {x[0]}}}"
    first, last = min(a for a, _ in at.values()), max(b for _, b in at.values())
    return f"HystFMU.Inverse.Models.{node.block.class_name}.step({x[0]}, {state}, values[{first}:{last}])"


def _inner(node: Node, x: list[str], before: int, at: dict[str, tuple[int, int]]) -> str:
    """Return the expression of the intermediate vector from which the output of a block is computed.

    In the vector ``state``, `before` elements precede the elements of this block.
    """
    v = {k: f"values[{a}:{b}]" for k, (a, b) in at.items()}
    one = {k: f"values[{a}]" for k, (a, _) in at.items()}
    if node.type == "mlp":
        sums = f"{v['b1']} + {_products(at['W1'], _vector(x), len(x))}"
        return f"HystFMU.Functions.activation({sums}, {classes.choices(node)['activation']})"
    w, u = (f"state[{before + k}]" for k in (2, 3))
    rise, fall = (
        f"HystFMU.Functions.duhem({x[0]}, {u}, {w}, {v[f'a_{way}']}, {v[f'b_{way}']}, {v[f'c_{way}']}, "
        f"{node.dims['q']}, {one['w_max']}, {one['du_max']})"
        for way in ("rise", "fall")
    )
    return f"{{if {x[0]} >= {u} then {rise} else {fall}}}"


def _products(rows: tuple[int, int], x: str, n: int) -> str:
    """Return the product of the vector `x` (n,) and the matrix that ``values`` stores row by row at `rows`."""
    return "{" + ", ".join(f"values[{a}:{a + n - 1}]*{x}" for a in range(rows[0], rows[1] + 1, n)) + "}"


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
    names = unique(
        dict.fromkeys([*(n.name for n in nodes), *(f"{f.node.name}_inner" for f in forms if f.inner)]), _WORDS
    )
    declared: list[str] = []
    stated: list[str] = []
    n_values, n_state = 0, 1  # the output is the first element of the state
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
    state0 = _joined(["{0}", *(v for f in forms for v in f.state0)])  # the output before the first input is never used
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
    """Return the expression of the signal that drives element `place` of the inputs of a block."""
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
