"""A model ready to simulate: the block, driven by a decaying sine over the range of the identification data."""

from __future__ import annotations

from hystfmu.model import Model
from hystfmu.modelica.block import names
from hystfmu.modelica.layout import line, placed
from hystfmu.modelica.literals import number
from hystfmu.modelica.record import step

PERIODS, ROWS = 4, 100  # of the sine; rows of one


def example(model: Model, name: str, within: str, block_name: str, record_name: str) -> str:
    """The file of the example, without its mark.

    Parameters
    ----------
    model : Model
    name, within, block_name, record_name : str
        Name of the example, of its package, of the block and of the record there.
    """
    h = step(model)
    low, high = _range(model)
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
    lines += [f"  {block_name} tested annotation ({placed(10, 0)});", "equation"]
    ends, held = _inputs(model, {block_name, record_name})
    drawn = line((-39, 0), (-1, 0))  # from the right edge of the source to the left one of the block
    lines += [f"  connect(signal.r, tested.{end}) {drawn};" for end in ends]
    lines += [f"  tested.{end} = {number(value)};" for end, value in held.items()]
    time = f"StopTime = {number((PERIODS * ROWS + 0.5) * h)}, Interval = {number(h)}, Tolerance = 1e-10"
    return "\n".join(
        [
            *lines,
            f'  annotation (experiment({time}), Documentation(info = "<html>',
            "<p>Loops that shrink: an identified hysteresis shows what it remembers.</p>",
            f'<p><b>See also:</b> <a href=\\"modelica://{within}.{block_name}\\">{block_name}</a>.</p>',
            '</html>"));',
            f"end {name};\n",
        ]
    )


def _inputs(model: Model, taken: set[str]) -> tuple[list[str], dict[str, float]]:
    """Names of the scalar inputs of the block that the signal drives, and the covariates with their start values."""
    graph = model.graph
    ports, _ = names(graph, taken)
    sizes = {p.name: p.size for p in graph.ports if p.kind == "input"}
    driven: list[str] = []
    held: dict[str, float] = {}
    for i in graph.inputs:
        n = sizes[i.name]
        if i.name in model.provenance.get("span_covariates", {}):
            held[ports[i.name]] = i.start
        else:
            driven += [ports[i.name]] if n == 1 else [f"{ports[i.name]}[{k + 1}]" for k in range(n)]
    return driven, held


def _range(model: Model) -> tuple[float, float]:
    """Range of the input in the identification data; [-1, 1] if it is unknown."""
    span = model.provenance.get("span_u")
    if (
        isinstance(span, list)
        and len(span) == 2
        and all(isinstance(v, int | float) for v in span)
        and span[0] < span[1]
    ):
        return float(span[0]), float(span[1])
    return -1.0, 1.0
