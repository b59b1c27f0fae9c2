"""Adaptive inverse of a Prandtl-Ishlinskii model, with or without dynamics, which estimates its weights while it runs.

The block `adaptive_inverse` starts with the weights, thresholds, dynamics and delay of the model. The RMS error e of
the model determines two parameters of the block. The assumed standard deviation of the prediction error is sigma = e/2;
it is smaller than e because errors of neighbouring samples are similar. If the prediction error exceeds 1.5 e during
six samples, this counts as a sudden change of the plant. After a sudden change, the assumed standard deviation of a
weight is 22 % of the larger of two values: the weight, and half of the mean weight.

The default options are suitable for operation without feedback. If a feedback controller adds to the wanted output, use
``f_h`` = 30 Hz and ``T`` = 100 s. The controller then corrects slow errors and drift (see scenarios/adaptive_pid).
"""

from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import InputError
from hystfmu.core.library import NO_LIMIT
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.inverse.dynamic import split
from hystfmu.inverse.ports import at_start, chain, line
from hystfmu.model import M, Model

KEY = "adaptive_inverse"
FROM_MODEL = {"w0", "r", "w", "u0"}  # parameters of the block that come from the model and are not options
SPREAD = 0.22  # relative standard deviation of a weight after a sudden change
LEAST_ERROR = 1e-3  # smallest assumed error of the model, relative to the output at the last threshold


def adaptive_inverse(model: M, **options: Any) -> M:
    """Return the adaptive inverse of a Prandtl-Ishlinskii model, which may have scalings, a delay and dynamics.

    The inverse has three inputs. ``v`` is the wanted output before dynamics and delay, that is, the sum of feed-forward
    and feedback. ``y_d`` is the reference, and ``y`` is the measured output. The outputs are the input ``u`` of the
    plant, the present weights ``theta``, the flag ``gate`` (1 if the weights were updated), and the number ``changes``
    of sudden changes.

    Parameters
    ----------
    model : Model
        Static model, or model with second-order dynamics without zeros.
    **options
        Values that replace parameters of the block `adaptive_inverse`. ``f_n`` (Hz) and ``zeta`` are the natural
        frequency and the damping of dynamics that follow a static model. ``delay`` is the number of steps of delay in
        the loop that the model does not contain.

    Raises
    ------
    InputError
        The model has another structure, or an option is unknown.
    """
    legal = {v.name for v in Node("adaptive", KEY).block.parameters} - FROM_MODEL | {"delay"}
    if unknown := sorted(set(options) - legal):
        raise InputError(
            f"The options of the adaptive inverse must be among: {', '.join(sorted(legal))}. "
            f"Got {unknown[0]!r} instead."
        )
    parts = split(model)
    front = model if parts is None else parts.front
    before, operator, behind = _chain(front)
    gain, offset = _line(behind)
    dynamics: dict[str, float] = {}
    delay = 0
    if parts is not None:
        tail_gain, tail_offset = parts.readout
        static, dynamics = _second_order(parts.filters)
        gain, offset = gain * static * tail_gain, offset * static * tail_gain + tail_offset
        delay = parts.delay
    weights = np.append(operator.value("w0"), operator.value("w"))
    if weights[0] <= 0 or weights.min() < 0:
        raise InputError(
            f"The weights of {operator.name} must not be negative, w0 greater than 0, for an adaptive inverse. "
            f"Got {weights.min():g}: fit with w0_min > 0 and without signed weights."
        )
    if gain == 0:
        raise InputError(f"The gain behind {operator.name} must not be 0 for an inverse. Got 0.")
    slope, r = float(weights.sum()), operator.value("r")
    error = max(float(model.fit.get("rms", 0.0)) / abs(gain), LEAST_ERROR * slope * float(r[-1]))
    values: dict[str, Any] = {
        "w0": weights[0],
        "r": r,
        "w": weights[1:],
        "u0": operator.value("u0"),
        **dynamics,
        "sd": SPREAD * np.maximum(weights, slope / (2 * len(weights))),
        "sigma": error / 2,
        "change": 1.5 * error,
        "w0_min": weights[0] / 2,
        **{k: v for k, v in options.items() if k != "delay"},
    }
    ports = Node("ports", "scaling", {"n": 2}, {"gain": [1 / gain] * 2, "offset": [-offset / gain] * 2})
    learner = Node("adaptive", KEY, {"delay": delay + _steps(options.get("delay", 0))}, values)
    to_x, from_x = _line(before)
    command = Node("command", "scaling", {"n": 1}, {"gain": 1 / to_x, "offset": -from_x / to_x})
    source, sink, rest = model.graph.inputs[0], model.graph.outputs[0], at_start(model)
    graph = Graph(
        [ports, learner, command],
        [("ports.y[1]", "adaptive.v"), ("ports.y[2]", "adaptive.y"), ("adaptive.u", "command.u")],
        [
            Input("v", ("ports.u[1]",), sink.unit, rest, "wanted output before dynamics and delay"),
            Input("y_d", ("adaptive.y_d",), sink.unit, rest, "reference: nothing is learned while it stands still"),
            Input("y", ("ports.u[2]",), sink.unit, rest, "measured output"),
        ],
        [
            Output("u", "command.y", source.unit, "input that gives v"),
            Output("theta", "adaptive.theta", text="current weights w0 and w"),
            Output("gate", "adaptive.gate", text="1 if the sample updated the weights"),
            Output("changes", "adaptive.changes", text="number of sudden changes"),
        ],
    )
    graph.executor()  # raises an InputError if the values have no inverse
    provenance = {"inverse": "adaptive", "of": model.provenance}
    step = None if parts is None else model.step
    text = f"adaptive inverse: {model.text}"
    return replace(model, key=f"{model.key}_{KEY}", graph=graph, step=step, text=text, fit={}, provenance=provenance)


def _chain(front: Model) -> tuple[list[Node], Node, list[Node]]:
    """Return the scalings before the operator, the operator, and the scalings after it."""
    found = chain(front.graph) if len(front.graph.inputs) == 1 else None
    types = [n.type for n in found or front.graph.nodes]
    if found is None or types.count("prandtl_ishlinskii") != 1 or set(types) > {"prandtl_ishlinskii", "scaling"}:
        other = next((t for t in types if t not in ("prandtl_ishlinskii", "scaling")), "another structure")
        raise InputError(
            "A model for an adaptive inverse must be a Prandtl-Ishlinskii operator, perhaps scaled, before second "
            f"order dynamics. Got {other} in {front.key}."
        )
    i = types.index("prandtl_ishlinskii")
    return found[:i], found[i], found[i + 1 :]


def _line(scalings: list[Node]) -> tuple[float, float]:
    """Return the gain and the offset of scalings in series; a scaling with limits raises an InputError."""
    for n in scalings:
        limits = [abs(float(n.value(name)[0])) for name in ("lo", "hi")]
        if min(limits) < NO_LIMIT:
            raise InputError(f"The block {n.name!r} must have no limits for an adaptive inverse. Got {min(limits):g}.")
    return line(scalings)


def _second_order(found: list[Node]) -> tuple[float, dict[str, float]]:
    """Return the static gain and the values ``f_n`` (Hz) and ``zeta`` of a transfer function of second order.

    `found` contains the transfer functions of the model. Without any, the result is the gain 1 and an empty dict. More
    than one, or another order, raise an InputError.
    """
    if not found:
        return 1.0, {}
    b, a = found[0].value("b"), found[0].value("a")
    if len(found) > 1 or len(b) != 1 or len(a) != 3 or not (a / a[0] > 0).all():
        raise InputError(
            "The dynamics for an adaptive inverse must be of second order, without zeros and stable. "
            f"Got {len(found)} transfer function{'s' * (len(found) > 1)}, the first of order {len(a) - 1}."
        )
    omega = float(np.sqrt(a[2] / a[0]))
    return float(b[0] / a[2]), {"f_n": omega / (2 * np.pi), "zeta": float(a[1] / a[0] / (2 * omega))}


def _steps(given: Any) -> int:
    if given != int(given) or given < 0:
        raise InputError(f"The option 'delay' must be a whole number of steps. Got {given!r} instead.")
    return int(given)
