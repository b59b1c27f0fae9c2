"""A Validation model of a block that is no operator against the unit of the same name; an Example and its reference."""

import library
import numpy as np
import simulate
import twin
from outcome import Outcome, against_reference

from hystfmu.graph import Node

Array = simulate.Array
# no unit of this name: a closed form
CLOSED = {
    "RateFilter": lambda t: _lagged_sine(t, 7.0, 0.05),
    "StateSpace": lambda t: _held_lag(np.sin(7 * np.round(t, 2)), np.exp(-0.01 / 0.05)),
}
# sampled and static classes by rounding, continuous ones by the solver at Tolerance = 1e-10; a block that integrates by
# a rule of its own, by the error of the rule in its table
ROUNDING, SOLVER = 1e-12, 1e-8
SOLVER_HELD = 1e-9  # between samples the input has no derivative
HELD = {"Amplifier", "Modes", "TransferFunction"}  # continuous, with an input that is held between samples
RAMPED = {"TransferFunctionSteady"}  # continuous, with an input that is a ramp between samples
LIMITED = {"SuperTwisting", "LeadLag", "DisturbanceObserver"}  # controllers that the signal drives into their limits
CHAINS = {"BacklashSumDynamics"}  # of several units: test_loops.py

# what the reference of an Example holds
EXAMPLES = {
    "MinorLoops": ["signal.r", "sampled.y", "events.y", "hysteresis.y"],
    "RateDependence": ["slow.r", "slowOutput.y", "fast.r", "fastOutput.y"],
    "StackMovesMass": ["stack.v", "stack.hysteresis.y", "load.s"],
    "AmplifiedStack": ["stack.v", "stack.flange_b.s", "load.s"],
    "Bender": ["bender.v", "bender.hysteresis.y", "bender.flange_b.s"],
    "MagnetostrictiveRod": ["rod.e", "rod.hysteresis.y", "load.s"],
    "StackInLoop": ["reference.r", "delay.y", "load.s"],
    "ChargeDrive": ["command.r", "underVoltage.flange_b.s", "underCharge.flange_b.s"],
    "Cascade": ["reference.r", "inverse.u", "plant.y"],
    "BoucWen": ["reference.r", "controller.u", "plant.y"],
    "Preisach": ["reference.r", "inverse.u", "plant.y"],
    "IpmcNetwork": ["reference.r", "sensor.y", "compensator.u"],
    "Duhem": ["reference.r", "controller.u", "plant.y"],
    "ZhaoTan": ["reference.r", "inverse.u", "plant.y"],
    "SlidingMode": ["reference.r", "controller.u", "plant.y"],
    "SuperTwisting": ["reference.r", "controller.u", "plant.y"],
    "Pid": ["reference.r", "controller.u", "plant.y"],
    "PidObserver": ["reference.r", "inverse.u", "plant.y"],
    "LeadLag": ["reference.r", "inverse.u", "plant.y"],
    "IterativeLearning": ["reference.r", "inverse.u", "plant.y"],
    "ImplicitInverse": ["wanted.r", "inverse.u", "hysteresis.y"],
}
EXAMPLE_TUBE = 1e-5  # a feedback through a sample period


def is_block(name: str) -> bool:
    """Is it a Validation model of a block that is no operator?"""
    parts = name.split(".")
    c = library.classes()[name]
    return len(parts) == 3 and parts[1] == "Validation" and c.tree.type == "model" and parts[2] not in CHAINS


def is_example(name: str) -> bool:
    """Is it a model of the package Examples?"""
    return name.startswith("HystFMU.Examples.")


def compare(name: str) -> Outcome:
    """Simulate a Validation model of a block and compare it with the unit of the same name."""
    model = library.classes()[name]
    c = library.find(str(model.tree.symbols["tested"].type), name)
    assert c is not None
    trajectory = simulate.run(name)
    if c.short_name in CLOSED:
        now = trajectory.at(library.experiment(model)["Interval"])
        expected = CLOSED[c.short_name](now["time"])
        got = np.column_stack([now[f"tested.{p}"] for p in library.ports(c, "RealOutput")])
    else:
        now, got, expected = against_unit(model, trajectory)
    assert len(got) >= 100
    moves = np.ptp(expected, axis=0) > 0
    assert moves.all() or (c.short_name in twin.SHAPES and moves.any()), "an output that does not move tests nothing"
    size = np.abs(expected).max(axis=0)  # a derivative of a triangle or of steps is 0 and must be exactly that
    error = float((np.abs(got - expected).max(axis=0) / np.where(size > 0, size, 1e-300)).max())
    limit = bound(model, c)
    if c.short_name in LIMITED:
        values = twin.tested(model)[1].values
        limited = np.isin(got[:, 0], [values["u_min"], values["u_max"]])
        assert 0.05 < np.mean(limited) < 0.8, "both with and without the limits"
    reference, tube = against_reference(name, now["time"], got, 10 * max(limit, 1e-10))
    return Outcome(
        name, len(got), trajectory.events, trajectory.seconds, error_c=error, bound_c=limit, error_reference=reference,
        tube=tube,
    )  # fmt: skip


def bound(model: library.Class, c: library.Class) -> float:
    """What |Modelica - C core| / max |C core| of a model of the class c may be."""
    block = twin.TWINS.get(c.short_name)
    if block is not None and block.tolerance == "integration":
        return block.rule_error
    if (block is not None and block.rate != "continuous") or "Ts" in library.parameters(c):
        return ROUNDING
    return SOLVER_HELD if model.short_name in HELD else SOLVER


def against_unit(model: library.Class, trajectory: simulate.Trajectory) -> tuple[dict[str, Array], Array, Array]:
    """Rows of a simulation at its instants, outputs there, and what the unit gives for the recorded inputs."""
    _, node, step = twin.tested(model)
    if model.short_name in RAMPED:
        node = Node(node.name, node.block.name, node.dims, {**node.values, "hold": "foh"})
    now = trajectory.at(step)
    u = twin.columns(now, node, "input")
    if model.short_name in HELD:
        # the input of row k is what was held from instant k - 1 to instant k, whose left limit is the output
        u = np.vstack([u[:1], u[:-1]])
        now = trajectory.at(step, "left")
    return now, twin.columns(now, node, "output"), twin.run(node, u, step)


def _held_lag(u: Array, a: float) -> Array:
    """q+ = a q + (1 - a) u from rest, the first row without a step."""
    weights = a ** np.arange(len(u))
    return (1 - a) * np.array([[u[1 : k + 1] @ weights[:k][::-1]] for k in range(len(u))])


def _lagged_sine(t: Array, omega: float, T: float) -> Array:
    """T r' = sin(omega t) - r, r(0) = 0: r and r'."""
    size = 1 + (omega * T) ** 2
    r = (np.sin(omega * t) - omega * T * (np.cos(omega * t) - np.exp(-t / T))) / size
    return np.column_stack([r, (np.sin(omega * t) - r) / T])


def compare_example(name: str) -> Outcome:
    """Simulate an Example and compare it with its reference; what it should give otherwise is in test_loops.py."""
    trajectory = simulate.run(name)
    rows = trajectory.values
    got = np.column_stack([rows[n] for n in EXAMPLES[name.rsplit(".", 1)[-1]]])
    error, tube = against_reference(name, rows["time"], got, EXAMPLE_TUBE)
    return Outcome(name, len(got), trajectory.events, trajectory.seconds, error_reference=error, tube=tube)
