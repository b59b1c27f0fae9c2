"""A fitted model as a loop sees it: hysteresis with its inverse, linear dynamics behind it, and devices that differ."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.data.reversals import reversals
from hystfmu.design.sector import static_gain
from hystfmu.face.model import Model
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.inverse.dynamic import Parts, feedforward, split
from hystfmu.inverse.input_range import at_start, over_range
from hystfmu.model.inputs import beside

GAIN, FREQUENCY = 0.2, 0.2  # by which a device may differ from its model
COMPUTING = 1  # steps between a sample and its command
PERIODS = 4  # of the reference in a run
SAMPLES = 100  # steps of the loop in a period of the references, at least
LONGEST = 20_000  # and at most
DYNAMICS = "transfer_function"


@dataclass(frozen=True)
class Device:
    """A fitted model and its parts.

    Attributes
    ----------
    model : Model
        The whole, behind a held command.
    inverse : Model
        Inverse of the model with its dynamics at rest.
    ahead : Graph or None
        Feed-forward of the dynamics; None if there are none.
    lag_steps : int
        Steps by which the output follows the wanted one behind feed-forward and inverse.
    dynamics : tuple of Node
        Transfer functions behind the hysteresis.
    delay : int
        Steps of delay behind it.
    h : float
        Step (s).
    frequency : float
        Of references (Hz): that of the record, as far as the step allows.
    low, high, rest : float
        Least and largest output that the range of the input both passes through and keeps for the time of a run (creep
        may take back what a quick sweep reaches), and output before the first step, in its unit of measure.
    falling : bool
        Whether the output falls where the input rises, such as of a stack that contracts.
    """

    model: Model
    inverse: Model
    ahead: Graph | None
    lag_steps: int
    dynamics: tuple[Node, ...]
    delay: int
    h: float
    frequency: float
    low: float
    high: float
    rest: float
    falling: bool


def device(model: Model, data: Dataset) -> Device:
    """Cut a model into what a loop needs.

    Parameters
    ----------
    model : Model
        Fitted to `data`.
    data : Dataset
        Its input states how fast references may be.

    Raises
    ------
    InputError
        The model takes further inputs, has dynamics within its hysteresis, or no inverse, or its output does not last.
    """
    if fault := unsuited(model):
        raise InputError(f"{data.path or data.name}: {fault}")
    model = behind_hold(model)
    parts = _parts(model)
    dynamics = tuple(n for n in parts.tail if n.type == DYNAMICS)
    lag_steps, taps = feedforward(parts, data.h) if dynamics else (0, None)
    frequency = reference_frequency(data)
    low, high, falling = reach(model, math.ceil(PERIODS / (frequency * data.h)))
    if not high > low:
        raise InputError(
            f"{data.path or data.name}: A loop is made for an output that lasts. {model.key} loses it all."
        )
    return Device(
        model,
        _at_rest(model, parts).inverse(),
        None if taps is None else _filter(taps, at_start(model)),
        lag_steps + parts.delay,
        dynamics,
        parts.delay,
        data.h,
        frequency,
        low,
        high,
        at_start(model),
        falling,
    )


def behind_hold(model: Model) -> Model:
    """Return a model for a command that a converter holds for a step: its dynamics see jumps, not ramps.

    A fit takes its rows as samples of a smooth input, and its dynamics ramp up to each of them.  Trap: a held command
    acts half a step earlier, so a loop tuned and timed on ramps missed its device by 0.3 % of the stroke at 100 steps a
    period, and stated 1e-4 %.

    Parameters
    ----------
    model : Model
        Of any kind; without dynamics behind the hysteresis it is returned as it is.
    """
    first = next((n for n in _parts(model).tail if n.type == DYNAMICS), None)
    if first is None:
        return model
    jumps = replace(first, values={**first.values, "hold": "zoh"})
    return Model.of(replace(model, graph=model.graph.replace(jumps)))


def _parts(model: Model) -> Parts:
    """Cut a model into its hysteresis and the linear blocks behind it, maybe none."""
    return split(model) or Parts(model, ())


def slower(found: Device, frequency: float) -> Device:
    """Return the device with references of another frequency (Hz)."""
    low, high, _ = reach(found.model, math.ceil(PERIODS / (frequency * found.h)))
    return replace(found, frequency=frequency, low=low, high=high)


def reach(model: Model, rows: int) -> tuple[float, float, bool]:
    """Return the least and the largest output that a sweep reaches and that last, and whether it falls.

    They last if they are still there after some `rows` at an end of the range of the input.
    """
    sweep = np.concatenate([np.linspace(a, b, 2000) for a, b in ((1, -1), (-1, 1))])
    y = model.predict(over_range(model, sweep))
    first, last = (float(model.predict(over_range(model, np.full(rows, v)))[-1]) for v in (-1.0, 1.0))
    return max(float(y.min()), min(first, last)), min(float(y.max()), max(first, last)), last < first


def unsuited(model: Model) -> str:
    """Return why a model cannot stand in the loop; empty if it can."""
    if names := beside(model.graph):
        return f"A loop is made for a model of one input. Got {', '.join(names)} beside it: use hystfmu fit."
    front = _parts(model).front
    inner = [n.type for n in front.graph.nodes if n.block.rate in ("sampled", "continuous") and n.type != "creep"]
    if inner:
        return f"A loop is made for dynamics behind the hysteresis. Got {model.key}, whose {inner[0]} has them within."
    return ""


def _at_rest(model: Model, parts: Parts) -> Model:
    """Return the model with its dynamics at rest: their static gains, no delay."""
    g = model.graph
    for n in parts.tail:
        if n.type in (DYNAMICS, "delay"):
            gain = static_gain(n) if n.type == DYNAMICS else 1.0
            g = g.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain}))
    return Model.of(replace(model, graph=g, fit={}))


def _filter(taps: Array, rest: float) -> Graph:
    """Return a block that weighs the last samples, with static gain 1; before the first one they are `rest`."""
    dims = {"n_u": len(taps), "n_f": 0, "n_y": 0, "q": 1, "n_k": 0}
    node = Node("dynamics", "polynomial_narx", dims, {"theta": [*(taps / taps.sum()).tolist(), 0.0]})
    return Graph([node], [], [Input("u", ("dynamics.u",), start=rest)], [Output("y", "dynamics.y")])


def corners(found: Device) -> Iterator[tuple[str, str, Model]]:
    """Yield devices at the corners of what the model may be wrong by: name, text, model.

    The gain differs by `GAIN`, and the frequencies of the dynamics by `FREQUENCY`.
    """
    frequencies = ((1 - FREQUENCY, "slow"), (1 + FREQUENCY, "fast")) if found.dynamics else ((1.0, ""),)
    for k, side in ((1 + GAIN, "up"), (1 - GAIN, "down")):
        for f, speed in frequencies:
            name = f"{side}_{speed}" if speed else side
            text = f"gain {100 * (k - 1):+.0f} %" + (f", frequencies {100 * (f - 1):+.0f} %" if speed else "")
            yield name, text, _differing(found, k, f)


def _differing(found: Device, k: float, f: float) -> Model:
    """Return the model with k times the gain around the output at rest, and f times the frequencies."""
    g = found.model.graph
    for n in found.dynamics:
        g = g.replace(faster(n, f))
    name = "corner"
    while name in {n.name for n in g.nodes}:
        name += "_"
    (out,) = g.outputs
    node = Node(name, "scaling", {"n": 1}, {"gain": k, "offset": (1 - k) * found.rest})
    ends = [replace(out, source=f"{name}.y")]
    graph = Graph([*g.nodes, node], [*g.wires, (out.source, f"{name}.u")], g.inputs, ends, sort=False, step=g.step)
    return Model.of(replace(found.model, graph=graph, text=f"{k:g} times the gain, {f:g} times the frequencies"))


def faster(node: Node, f: float) -> Node:
    """Return a transfer function with all its frequencies multiplied by f: s becomes s / f."""
    values = dict(node.values)
    for key, n in (("b", node.dims["nb"]), ("a", node.dims["na"])):
        values[key] = (node.value(key) / f ** np.arange(n, -1, -1.0)).tolist()
    return replace(node, values=values)


def reference_frequency(data: Dataset) -> float:
    """Return half the mean rate of reversals of the input, at least `SAMPLES` steps a period."""
    turns = sum(len(reversals(data.u[rows])) for rows in data.records)
    found = max(turns, 1) / (2 * len(data.u) * data.h)
    return float(f"{min(max(found, 1 / (LONGEST * data.h)), 1 / (SAMPLES * data.h)):.3g}")
