"""An identified model as Modelica: a package with a record of its values and a ready block that extends HystFMU.

Every block of the graph becomes a component of the library class with the same name; its numbers come from the record.
A sampled realisation acts at the model's own step, so the block gives what `hystfmu predict` gives, row by row.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from hystfmu.core import Array, Var
from hystfmu.errors import InputError
from hystfmu.files import write_text
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

DEPTH = 32  # extrema that an exported operator remembers: a step takes time in proportion; 32 nested loops are rare
MOST_PARAMETERS = 1000  # a larger network becomes a function: tools handle thousands of parameters one by one

# where the class of a block stands; those with a sample period have SAMPLED
_SAMPLED = {
    "Operators.Sampled": (
        "backlash_sum bouc_wen constraint_factor creep duhem krasnoselskii_pokrovskii play_bank prandtl_ishlinskii "
        "preisach zhao_tan"
    ),
    "Inverse.Sampled": (
        "constraint_factor_inverse prandtl_ishlinskii_inverse zhao_tan_inverse zhao_tan_inverse_reconstructed"
    ),
    "Dynamics": "delay differentiator",
    "Networks": "polynomial_narx",
}
_STATIC = {"Operators": "dead_zones", "Dynamics": "scaling sum", "Networks": "mlp"}
_ENUMERATIONS = {"activation": "Activation", "memory": "Memory"}
_STARTS = {"preisach": "Magnetisation", "creep": "Start"}
# keywords of the language, functions that it has built in, and names that an exported block uses itself
_WORDS = """
algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
impure in initial inner input loop model not operator or outer output package parameter partial protected public pure
record redeclare replaceable return stream then true type when while within
abs sign sqrt div mod rem ceil floor integer sin cos tan exp log delay sample pre edge change reinit smooth terminal cat
fill ones zeros identity min max sum product size time
u y values Ts
"""
_RESERVED = frozenset(_WORDS.split())
_ENDPOINT = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?\Z")


def _places(table: dict[str, str]) -> dict[str, str]:
    return {key: package for package, keys in table.items() for key in keys.split()}


def number(x: float) -> str:
    """A Real literal that reads back as the same double."""
    return repr(float(x))


def array(values: Array) -> str:
    """A vector or a matrix as a Modelica constructor."""
    if values.ndim == 2:
        return "[" + "; ".join(", ".join(number(x) for x in row) for row in values) + "]"
    return "{" + ", ".join(number(x) for x in values) + "}"


def identifier(name: str) -> str:
    """A name of a component that Modelica takes and that is none of the block's own."""
    return f"{name}_" if name in _RESERVED else name


def class_name(text: str) -> str:
    """A package name out of a file name: ``backlash_identified`` becomes ``BacklashIdentified``."""
    name = "".join(w[:1].upper() + w[1:] for w in re.split(r"[^A-Za-z0-9]+", text) if w)
    return name if name[:1].isalpha() else f"Model{name}"


def _values(node: Node) -> dict[str, tuple[Var, Array]]:
    """The numeric parameters of a node that a class takes, matrices in their shape."""
    found = {}
    for v in node.block.parameters:
        value = node.value(v.name)
        if v.choices or (node.type, v.name) == ("transfer_function", "hold"):
            continue
        if node.type == "mlp" and v.name in ("W1", "W2"):
            value = value.reshape(node.dims["n_hidden" if v.name == "W1" else "n_out"], -1)
        found[v.name] = (v, value)
    return found


def _is_large(node: Node) -> bool:
    return node.type == "mlp" and sum(v.size for _, v in _values(node).values()) > MOST_PARAMETERS


def _dims(node: Node) -> dict[str, int]:
    return {k: min(n, DEPTH) if k == "depth" else n for k, n in node.dims.items()}


def _component(text: str, value: Array, v: Var) -> str:
    size = "" if v.size == "1" else "[" + ", ".join(map(str, value.shape)) + "]"
    shown = number(value[0]) if v.size == "1" else array(value)
    return f'  parameter Real {text}{size} = {shown} "{_words(v.text)}";'


def _words(text: str) -> str:
    return text.replace("\\", "").replace('"', "'").replace("\n", " ")


def _html(text: str) -> str:
    return _words(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def record(model: Model, name: str, within: str, source: str) -> str:
    """The record of a model's values: ``<block>_<parameter>`` for each block of the graph.

    Parameters
    ----------
    model : Model
    name, within : str
        Name of the record and of the package it stands in.
    source : str
        Where the values come from, for the reader.
    """
    lines = []
    for node in model.graph.nodes:
        prefix = identifier(node.name).rstrip("_")
        if node.type == "transfer_function":
            matrices = discrete(node, model.step or 1.0)
            lines += [
                f"  parameter Real {prefix}_{key}{list(v.shape) if v.ndim else ''} = "
                f'{array(v) if v.ndim else number(float(v))} "{text}";'
                for key, (v, text) in matrices.items()
            ]
            continue
        if _is_large(node):
            continue
        lines += [f'  parameter Integer {prefix}_{k} = {n} "Size of {node.name}";' for k, n in _dims(node).items()]
        lines += [_component(f"{prefix}_{key}", value, v) for key, (v, value) in _values(node).items()]
    body = "\n".join(lines)
    return f"""// generated from {source} - do not edit
within {within};
record {name} "{_words(model.text) or model.key}"
{body}
  annotation (
    Icon(graphics = {{Rectangle(extent = {{{{-100, -60}}, {{100, 60}}}}, fillColor = {{255, 215, 136}},
      fillPattern = FillPattern.Solid)}}),
    Documentation(info = "<html>
<p>Values of the model <em>{_html(model.key)}</em>: {_html(model.text)}</p>
<p><b>Source:</b> {_html(source)}: fit, data and options stand there.</p>
<p><b>Limitation:</b> valid within the range of the identification data.</p>
</html>"));
end {name};
"""


def discrete(node: Node, h: float) -> dict[str, tuple[Array, str]]:
    """A transfer function discretised for the step h (s): x+ = A x + b_new u + b_old u_last, y = c x + d u.

    The input is held at its new value (zoh) or runs straight from the last one (foh) over the step, as in the unit.
    """
    from scipy.linalg import expm

    a, b = node.value("a"), node.value("b")
    n = len(a) - 1
    full = np.concatenate([np.zeros(n + 1 - len(b)), b]) / a[0]
    alpha = a[1:] / a[0]
    # controllable canonical form in the time scale of its slowest coefficient, which keeps the numbers near 1
    sigma = abs(alpha[-1]) ** (1 / n) if alpha[-1] != 0 else 1.0
    weights = sigma ** np.arange(1, n + 1)
    A = np.eye(n, k=1)
    A[-1] = -(alpha / weights)[::-1]
    c = ((full[1:] - full[0] * alpha) / weights)[::-1]
    block = np.zeros((n + 2, n + 2))
    block[:n, :n], block[n - 1, n], block[n, n + 1] = A * sigma * h, sigma * h, 1.0
    E = expm(block)
    linear = node.value("hold")[0] == 1
    old = E[:n, n] - E[:n, n + 1] if linear else np.zeros(n)
    return {
        "A": (E[:n, :n], "State of the last step"),
        "b_new": (E[:n, n] - old, "New input"),
        "b_old": (old, "Input before it"),
        "c": (c, "Output row"),
        "d": (np.array(full[0]), "Direct term"),
        "x_steady": (
            np.concatenate([[1 / (alpha / weights)[-1]], np.zeros(n - 1)])
            if alpha[-1] != 0 and node.value("start")[0] == 1
            else np.zeros(n),
            "State at the first input of 1",
        ),
    }


def block(model: Model, name: str, record_name: str) -> str:
    """The ready block: components of the library wired as the graph, with the values of the record.

    Raises
    ------
    InputError
        A block of the graph has no class in the library.
    """
    graph = model.graph
    lines, equations = [], []
    for node in graph.nodes:
        lines.append(_declaration(node))
    for i, port in enumerate(graph.inputs):
        shape = _shape(graph, port.to[0])
        lines.insert(i, f'  HystFMU.Interfaces.RealInput {port.name}{shape} "{_words(port.text) or "Input"}";')
        equations += [f"  connect({port.name}, {_end(graph, b)});" for b in port.to]
    for i, out in enumerate(graph.outputs):
        shape = _shape(graph, out.source)
        lines.insert(
            len(graph.inputs) + i,
            f'  HystFMU.Interfaces.RealOutput {out.name}{shape} "{_words(out.text) or "Output"}";',
        )
        equations.append(f"  connect({_end(graph, out.source)}, {out.name});")
    for a, b in graph.wires:
        left, right = _end(graph, a), _end(graph, b)
        equations.append(f"  connect({left}, {right});")
    equations += _unconnected(graph)
    return f"""within {name};
block Model "{_words(model.text) or model.key}"
  extends HystFMU.Icons.Hysteresis;
  extends HystFMU.Interfaces.Sampled(Ts = {number(model.step or 1.0)});
  parameter {record_name} values "Values of the model";
{chr(10).join(lines)}
equation
{chr(10).join(equations)}
  annotation (Documentation(info = "<html>
<p>Gives at 0, Ts, 2 Ts, ... what <code>hystfmu predict</code> gives row by row, for rows Ts apart.</p>
<p><b>Limitations:</b> sampled; Ts is that of the identification, and dynamics in the model are discretised for it.</p>
</html>"));
end Model;
"""


def _declaration(node: Node) -> str:
    name, prefix = identifier(node.name), identifier(node.name).rstrip("_")
    if node.type == "transfer_function":
        keys = ("A", "b_new", "b_old", "c", "d", "x_steady")
        values = [f"{k} = values.{prefix}_{k}" for k in keys]
        return f"  HystFMU.Dynamics.StateSpace {name}(n = {node.dims['na']}, {', '.join(values)}, Ts = Ts);"
    if _is_large(node):
        return f"  {class_name(node.name)} {name};"
    sampled, static = _places(_SAMPLED), _places(_STATIC)
    if node.type not in sampled and node.type not in static:
        raise InputError(f"the library HystFMU has no class for the block {node.type!r} ({node.name})")
    if node.type == "polynomial_narx" and node.dims["q"] > 3:
        raise InputError(
            f"the Modelica class of polynomial_narx takes degrees up to 3; {node.name} has q = {node.dims['q']}"
        )
    values = [f"{k} = values.{prefix}_{k}" for k in [*_dims(node), *_values(node)]]
    for v in node.block.parameters:
        if v.choices:
            kind = _ENUMERATIONS.get(v.name) or _STARTS[node.type]
            values.append(f"{v.name} = HystFMU.Types.{kind}.{v.choices[int(node.value(v.name)[0])]}")
    if node.type in sampled:
        values.append("Ts = Ts")
    package = sampled.get(node.type) or static[node.type]
    return f"  HystFMU.{package}.{node.block.class_name} {name}({', '.join(values)});"


def _row(graph: Graph, endpoint: str) -> tuple[Node, Var, str | None]:
    m = _ENDPOINT.match(endpoint)
    assert m is not None  # the graph has resolved it
    node = graph.node(m[1])
    return node, next(v for v in node.block.of("input", "output") if v.name == m[2]), m[3]


def _end(graph: Graph, endpoint: str) -> str:
    """An end of a wire; a vector of one element is joined by that element, since the other end may be a scalar."""
    node, v, index = _row(graph, endpoint)
    size = node.sizes[v.name]
    if index is None and v.size != "1" and size == 1:
        index = "1"
    return f"{identifier(node.name)}.{v.name}" + (f"[{index}]" if index and v.size != "1" else "")


def _shape(graph: Graph, endpoint: str) -> str:
    node, v, index = _row(graph, endpoint)
    size = node.sizes[v.name]
    return f"[{size}]" if index is None and size > 1 else ""


def _unconnected(graph: Graph) -> list[str]:
    """Inputs of blocks that nothing is wired to keep their start value."""
    driven = {b for _, b in graph.wires} | {b for p in graph.inputs for b in p.to}
    found = []
    for node in graph.nodes:
        for v in node.block.of("input"):
            if f"{node.name}.{v.name}" in driven:
                continue
            ends = [f"{v.name}[{k + 1}]" for k in range(node.sizes[v.name])]
            for end in ends:
                if f"{node.name}.{end}" not in driven:
                    left = f"{identifier(node.name)}.{v.name if v.size == '1' else end}"
                    found.append(f"  {left} = {number(v.start)};")
    return found


def network(node: Node, package: str) -> dict[str, str]:
    """A network of many weights: a vector function that holds them, and the block that calls it; by class name."""
    values = {k: v for k, (_, v) in _values(node).items()}
    n_in, n_hidden, n_out = (node.dims[k] for k in ("n_in", "n_hidden", "n_out"))
    kind = node.block.parameters[[v.name for v in node.block.parameters].index("activation")]
    word = kind.choices[int(node.value("activation")[0])]
    name = class_name(node.name)
    constants = "\n".join(
        f"  constant Real {k}[{', '.join(map(str, v.shape))}] = {array(v)};" for k, v in values.items()
    )
    function = f"{node.name}Output"
    note = f"Weights of the network {node.name}: {n_in} inputs, {n_hidden} hidden neurons, {n_out} outputs"
    return {
        function: f"""within {package};
function {function} "{note}"
  extends HystFMU.Icons.Function;
  input Real u[{n_in}] "Inputs";
  output Real y[{n_out}] "Outputs";
protected
{constants}
algorithm
  y := b2 + W2*HystFMU.Functions.activation(b1 + W1*u, HystFMU.Types.Activation.{word});
  annotation (Documentation(info = "<html><p>{note}.</p></html>"));
end {function};
""",
        name: f"""within {package};
block {name} "{note}"
  extends HystFMU.Icons.Block;
  HystFMU.Interfaces.RealInput u[{n_in}] "Inputs";
  HystFMU.Interfaces.RealOutput y[{n_out}] "Outputs";
equation
  y = {function}(u);
  annotation (Documentation(info = "<html><p>{note}.</p></html>"));
end {name};
""",
    }


def export_modelica(model: Model, folder: str | Path, name: str, source: str) -> Path:
    """Write the package ``folder/name``: a record, a ready block, and a function for each large network.

    Parameters
    ----------
    model : Model
    folder : str or Path
        Folder of the library path; it is made if it does not exist.
    name : str
        Any text; the package has the name that `class_name` makes of it.
    source : str
        Where the model comes from, for the documentation.

    Returns
    -------
    Path
        The folder of the package.

    Raises
    ------
    InputError
        The library has no class for a block, or a file cannot be written.
    """
    package = class_name(name)
    written = {
        "Values": record(model, "Values", package, source),
        "Model": block(model, package, "Values"),
    }
    for node in model.graph.nodes:
        if _is_large(node):
            written |= network(node, package)
    written["package"] = f"""package {package} "{_words(model.text) or model.key}"
  extends HystFMU.Icons.Package;
  annotation (
    uses(HystFMU(version = "0.1.0")),
    Documentation(info = "<html>
<p>The model <em>{_html(model.key)}</em> from {_html(source)}: the record Values and the ready block Model.</p>
</html>"));
end {package};
"""
    target = Path(folder) / package
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise InputError(f"{target}: cannot be made: {e.strerror}") from None
    for key, text in written.items():
        write_text(target / f"{key}.mo", text)
    order = [k for k in written if k != "package"]
    write_text(target / "package.order", "\n".join(order) + "\n")
    return target
