"""Controller structures for a loop with an inverse. Each structure has a graph of blocks and a frequency response.

The error e = y_d - y passes through filters F and an integral controller (block `pid`). Some structures have a damping
path D in parallel:

    u = u_ff + Ki h z / (z - 1) (1 + T ...) F(z) e - D(z) e.

A scenario simulates the same blocks, so the simulated controller equals the tuned controller. Sources: notch and
integral, Abramovitch et al. 2008; integral resonant control (IRC), Aphale, Fleming & Moheimani 2007, Smart Materials
and Structures 16, 439-446; positive position feedback (PPF), Fanson & Caughey 1990, AIAA Journal 28, 717-724; internal
model, Smith 1957; H-infinity loop shaping, McFarlane & Glover, IEEE Trans. Automat. Control 37 (1992) 759-769, and
Skogestad & Postlethwaite, Multivariable Feedback Control, 2nd ed., section 9.4.

H-infinity loop shaping designs the controller that is most robust against perturbations of a shaped plant. For a
discrete plant, the design uses the bilinear transformation, which preserves all norms. The resulting controller is
realised as second-order filters in series, followed by an integral.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hystfmu.base import Complex, InputError
from hystfmu.design.delays import StateSpace
from hystfmu.design.linear import in_series, python_control
from hystfmu.design.plants import Plant
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.graph.recursion import discretised


@dataclass(frozen=True)
class LoopShaping:
    """A controller for negative feedback, and the robust stability margins of the shaped plant.

    Attributes
    ----------
    controller : control.StateSpace
        Product K of the weight and the robust controller; the command is u = K (r - y).
    robust : control.StateSpace
        The robust controller without the weight.
    b_opt : float
        Largest robust stability margin that any controller reaches, at most 1. It is the allowed size of coprime factor
        perturbations. If it is below 0.25, the weight is too demanding.
    b : float
        Guaranteed robust stability margin of this controller, b_opt / ratio.
    """

    controller: Any
    robust: Any
    b_opt: float
    b: float


def loop_shaping(G: Any, W: Any, ratio: float = 1.1) -> LoopShaping:
    """Design the robust controller of a shaped plant G W.

    Parameters
    ----------
    G : control.TransferFunction or control.StateSpace
        Plant with one input and one output, continuous or with a step.
    W : control.TransferFunction or control.StateSpace
        Weight in front of the plant. It determines the shape of the loop.
    ratio : float
        Ratio of the largest margin `b_opt` to the margin of the designed controller, above 1. A usual value is 1.1.

    Returns
    -------
    LoopShaping

    Raises
    ------
    InputError
        `ratio` is not above 1, or the shaped plant has uncontrollable or unobservable states.
    """
    if not ratio > 1:
        raise InputError(f"The ratio must be a float in (1, inf). Got {ratio:g} instead.")
    control = python_control()
    shaped = control.ss(G) * control.ss(W)
    h = float(shaped.dt)
    system = shaped.A, shaped.B, shaped.C, shaped.D
    try:
        found, least = robust_controller(_to_continuous(system, h) if h else system, ratio)
    except np.linalg.LinAlgError:
        raise InputError("The shaped plant must be stabilisable and detectable. Got one that is not.") from None
    robust = control.ss(*(_to_discrete(found, h) if h else found), h)
    return LoopShaping(control.ss(W) * robust, robust, 1 / least, 1 / (ratio * least))


def robust_controller(system: StateSpace, ratio: float) -> tuple[StateSpace, float]:
    """Return the robust controller of a shaped plant for negative feedback, and 1 / b_opt (`LoopShaping.b_opt`).

    The plant has one input and one output. `ratio`, above 1, is the ratio of the optimal margin to the margin of the
    controller. Source: Skogestad & Postlethwaite, eq. 9.69 to 9.73.
    """
    # imported here, so that a process for a foreign FMU does not wait for the import
    from scipy.linalg import solve_continuous_are

    A, B, C, D = system
    S, R = np.eye(B.shape[1]) + D.T @ D, np.eye(C.shape[0]) + D @ D.T
    F = A - B @ np.linalg.solve(S, D.T @ C)
    Z = solve_continuous_are(F.T, C.T, B @ np.linalg.solve(S, B.T), R)
    X = solve_continuous_are(F, B, C.T @ np.linalg.solve(R, C), S)
    least = float(np.sqrt(1 + np.abs(np.linalg.eigvals(X @ Z)).max()))
    gamma = ratio * least
    K = -np.linalg.solve(S, D.T @ C + B.T @ X)
    inject = np.asarray(gamma**2 * np.linalg.solve(((1 - gamma**2) * np.eye(len(A)) + X @ Z).T, Z @ C.T), float)
    return (A + B @ K + inject @ (C + D @ K), inject, -B.T @ X, D.T), least


def _to_continuous(system: StateSpace, h: float) -> StateSpace:
    """Convert a discrete state space to a continuous one by s = 2 / h (z - 1) / (z + 1); norms are preserved."""
    A, B, C, D = system
    M = np.linalg.inv(A + np.eye(len(A)))
    root = 2 / np.sqrt(h)
    return 2 / h * M @ (A - np.eye(len(A))), root * M @ B, root * C @ M, D - C @ M @ B


def _to_discrete(system: StateSpace, h: float) -> StateSpace:
    """Convert the continuous state space back to a discrete one."""
    A, B, C, D = system
    M = np.asarray(np.linalg.inv(np.eye(len(A)) - h / 2 * A), float)
    root = np.sqrt(h)
    return M @ (np.eye(len(A)) + h / 2 * A), root * M @ B, root * C @ M, D + h / 2 * C @ M @ B


RATIO = 1.1  # ratio of the optimal margin to the margin of the designed controller
FAST = 3.0  # poles and zeros (rad/s) above this multiple of the sampling rate (1/s) are removed


@functools.lru_cache(maxsize=64)
def robust_filters(plant: Plant, h: float, weight: float, zero: float) -> tuple[Node, ...]:
    """Return filters of static gain 1 for use in front of an integral, or () if no stable controller exists.

    The delay of the plant includes the computing time. The weight of the loop shaping has an integral of gain `weight`
    (1/s) and a zero with the time constant `zero` (s). `h` is the step (s).
    """
    try:
        (A, B, C, D), _ = robust_controller(_shaped(plant, plant.delay + h / 2, weight, zero), RATIO)
        zeros, poles = _zeros(A, B, C, D), np.linalg.eigvals(A)
    except (np.linalg.LinAlgError, ValueError):
        return ()
    if (poles.real >= 0).any():
        return ()
    zeros = np.append(zeros, -1 / zero)
    top = FAST / h
    zeros, poles = zeros[np.abs(zeros) < top], poles[np.abs(poles) < top]
    # the removed poles were fast; poles at the limit replace them so that the filters are proper
    if len(zeros) > len(poles):
        poles = np.append(poles, [-top] * (len(zeros) - len(poles)))
    tops, bottoms = _factors(zeros), _factors(poles)
    if any(f[-1] == 0 for f in tops + bottoms):
        return ()
    tops += [np.ones(1)] * (len(bottoms) - len(tops))
    nodes = []
    for i, (b, a) in enumerate(zip(tops, bottoms, strict=True)):
        values: dict[str, Any] = {"b": (b / b[-1]).tolist(), "a": (a / a[-1]).tolist(), "hold": "foh"}
        dims = {"na": len(a) - 1, "nb": len(b) - 1}
        nodes.append(Node(f"robust_{i + 1}", "transfer_function", dims, values))
    return tuple(nodes)


def _factors(roots: Any) -> list[Any]:
    """Return real polynomials of degree 2 with the given roots, and one of degree 1 if the number of roots is odd."""
    pairs = [np.poly([r, r.conjugate()]).real for r in roots if r.imag > 0]
    real = sorted((r.real for r in roots if abs(r.imag) <= 1e-9 * abs(r)), key=abs)
    pairs += [np.poly(real[k : k + 2]) for k in range(0, len(real) - 1, 2)]
    single = [np.poly(real[-1:])] * (len(real) % 2)
    return [*sorted(pairs, key=lambda p: abs(p[-1])), *single]


def _shaped(plant: Plant, delay: float, weight: float, zero: float) -> StateSpace:
    """Return the weight and the plant in series as one state space. The time is in s."""
    n = 2 * len(plant.f_n)
    G: StateSpace = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((1, n)), np.array([[plant.rest]])
    for i, (f, zeta, k) in enumerate(zip(plant.f_n, plant.zeta, plant.share, strict=True)):
        w, at = 2 * np.pi * f, slice(2 * i, 2 * i + 2)
        G[0][at, at] = [[0, w], [-w, -2 * zeta * w]]
        G[1][2 * i + 1, 0] = w
        G[2][0, 2 * i] = k
    T = delay  # second-order Pade: (1 - sT/2 + s^2 T^2/12) / (1 + sT/2 + s^2 T^2/12)
    late = np.array([[0.0, 1.0], [-12 / T**2, -6 / T]]), np.array([[0.0], [1.0]]), np.array([[0.0, -12 / T]]), np.eye(1)
    integral = np.zeros((1, 1)), np.eye(1), np.array([[weight]]), np.array([[weight * zero]])
    return in_series(G, in_series(late, integral))


def _zeros(A: Any, B: Any, C: Any, D: Any) -> Any:
    """Return the finite zeros of a state space with one input and one output."""
    # imported here, so that a process for a foreign FMU does not wait for the import
    from scipy.linalg import eigvals

    n = len(A)
    pencil, mass = np.block([[A, B], [C, D]]), np.zeros((n + 1, n + 1))
    mass[:n, :n] = np.eye(n)
    found = eigvals(pencil, mass)
    return found[np.isfinite(found) & (np.abs(found) < 1e3 * np.abs(np.linalg.eigvals(A)).max())]


Values = Mapping[str, float]
Speed = Callable[[float], tuple[Complex, Complex | None]]
ROLL_OFF = np.sqrt(0.5)  # damping of the second-order low-pass: Butterworth
OPEN = 0.4  # filters with a frequency above this fraction of the sampling rate are omitted


@dataclass(frozen=True)
class Design:
    """Data for the design of a structure: the identified plant and the step."""

    plant: Plant  # identified plant without the computing time
    h: float  # step (s)
    computing: int = 1  # computing time between a sample and the resulting command (steps)

    @property
    def known_steps(self) -> int:
        """Whole number of steps of delay that a Smith predictor compensates."""
        return round(self.plant.delay / self.h) + self.computing


@dataclass(frozen=True)
class Structure:
    """A controller structure: its tunable values in addition to the integral gain, and its blocks."""

    name: str
    text: str
    # maps a design to the name and the range of each value. All values are positive.
    bounds: Callable[[Design], dict[str, tuple[float, float]]]
    filters: Callable[[Design, Values], list[Node]]  # maps a design and values to the blocks in front of the integral
    # maps a design and values to the block in parallel to the integral; None if there is no such block
    damping: Callable[[Design, Values], Node | None] = lambda design, values: None
    proportional: bool = False  # whether the controller has a proportional gain Kp = Ki T with the value ``T`` (s)
    predictor: bool = False  # whether the error includes the predicted effect of commands that are still in the delay
    resonant: bool = False  # whether the structure needs an identified mode

    def response(self, design: Design, values: Values, z: Complex) -> Speed:
        """Return a function of Ki (1/s) that returns two responses at z: from e to u, and of the inner loop.

        The inner loop is the feedback inside the controller through the predictor. It is None without a predictor. The
        controller is stable only if the inner loop is stable.
        """
        h = design.h
        F = _product(self.filters(design, values), h, z)
        integral = (h * z / (z - 1) + (values["T"] if self.proportional else 0.0)) * F
        beside = self.damping(design, values)
        D = _product([beside], h, z) if beside is not None else 0.0
        if not self.predictor:
            return lambda Ki: (np.asarray(Ki * integral + D), None)
        known = _normed(design.plant).response(z, h)
        hidden = known * (1 - z ** -float(design.known_steps))
        return lambda Ki: (np.asarray(Ki * integral / (1 + Ki * integral * hidden)), Ki * integral * hidden)

    def graph(self, design: Design, values: Values, Ki: float, limits: tuple[float, float] | None = None) -> Graph:
        """Return the controller as a graph with inputs y_d, y, u_ff and output u.

        `values` contains a value for each name in `bounds`. `Ki` is the integral gain (1/s). While u is at a limit, the
        integral is constant (anti-windup).
        """
        Kp = Ki * values["T"] if self.proportional else 0.0
        pid: dict[str, Any] = {"Kp": Kp, "Ki": Ki}
        pid |= {} if limits is None else {"u_min": limits[0], "u_max": limits[1]}
        chain = self.filters(design, values)
        beside = self.damping(design, values)
        signs = [1.0, -1.0] + [-1.0] * self.predictor
        nodes = [Node("error", "sum", {"n": len(signs)}, {"k": signs}), *chain]
        wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
        ahead: tuple[str, ...] = ("pid.u_ff",)
        if beside is not None:
            nodes += [beside, Node("command", "sum", {"n": 2}, {"k": [1.0, 1.0]})]
            wires += [("error.y", f"{beside.name}.u"), (f"{beside.name}.y", "command.u[2]"), ("command.y", "pid.u_ff")]
            ahead = ("command.u[1]",)
        wires.append((f"{(chain or nodes[:1])[-1].name}.y", "pid.y_d"))
        nodes.append(Node("pid", "pid", {}, pid))
        if self.predictor:
            nodes, wires, ahead = _predicting(design, nodes, wires)
        inputs = [
            Input("y_d", ("error.u[1]",), text="wanted output"),
            Input("y", ("error.u[2]",), text="measured output"),
            Input("u_ff", ahead, text="feed-forward"),
        ]
        return Graph(nodes, wires, inputs, [Output("u", "pid.u", text="command")], sort=False, step=design.h)


def _predicting(
    design: Design, nodes: list[Node], wires: list[tuple[str, str]]
) -> tuple[list[Node], list[tuple[str, str]], tuple[str, ...]]:
    """Add a Smith predictor to the nodes and wires of a controller.

    The predictor adds the output of the plant model without delay minus its output with delay.

    The blocks of the model are first in the order. Therefore their input is the command of the previous step, as for
    the plant.
    """
    own = [
        Node("own", "sum", {"n": 2}, {"k": [1.0, -1.0]}),  # the last command without feed-forward, after the limits
        Node("late", "delay", {"n": design.known_steps}),
        Node("hidden", "sum", {"n": 2}, {"k": [1.0, -1.0]}),
    ]
    model = _model(design.plant)
    first = Node("ahead", "scaling", {"n": 1})
    around = [
        ("pid.u", "own.u[1]"),
        ("ahead.y", "own.u[2]"),
        ("own.y", "late.u"),
        ("own.y", "hidden.u[1]"),
        ("late.y", "hidden.u[2]"),
        ("ahead.y", "pid.u_ff"),
    ]
    around += [("hidden.y", "model.u"), ("model.y", "error.u[3]")]
    return [*own, model, *nodes[:-1], first, nodes[-1]], [*wires, *around], ("ahead.u",)


def _normed(plant: Plant) -> Plant:
    """Return a plant that has only the modes of `plant`, scaled to a static gain of 1, without delay."""
    total = sum(plant.share)
    return Plant(plant.f_n, plant.zeta, tuple(k / total for k in plant.share))


def _model(plant: Plant) -> Node:
    """Return a block with the modes of a plant."""
    p = _normed(plant)
    return Node("model", "modes", {"n": len(p.f_n)}, {"f_n": list(p.f_n), "zeta": list(p.zeta), "k": list(p.share)})


def _product(nodes: list[Node], h: float, z: Complex) -> Complex:
    found = np.ones_like(z)
    for n in nodes:
        b, a = discretised(n, h).fraction()
        found = found * np.polyval(b, z) / np.polyval(a, z)
    return found


def _second_order(name: str, f: float, zeta: float, top: tuple[float, float, float]) -> Node:
    """Return a block for top(s / w) / (s^2 / w^2 + 2 zeta s / w + 1), where `top` contains b2, b1 and b0."""
    w = 2 * np.pi * f
    b2, b1, b0 = top
    b = [b2 / w**2, b1 / w, b0] if b2 or b1 else [b0]
    values: dict[str, Any] = {"b": b, "a": [1 / w**2, 2 * zeta / w, 1.0], "hold": "foh"}
    return Node(name, "transfer_function", {"na": 2, "nb": len(b) - 1}, values)


def _roll_off(design: Design, values: Values) -> list[Node]:
    if values["roll_off"] * design.h >= OPEN:
        return []
    return [_second_order("roll_off", values["roll_off"], ROLL_OFF, (0.0, 0.0, 1.0))]


def _notches(design: Design, values: Values) -> list[Node]:
    """Return a notch filter for each mode below 0.4 times the sampling rate.

    `width` is the damping of the poles of a notch; `depth` determines the damping of its zeros.
    """
    found = []
    for i, (f, zeta) in enumerate(zip(design.plant.f_n, design.plant.zeta, strict=True)):
        if f * design.h < OPEN:
            zero = max(zeta, values["depth"] * values["width"])
            found.append(_second_order(f"notch_{i + 1}", f, values["width"], (1.0, 2 * zero, 1.0)))
    return found


def _filtered(design: Design, values: Values) -> list[Node]:
    return [*_notches(design, values), *_roll_off(design, values)]


def _irc(design: Design, values: Values) -> Node:
    b, a = [-values["damping"]], [values["lag"], 1.0]
    return Node("damping", "transfer_function", {"na": 1, "nb": 0}, {"b": b, "a": a, "hold": "foh"})


def _ppf(design: Design, values: Values) -> Node:
    return _second_order("damping", values["f_p"], values["zeta_p"], (0.0, 0.0, -values["damping"]))


def _robust(design: Design, values: Values) -> list[Node]:
    late = replace(design.plant, delay=(design.known_steps + 0.0) * design.h)
    return list(robust_filters(late, design.h, values["weight"], values["zero"]))


def _robust_bounds(design: Design) -> dict[str, tuple[float, float]]:
    f = _slowest(design)
    return {"weight": (0.05 * f, 20 * f), "zero": (0.02 / f, 2 / f)}


def _slowest(design: Design) -> float:
    """Return the lowest natural frequency of the plant (Hz), but at most a quarter of the sampling rate."""
    return min((*design.plant.f_n, 0.25 / design.h))


def _roll_off_bounds(design: Design) -> dict[str, tuple[float, float]]:
    return {"roll_off": (0.02 * _slowest(design), 1 / design.h)}


def _notch_bounds(design: Design) -> dict[str, tuple[float, float]]:
    return {"width": (0.1, 1.5), "depth": (0.01, 0.7), **_roll_off_bounds(design)}


def _irc_bounds(design: Design) -> dict[str, tuple[float, float]]:
    lag = 1 / (2 * np.pi * _slowest(design))
    return {"damping": (0.02, 3.0), "lag": (0.05 * lag, 5 * lag)}


def _ppf_bounds(design: Design) -> dict[str, tuple[float, float]]:
    f = _slowest(design)
    return {"damping": (0.02, 2.0), "f_p": (0.5 * f, 3 * f), "zeta_p": (0.05, 1.0)}


def _with_T(
    bounds: Callable[[Design], dict[str, tuple[float, float]]],
) -> Callable[..., dict[str, tuple[float, float]]]:
    return lambda design: {"T": (0.02 * design.h, 2 / _slowest(design)), **bounds(design)}


STRUCTURES: dict[str, Structure] = {
    s.name: s
    for s in (
        Structure("integral", "integral controller without filters", lambda d: {}, lambda d, v: []),
        Structure("integral_roll_off", "integral with roll-off", _roll_off_bounds, _roll_off),
        Structure("pi", "PI with roll-off", _with_T(_roll_off_bounds), _roll_off, proportional=True),
        Structure("notch", "notches and integral", _notch_bounds, _filtered, resonant=True),
        Structure("pi_notch", "notches and PI", _with_T(_notch_bounds), _filtered, proportional=True, resonant=True),
        Structure("irc", "integral resonant control", _irc_bounds, lambda d, v: [], _irc, resonant=True),
        Structure("ppf", "positive position feedback and integral", _ppf_bounds, lambda d, v: [], _ppf, resonant=True),
        Structure(
            "internal_model",
            "internal model of modes and delay around notches and integral",
            _notch_bounds,
            _filtered,
            predictor=True,
            resonant=True,
        ),
        Structure("h_infinity", "H-infinity loop shaping", _robust_bounds, _robust),
    )
}
