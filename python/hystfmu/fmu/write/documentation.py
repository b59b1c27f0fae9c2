"""Writer of documentation/index.html of an FMU, from the graph, the C tables and the provenance of the model.

The page contains the equations and their sources, the parameters, the errors of the fit, the meaning of a step, a
method to check the import, and the licence.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from hystfmu.base import __version__, escape
from hystfmu.fmu.write.description import Fmi
from hystfmu.fmu.write.reference import FOLDER, Reference
from hystfmu.graph import Graph, Port
from hystfmu.graph.graph import sample_time
from hystfmu.model import Model
from hystfmu.model.explored import HUGE
from hystfmu.report.explorer import Explorer
from hystfmu.report.page import Section, hero, page, section
from hystfmu.report.plot import Line, Plot

EXPLORED = "The model of this FMU runs in this page. Grey: one rise and fall of its input."
_MOST_VALUES = 6  # maximum number of values of an array in the table; modelDescription.xml contains all values
_AHEAD: dict[Fmi, str] = {
    2: "or set those of t and their derivatives (<code>fmi2SetRealInputDerivatives</code>), which hold for one step.",
    3: "or name them in <code>requiredIntermediateVariables</code> and set them in the callback of the step.",
}
_FIT = {
    "rms_percent": "RMS error, % of the span of y",
    "max_percent": "largest error, % of the span of y",
    "rms": "RMS error, unit of measure of y",
    "max": "largest error, unit of measure of y",
    "parameters": "identified parameters",
}
_HISTORY = {
    "data": "data",
    "sha256": "SHA-256 of the data",
    "rows": "rows",
    "train": "fitted rows",
    "span_u": "range of the input",
    "trained_u": "range of the input in the fitted rows",
    "span_y": "range of the output",
    "seed": "seed",
    "options": "options",
    "versions": "versions",
}


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as HTML. The cells must already be HTML."""
    top = "".join(f'<th scope="col">{h}</th>' for h in head)
    body = "".join("<tr>" + "".join(f"<td>{c}</td>" for c in row) + "</tr>\n" for row in rows)
    return f'<div class="wide"><table><tr>{top}</tr>\n{body}</table></div>\n'


def _text(value: Any) -> str:
    """Return a value from a model file as HTML."""
    if isinstance(value, float):
        return f"{value:.6g}" if abs(value) < HUGE else "no limit"
    if isinstance(value, dict):
        return ", ".join(f"{escape(str(k))} {_text(v)}" for k, v in value.items())
    if isinstance(value, list | tuple):
        more = f" ... ({len(value)} values)" if len(value) > _MOST_VALUES else ""
        return " ".join(_text(v) for v in value[:_MOST_VALUES]) + more
    return escape(str(value))


def _variable(graph: Graph, p: Port, fmi: Fmi) -> tuple[str, ...]:
    name = p.name if p.size == 1 else f"{p.name}_1 ... {p.name}_{p.size}" if fmi == 2 else f"{p.name}[{p.size}]"
    start = p.var.choices[int(p.start[0])] if p.var.choices else _text(p.start)
    kind = {"param": "parameter, tunable", "fixed": "parameter, fixed"}.get(p.kind, p.kind)
    block = graph.nodes[p.node].name if len(graph.nodes) > 1 and p.is_parameter else ""
    shown = "" if p.kind == "output" else start
    cells = (name, kind, p.unit or "-", shown, p.var.interval, p.text, block)
    return tuple(f"<code>{escape(name)}</code>" if k == 0 else escape(c) for k, c in enumerate(cells))


def _picture(reference: Reference) -> str:
    graph = reference.graph
    outputs = [p for p in graph.ports if p.kind == "output"]
    inputs = [p for p in graph.ports if p.kind == "input"]
    if not outputs:
        return ""

    def label(p: Port) -> str:
        return f"{p.scalar_names[0]} ({p.unit})" if p.unit else p.scalar_names[0]

    x, y = reference.curve
    x_label = label(inputs[0]) if inputs else "t (s)"
    return hero(Plot("reference experiment (see below)", x_label, label(outputs[0]), [Line(outputs[0].name, x, y)]))


def history(model: Model | None) -> str:
    """Return the errors of the fit and the provenance of a model as an HTML table."""
    if model is None or not (model.fit or model.provenance):
        return "<p>The values were set by hand, without identification.</p>\n"
    fit = [(title, _text(model.fit[key])) for key, title in _FIT.items() if key in model.fit]
    rest = [(title, _text(model.provenance[key])) for key, title in _HISTORY.items() if key in model.provenance]
    step = [("sample step (s)", _text(model.step))] if model.step else []
    return _table(["quantity", "value"], [*fit, *step, *rest])


def _equations(graph: Graph) -> str:
    rows = [
        (
            f"<code>{escape(n.name)}</code>",
            f"<code>{escape(n.type)}</code>: {escape(n.block.text)}",
            escape(n.block.equation),
            escape(n.block.source),
        )
        for n in graph.nodes
    ]
    wires = [f"<code>{escape(a)}</code> &rarr; <code>{escape(b)}</code>" for a, b in graph.wires]
    wires += [f"<code>{escape(i.name)}</code> &rarr; <code>{escape(b)}</code>" for i in graph.inputs for b in i.to]
    wires += [f"<code>{escape(o.source)}</code> &rarr; <code>{escape(o.name)}</code>" for o in graph.outputs]
    head = ["block", "description", "equation", "source"]
    return f"{_table(head, rows)}<p>The blocks are evaluated in this order. Connections: {'; '.join(wires)}.</p>\n"


def _dependencies(graph: Graph) -> str:
    lines = []
    for name, inputs in graph.dependencies().items():
        names = ", ".join(f"<code>{escape(i)}</code>" for i in inputs)
        lines.append(f"<code>{escape(name)}</code> depends directly on {names or 'no input'}.")
    return " ".join(lines)


def _step_sizes(graph: Graph) -> str:
    sample = sample_time(graph)
    if sample is None:
        if any(n.block.tolerance == "integration" and n.block.rate == "continuous" for n in graph.nodes):
            return (
                "An oscillator is integrated in parts of at most half a radian of its oscillation. Its error grows "
                "with the square of their length; it was at most 3 % of the span in tests."
            )
        return "Linear parts are discretised exactly for the current step size."
    return (
        f"The model is made for its sample time, {sample:g} s: a communication step of n sample times has the values "
        "of n steps with the same input, and one that is no multiple of the sample time is an error."
    )


def documentation(
    graph: Graph,
    fmi: Fmi,
    name: str,
    text: str,
    reference: Reference,
    model: Model | None = None,
    source: bool = False,
    explorer: Explorer | None = None,
) -> bytes:
    """Return the documentation page of an FMU as HTML in UTF-8.

    `name` and `text` are the same as in modelDescription.xml. The page shows the `explorer` of the model or, without
    an explorer, a plot of the reference experiment. It also shows the errors of the fit and the provenance of the
    `model`. `source` states whether the archive contains source files.
    """
    variables = _table(
        ["variable", "kind", "unit", "start", "legal values", "meaning", "block"],
        (_variable(graph, p, fmi) for p in graph.ports),
    )
    sources = "<li><code>sources</code>: one C99 file that contains the data as constants.</li>" if source else ""
    body = f"""<h1>{escape(name)}</h1>
<p>{escape((model.text if model else "") or text)}</p>
{_picture(reference) if explorer is None else section(Section("", EXPLORED, explorer=explorer))}
<p class="lead">FMI {fmi}.0, written by HystFMU {__version__}, token <code>{graph.token}</code>.</p>
<h2>Variables</h2>
{variables}<h2>Equations</h2>
{_equations(graph)}<h2>Provenance of the values</h2>
{history(model)}<h2>Meaning of a step</h2>
<p>After a step from t to t + h the outputs are those at t + h for the inputs held at the end of the step: static
operators with memory have direct feed-through. So set the inputs of t + h, then step; {_AHEAD[fmi]} An importer that
knows them at t only is one step late. {_dependencies(graph)} The memory advances in steps only; set and get
have no side effects. {_step_sizes(graph)} An input that is not finite is
refused with one warning, and the memory keeps its value.</p>
<h2>Check the import</h2>
<ul><li><code>{FOLDER}</code>: stimulus and recorded outputs; step {reference.h:g} s, {len(reference.y)} rows.
The inputs of a row are set at its time, before the step to the next row. The binary does not use the
mathematics library of the platform, so all recorded digits are reproduced; the outputs of source blocks also depend on
the rounding of the time.</li>
<li><code>resources/block.bin</code>: blocks, wiring, values; the binary is the same for all models.</li>{sources}</ul>
<h2>Licence</h2>
<p>The binary and the sources are HystFMU, BSD-3-Clause: <a href="licenses/license.txt">licenses/license.txt</a>. They
need only the C library; the sources also need the headers of the FMI standard. The values of the model belong to its
author.</p>
"""
    return page(name, [body]).encode()
