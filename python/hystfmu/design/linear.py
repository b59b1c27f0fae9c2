"""Linear systems of python-control from blocks, graphs and models.

A continuous transfer function remains a transfer function. Sampled systems become state-space models that are exact for
a step h. Trap: products of polynomials lose the accuracy of poles near z = 1. A controller with a smoothed switching
term is linearised for small values of the sliding variable s. A graph is linearised by its exact tangent at rest, where
hysteresis has the slope of the ascending branch.

The function `gains` returns the gains of a controller with their units of measure. Without its unit of measure, a gain
cannot be used in another loop.
"""

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, checked, extras
from hystfmu.core.executor import ContinuousExecutor
from hystfmu.design.delays import StateSpace, close, cut, sampled, shift_registers
from hystfmu.design.delays import pade as pade_of
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

MEASURED = "y"  # name of the measured input of a controller
LIFTED = "iterative_learning"  # block whose output depends only on the previous period
NO_STATES = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))


@checked
def to_control(part: Node | Graph | Model, h: float | None = None, pade: int | None = None) -> Any:
    """Convert a block, a graph or a model to a linear system of python-control.

    Parameters
    ----------
    part : Node, Graph or Model
        A Graph or Model is linearised as `linearise` describes. The system of a Node has the following input and
        output. `transfer_function` and `delay`: from u to y. `pid` and `lead_lag`: from y_d - y to u - u_ff.
        `sliding_mode` and `super_twisting`: from -(y - y_d) to u - u_ff for small s, without limits; this is the
        largest gain, and the gain decreases with the amplitude. `repetitive`: from y_d - y to r - y_d. Any other
        sampled block with an input y, such as an observer: from -y to its first output, by the exact tangent.
    h : float, optional
        Step (s). Without a step, the result is a continuous-time system. The block `delay` and the controllers need a
        step.
    pade : int, optional
        Order of the Pade approximants that replace the delays of a Graph or Model in continuous form.

    Returns
    -------
    control.TransferFunction or control.StateSpace
        With a step, the result is a state space. The block `transfer_function` is discretised exactly, for the hold
        that is set in the block.

    Raises
    ------
    InputError
        The block is not linear, a controller has no step, a delay in continuous form has no `pade`, or python-control
        is not installed.
    """
    control = python_control()
    if h is not None and not (math.isfinite(h) and h > 0):
        raise InputError(f"The step 'h' must be a float in (0, inf). Got {h!r} instead.")
    if isinstance(part, Model):
        part = part.graph
    if isinstance(part, Graph):
        return _graph_to_control(part, h, pade, control)
    if part.type == "transfer_function":
        if h is None:
            return control.tf(part.value("b"), part.value("a"))
        system = linearise(Graph.single(part))
        method = "foh" if part.value("hold")[0] else "zoh"
        return (
            control.sample_system(control.ss(*system), h, method=method) if len(system[0]) else control.ss(*system, h)
        )
    measures = part.block.rate == "sampled" and any(v.name == MEASURED for v in part.block.of("input"))
    if part.type not in _SAMPLED and not measures:
        linear = f"transfer_function, {', '.join(_SAMPLED)}, or a sampled block with an input {MEASURED}"
        raise InputError(f"The block must be linear, one of {linear}. Got {part.type} instead.")
    if h is None:
        raise InputError(
            f"The step 'h' of the sampled block {part.type} must be a float in (0, inf). Got None instead."
        )
    if part.type == LIFTED:
        raise InputError(
            f"The block must have a transfer function. Got {part.type}, which acts from period to period: 'hystfmu "
            "margins' gives the factor by which its corrections shrink."
        )
    if part.type not in _SAMPLED:
        A, B, C, D = sampled(Graph.single(part), h)
        places = [i.name for i in part.block.of("input") for _ in range(part.sizes[i.name])]
        y = [places.index(MEASURED)]
        return control.ss(A, -B[:, y], C[:1], -D[:1, y], h)
    return control.ss(*_SAMPLED[part.type](part, h), h)


def feedthrough(part: Graph | Model) -> StateSpace:
    """Return a graph without its continuous states as a state space, whose only states are the delays."""
    opened = cut(part.graph if isinstance(part, Model) else part)
    A, B, C, D = linearise(opened.graph)
    static = A[:0, :0], B[:0], C[:, :0], D
    return close(static, shift_registers(opened.steps)) if opened.steps else static


def _graph_to_control(graph: Graph, h: float | None, pade: int | None, control: Any) -> Any:
    """Convert a graph to a state space.

    With a step, the input of the continuous part is constant over each step, and delays become states. Without a step,
    Pade approximants replace the delays.
    """
    opened = cut(graph)
    system = linearise(opened.graph)
    if h is not None:
        if len(system[0]):
            held = control.sample_system(control.ss(*system), h, method="zoh")
            system = held.A, held.B, held.C, held.D
        if opened.steps:
            _check_step(graph, h)
            system = close(system, shift_registers(opened.steps))
        return control.ss(*system, h)
    if opened.steps:
        system = _with_pade(system, opened.steps, graph, pade, control)
    return control.ss(*system)


def _with_pade(
    system: tuple[Array, Array, Array, Array], steps: tuple[int, ...], graph: Graph, pade: int | None, control: Any
) -> tuple[Array, Array, Array, Array]:
    """Return the state space of a cut graph in which Pade approximants replace the removed delays."""
    if pade is None:
        raise InputError(
            "The order 'pade' must be given for a delay in continuous form. Got None: give pade=ORDER, or, to "
            "to_control(), the step h for a discrete system."
        )
    if not graph.step > 0:
        raise InputError(
            "The model must state its step for a delay in continuous form. Got none: give the step h instead."
        )
    return close(system, pade_of([n * graph.step for n in steps], pade, control))


def _check_step(graph: Graph, h: float) -> None:
    if graph.step and abs(graph.step - h) > 1e-9 * h:
        raise InputError(
            f"The step 'h' must be that of the model, {graph.step:g} s, because delays count steps. Got {h:g} instead."
        )


@checked
def linearise(part: Graph | Model, pade: int | None = None) -> tuple[Array, Array, Array, Array]:
    """Linearise a graph or a model at its start values by its exact tangent.

    Inputs have their start values. Hysteresis has the slope for a rising input.

    Parameters
    ----------
    part : Graph or Model
        Graph without sampled blocks except delays.
    pade : int, optional
        Order of the Pade approximants that replace delays. Pade approximants need python-control.

    Returns
    -------
    A, B, C, D : array, shapes (n, n), (n, m), (p, n), (p, m)
        State space with n continuous states, m scalar inputs and p scalar outputs in the order of the graph. The time
        is in s.

    Raises
    ------
    InputError
        The graph has a sampled block, which has no continuous form, or it has a delay and `pade` is None.
    """
    graph = part.graph if isinstance(part, Model) else part
    opened = cut(graph)
    if opened.steps:
        return _with_pade(linearise(opened.graph), opened.steps, graph, pade, python_control())
    executor = ContinuousExecutor(graph.to_bytes())
    if executor.is_sampled:
        raise InputError("A graph to linearise must have no sampled blocks. Got one, which has no continuous form.")
    executor.start(0.0)
    executor.evaluate(0.0)
    n, m, p = len(executor.x), graph.n_inputs, graph.n_outputs
    columns = [np.concatenate(executor.tangent(seed[:m], seed[m:], p)) for seed in np.eye(m + n)]
    T = np.column_stack(columns)
    return T[p:, m:], T[p:, :m], T[:p, m:], T[:p, :m]


def in_series(f: StateSpace, g: StateSpace) -> StateSpace:
    """Return the series connection f g: the signal and the states pass through g first."""
    A = np.block([[g[0], np.zeros((len(g[0]), len(f[0])))], [f[1] @ g[2], f[0]]])
    return A, np.vstack([g[1], f[1] @ g[3]]), np.hstack([f[3] @ g[2], f[2]]), f[3] @ g[3]


def python_control() -> Any:
    """Import python-control on first use, because the import takes seconds.

    Raises
    ------
    InputError
        python-control is not installed.
    """
    with extras("the design of loops"):
        return importlib.import_module("control")


# ---- sampled blocks, as their C files discretise them ---------------------------------------------------------------
def _add(f: StateSpace, g: StateSpace) -> StateSpace:
    """Return f + g."""
    A = np.block([[f[0], np.zeros((len(f[0]), len(g[0])))], [np.zeros((len(g[0]), len(f[0]))), g[0]]])
    return A, np.vstack([f[1], g[1]]), np.hstack([f[2], g[2]]), f[3] + g[3]


def _gain(k: float) -> StateSpace:
    return *NO_STATES, np.array([[k]])


def _first_order(b1: float, b0: float, a1: float, a0: float) -> StateSpace:
    """Return (b1 z + b0) / (a1 z + a0)."""
    scalars = -a0 / a1, 1.0, (b0 - b1 * a0 / a1) / a1, b1 / a1
    A, B, C, D = (np.array([[x]]) for x in scalars)
    return A, B, C, D


def _difference(tau: float, h: float) -> StateSpace:
    return _first_order(1.0, -1.0, tau + h, -tau)


def _sum(h: float) -> StateSpace:
    return _first_order(h, 0.0, 1.0, -1.0)


def _values(node: Node, *names: str) -> list[float]:
    return [float(node.value(n)[0]) for n in names]


def _delay(node: Node, h: float) -> StateSpace:
    return shift_registers((node.dims["n"],))


def _pid(node: Node, h: float) -> StateSpace:
    Kp, Ki, Kd, tau = _values(node, "Kp", "Ki", "Kd", "tau")
    c = _gain(Kp)
    if Ki:  # with a gain of 0, this term would add a pole that a zero cancels
        c = _add(c, in_series(_gain(Ki), _sum(h)))
    return _add(c, in_series(_gain(Kd), _difference(tau, h))) if Kd else c


def _lead_lag(node: Node, h: float) -> StateSpace:
    c = _gain(float(node.value("K")[0]))
    for z, p in zip(node.value("T_z"), node.value("T_p"), strict=True):
        c = in_series(c, _first_order(2 * z + h, h - 2 * z, 2 * p + h, h - 2 * p))
    return c


def _line(node: Node, h: float, k_i: float) -> StateSpace:
    lam, tau = _values(node, "lam", "tau")
    s = _add(_gain(lam), _difference(tau, h))
    return _add(s, in_series(_gain(k_i), _sum(h))) if k_i else s


def _sliding_mode(node: Node, h: float) -> StateSpace:
    eta, rho, epsilon, k_i = _values(node, "eta", "rho", "epsilon", "k_i")
    # default boundary layer of the block if `epsilon` is 0
    switching = rho / epsilon if epsilon else 10 * eta * (rho > 0)
    return in_series(_gain(eta + switching), _line(node, h, k_i))


def _super_twisting(node: Node, h: float) -> StateSpace:
    k_1, k_2, mu, epsilon, lam = _values(node, "k_1", "k_2", "mu", "epsilon", "lam")
    epsilon = epsilon or (10 * k_2 / (lam * k_1)) ** 2
    slope_1 = 1 / math.sqrt(epsilon) + mu
    slope_2 = 0.5 / epsilon + 1.5 * mu / math.sqrt(epsilon) + mu * mu
    c = _gain(k_1 * slope_1)
    if k_2:
        c = _add(c, in_series(_gain(k_2 * slope_2), _sum(h)))
    return in_series(c, _line(node, h, 0.0))


def _repetitive(node: Node, h: float) -> StateSpace:
    """Return the block `repetitive`, w = z^-n (Q w + L e), as a state space whose step is `h` (s).

    The states are a shift register of n + m steps. m is the number of taps on one side of the longer filter.
    """
    n, q, l = node.dims["n"], node.value("q"), node.value("l")  # noqa: E741
    n_q, n_l = len(q) - 1, len(l) // 2
    m = max(n_q, n_l)
    b, a = np.zeros(n + m + 1), np.zeros(n + m + 1)
    b[n - n_l : n + n_l + 1] = l[::-1]
    a[n - n_q : n + n_q + 1] = np.concatenate([q[:0:-1], q])
    A, B, _, _ = shift_registers((n + m,))
    A[0] = a[1:]
    return A, B, (b[1:] + b[0] * a[1:])[None], b[:1, None]


_SAMPLED: dict[str, Callable[[Node, float], StateSpace]] = {
    "delay": _delay,
    "pid": _pid,
    "lead_lag": _lead_lag,
    "sliding_mode": _sliding_mode,
    "super_twisting": _super_twisting,
    "repetitive": _repetitive,
}


@dataclass(frozen=True)
class Gain:
    """One parameter of a controller.

    Parameters
    ----------
    name, text : str
        Name of the parameter, and its meaning in the table of the block.
    value : array, shape (n,)
        Values.
    unit : str
        Unit of measure; "1" for a dimensionless value.
    """

    name: str
    value: Array
    unit: str
    text: str

    def __str__(self) -> str:
        values = ", ".join(f"{v:.6g}" for v in self.value)
        return f"{self.name} = {values}{'' if self.unit == '1' else ' ' + self.unit}  ({self.text})"


@checked
def gains(node: Node) -> list[Gain]:
    """Return the numeric parameters of a block in the order of the table of the block.

    Parameters
    ----------
    node : Node
        Any block. Enumeration parameters are omitted.
    """
    return [Gain(v.name, node.value(v.name), v.unit, v.text) for v in node.block.parameters if not v.choices]
