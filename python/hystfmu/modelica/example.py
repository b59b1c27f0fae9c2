"""Example model of a package. A decaying sine over the range of the identification data drives the block."""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.model import Model
from hystfmu.modelica.layout import line, placed
from hystfmu.modelica.literals import number
from hystfmu.modelica.measures import per_second, si, to_si
from hystfmu.modelica.ports import rate_name
from hystfmu.modelica.record import span, step
from hystfmu.modelica.wiring import Wiring

PERIODS, ROWS = 4, 100  # periods of the sine, and rows of one period


def example(model: Model, name: str, within: str, block_name: str, w: Wiring, rated: Sequence[str]) -> str:
    """Return the text of the Modelica file of the example, without its first line (the mark of an exported file).

    Parameters
    ----------
    model : Model
    name, within, block_name : str
        Names of the example, of its package, and of the block in this package.
    w : Wiring
        Wiring of the graph of the model.
    rated : sequence of str
        Names of the inputs of the graph whose rates other realisations need.
    """
    h = step(model)
    driven, held = _inputs(model, w)
    low, high = (_at_port(model, driven, x) for x in span(model) or (-1.0, 1.0))
    frequency = 1 / (ROWS * h)
    signal = ", ".join(
        f"{k} = {number(v)}"
        for k, v in {
            "amplitude": (high - low) / 2,
            "offset": (high + low) / 2,
            "frequency": frequency,
            "decay": frequency / 2,
        }.items()
    )
    lines = [
        f"within {within};",
        f'model {name} "The model on a decaying sine over the range of its data"',
        "  extends HystFMU.Icons.Example;",
    ]
    if model.graph.inputs:
        lines.append(f"  HystFMU.Sources.DecayingSine signal({signal}) annotation ({placed(-50, 0)});")
    if rated:
        lines.append(
            f'  replaceable {block_name} tested constrainedby Ports "Any realisation by redeclare" '
            f"annotation (choicesAllMatching = true, {placed(10, 0)});"
        )
    else:
        lines.append(f"  {block_name} tested annotation ({placed(10, 0)});")
    declared, stated = _rates(model, w, rated)
    lines += [*declared, "equation", *stated]
    drawn = line((-39, 0), (-1, 0))  # from the right edge of the source to the left one of the block
    lines += [f"  connect(signal.r, tested.{end}) {drawn};" for end in driven]
    lines += [f"  tested.{end} = {number(value)};" for end, value in held.items()]
    time = f"StopTime = {number((PERIODS * ROWS + 0.5) * h)}, Interval = {number(h)}, Tolerance = 1e-10"
    return "\n".join(
        [
            *lines,
            f'  annotation (experiment({time}), Documentation(info = "<html>',
            "<p>The loops become smaller, so that the memory of the identified hysteresis is visible.</p>",
            f'<p><b>See also:</b> <a href=\\"modelica://{within}.{block_name}\\">{block_name}</a>.</p>',
            '</html>"));',
            f"end {name};\n",
        ]
    )


def _inputs(model: Model, w: Wiring) -> tuple[list[str], dict[str, float]]:
    """Return the names of the inputs that the signal drives, and the covariates with their start values."""
    graph = model.graph
    sizes = {p.name: p.size for p in graph.ports if p.kind == "input"}
    driven: list[str] = []
    held: dict[str, float] = {}
    for i in graph.inputs:
        n, port = sizes[i.name], w.ports[i.name]
        if i.name in model.provenance.get("span_covariates", {}):
            held[port] = to_si(i.start, i.unit)
        else:
            driven += [port] if n == 1 else [f"{port}[{k + 1}]" for k in range(n)]
    return driven, held


def _at_port(model: Model, driven: list[str], value: float) -> float:
    """Convert a value from the unit of measure of the data to the unit of the ports."""
    return to_si(value, model.graph.inputs[0].unit) if driven else value


def _rates(model: Model, w: Wiring, rated: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return declarations and equations that connect the time derivative of the signal to the inputs `rated`."""
    declared: list[str] = []
    stated: list[str] = []
    for k, port in enumerate(rated):
        unit = si(next(p.unit for p in model.graph.inputs if p.name == port))[0]
        to = f"tested.{rate_name(w.ports[port])}"
        if port in model.provenance.get("span_covariates", {}):
            stated.append(f"  {to} = 0;")
            continue
        if not unit:
            stated.append(f"  connect(signal.dr_lead, {to}) {line((-39, -4), (-1, -9))};")
            continue
        one, rate = (f"{n}{k + 1}" if k else n for n in ("one", "rate"))
        declared += [
            f'  constant Real {one}(unit = "{unit}") = 1 "Unit of measure of the signal";',
            f'  HystFMU.Interfaces.RealOutput {rate}(unit = "{per_second(unit)}") "Rate of the signal" '
            f"annotation ({placed(-20, -40 - 30 * k)});",
        ]
        drawn = line((-20, -40 - 30 * k), (-1, -9))
        stated += [f"  {rate} = {one}*signal.dr_lead;", f"  connect({rate}, {to}) {drawn};"]
    return ["protected", *declared] if declared else [], stated
