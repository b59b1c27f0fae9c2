"""One Validation model of a block against the C core, the plain numpy form and the committed reference.

The inputs are those that the simulation recorded.  Sampled: the rows just after the instants k Ts.  Events: every row,
since the memory sees the whole input.  Smooth: every row, and the true input at a fine grid between them, so that no
extremum is missed by the two discrete forms.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import library
import numpy as np
import numpy_forms
import simulate
from numpy.typing import NDArray

from hystfmu.core import BlockType, block_types
from hystfmu.graph import Graph, Node

Array = simulate.Array
TWINS = {t.class_name: t for t in block_types().values()}
# classes that are one shape of a unit
SHAPES: dict[str, tuple[BlockType, dict[str, object]]] = {
    name: (TWINS["Reference"], {"shape": shape})
    for name, shape in {
        "Sine": "sine",
        "Triangle": "triangle",
        "DecayingSine": "decaying_sine",
        "Multisine": "multisine",
        "Steps": "steps",
        "RandomReversals": "random_reversals",
    }.items()
}
# no unit of this name: a closed form
CLOSED = {
    "RateFilter": lambda t: _lagged_sine(t, 7.0, 0.05),
    "StateSpace": lambda t: _held_lag(np.sin(7 * np.round(t, 2)), np.exp(-0.01 / 0.05)),
}
KINDS = ("Sampled", "Events", "Smooth")
RECORDING = False  # set by report.py --record alone
REFERENCES = library.ROOT / "Resources" / "ReferenceResults"
ROUNDING = 1e-12  # Sampled and Events, |difference| / max |output|
THIN = 3  # every third row for the plain forms, which look at the whole history at each
# Smooth: the solver at Tolerance = 1e-10, corners of the input's rate included; plays with a corner rounded over
# width = 1e-3, weights up to 10 in sum; Zhao-Tan and Ma have the 50 pieces of their branch besides.
SMOOTH = {"BoucWen": 1e-5, "BoucWenKnee": 1e-5, "Duhem": 1e-5, "Creep": 1e-5, "CreepSteady": 1e-5}
WIDTH, POLYGON = 1e-3, 2e-3
C_BOUNDS = {
    # 1.1e-12 measured: the time of a reversal is that of the solver
    ("Events", "BoucWenKnee"): 1e-11,
    # the branch of the inverse starts vertically: rounding of 1e-13 at a reversal is its root in x
    ("Events", "ZhaoTanInverse"): 1e-6,
}
# plain Runge-Kutta with a corner at 0; a staircase of many loops
NUMPY_BOUNDS = {"BoucWen": 1e-7, "BoucWenKnee": 1e-7, "Duhem": 1e-7, "Preisach": 1e-5}
ADDED = {"steps"}  # parameters of the library's own integration
FAST = {"PlayBank", "StopBank", "BacklashSum", "PrandtlIshlinskii", "Creep", "BoucWen", "Duhem"}  # in numpy
FORGETS = {"PrandtlIshlinskiiForgets"}  # a full memory: the numpy form has no limit


# classes other than operators: sampled and static blocks by rounding, continuous ones by the solver at 1e-10
HELD = {"TransferFunction"}  # continuous, with an input that is held between samples
OTHER_BOUNDS = {
    "TransferFunction": 1e-9,
    "TransferFunctionSteady": 1e-8,
    "RateFilter": 1e-8,
    "BoucWenOscillator": 1e-5,  # the Newmark steps of the unit, 10 microseconds long
}
CHAINS = {"BacklashSumDynamics", "ImplicitInverse"}  # of several units: test_loops.py, implicit.py


@dataclass(frozen=True)
class Outcome:
    """What the report prints about one model; an error is nan where there is nothing to compare with."""

    name: str
    rows: int
    events: int
    error_c: float
    bound_c: float
    error_numpy: float
    bound_numpy: float
    error_reference: float
    tube: float
    seconds: float

    @property
    def good(self) -> bool:
        return (
            not self.error_c > self.bound_c
            and not self.error_numpy > self.bound_numpy
            and self.error_reference <= self.tube
        )


def line(o: Outcome) -> str:
    """One row of the report."""
    errors = "  ".join(f"{e:8.1e}" for e in (o.error_c, o.error_numpy, o.error_reference))
    return f"{o.name:58} {o.rows:6} {o.events:4}  {errors}  {o.seconds:5.1f}  {'good' if o.good else 'BAD'}"


# what the reference of an Example holds
EXAMPLES = {
    "MinorLoops": ["signal.r", "sampled.y", "events.y", "hysteresis.y"],
    "RateDependence": ["slow.r", "slowOutput.y", "fast.r", "fastOutput.y"],
    "PiezoStack": ["stack.v", "stack.stroke", "load.s"],
    "Cascade": ["reference.r", "inverse.u", "plant.y"],
    "SlidingMode": ["reference.r", "controller.u", "plant.y"],
    "SuperTwisting": ["reference.r", "controller.u", "plant.y"],
    "Pid": ["reference.r", "controller.u", "plant.y"],
    "PidObserver": ["reference.r", "inverse.u", "plant.y"],
    "LeadLag": ["reference.r", "inverse.u", "plant.y"],
    "IterativeLearning": ["reference.r", "inverse.u", "plant.y"],
    "ImplicitInverse": ["wanted.r", "inverse.u", "hysteresis.y"],
}


TUBE = {"Sampled": 1e-9, "Events": 1e-9, "Smooth": 1e-5}


def is_operator(name: str) -> bool:
    """Is it a Validation model of an operator or inverse?"""
    parts = name.split(".")
    return len(parts) == 4 and parts[1] == "Validation" and parts[2] in KINDS and parts[3] not in CHAINS


def is_other(name: str) -> bool:
    """Is it a Validation model of another block?"""
    parts = name.split(".")
    c = library.classes()[name]
    return len(parts) == 3 and parts[1] == "Validation" and c.tree.type == "model" and parts[2] not in CHAINS


def is_example(name: str) -> bool:
    """Is it a model of the package Examples?"""
    return name.startswith("HystFMU.Examples.")


def is_realisation(name: str, package: str) -> bool:
    """Is it a block in Sampled, Events or Smooth of Operators or Inverse?"""
    parts = name.split(".")
    return len(parts) == 4 and parts[1] == package and parts[2] in KINDS


def kind_of(name: str) -> str:
    return name.split(".")[2]


def bound(kind: str, short_name: str) -> float:
    """What |Modelica - C core| / max |C core| may be."""
    if kind != "Smooth":
        return C_BOUNDS.get((kind, short_name), ROUNDING)
    if short_name in SMOOTH:
        return SMOOTH[short_name]
    return POLYGON if short_name in ("ZhaoTan", "ConstraintFactor") else WIDTH


def twin_of(block: str) -> BlockType:
    """The C block of an operator; a stop is what a play leaves of its input."""
    return TWINS["PlayBank" if block == "StopBank" else block]


def operator(name: str) -> tuple[str, Node, float]:
    """Block of a Validation model of an operator, its C node, its step."""
    model = library.classes()[name]
    tested = model.tree.symbols["tested"]
    block = str(tested.type).rsplit(".", 1)[-1]
    kind = twin_of(block)
    values = {k: library.evaluate(e, {}) for k, e in library.modifiers(tested.class_modification).items()}
    step = values.pop("Ts", library.experiment(model)["Interval"])
    values = {k: v for k, v in values.items() if k not in ADDED}
    dims = {d.name: values.pop(d.name) for d in kind.dims if d.name in values}
    return block, Node("tested", kind.name, dims, values), float(step)


def values_of(node: Node) -> dict[str, object]:
    """Every parameter of a node in plain numbers, defaults included; a choice is its word."""
    found: dict[str, object] = dict(node.dims)
    for v in node.block.parameters:
        value = node.value(v.name)
        found[v.name] = (
            v.choices[int(value[0])] if v.choices else np.asarray(value) if v.size != "1" else float(value[0])
        )
    return found


def columns(values: dict[str, Array], kind: BlockType, node: Node, role: str) -> Array:
    blocks = [simulate.port(values, "tested", v.name, node.sizes[v.name]) for v in kind.of(role)]
    return np.hstack(blocks) if blocks else np.zeros((len(values["time"]), 0))


def run_c(block: str, node: Node, u: Array, h: float) -> Array:
    kind = node.block
    y = Graph.single(node).executor().run(u[:, None], sum(node.sizes[v.name] for v in kind.of("output")), h)
    return np.asarray(u[:, None] - y if block == "StopBank" else y)


def relative(got: Array, expected: Array) -> float:
    """Largest difference over the largest value; the columns of one port share their scale."""
    return float(np.abs(got - expected).max() / np.abs(expected).max())


def compare(name: str, out: Path) -> Outcome:
    """Simulate a Validation model of an operator and hold it against the three."""
    kind, short_name = kind_of(name), name.rsplit(".", 1)[-1]
    block, node, h = operator(name)
    began = time.perf_counter()
    trajectory = simulate.run(name, out)
    seconds = time.perf_counter() - began
    rows = trajectory.at(h) if kind == "Sampled" else trajectory.values
    signal = "s" if block == "StopBank" else ""
    u = columns(rows, node.block, node, "input")[:, 0]
    outputs = [v.name for v in node.block.of("output")]
    got = np.hstack(
        [simulate.port(rows, "tested", signal or o, node.sizes[o]) for o in outputs],
    )
    if kind == "Smooth":
        driven, keep, step = fine(name, rows["time"], 2e-5)
        plain_driven, plain_keep, plain_step = fine(name, rows["time"], 2e-5 if block in FAST else 1e-4)
    else:
        driven, keep, step = plain_driven, plain_keep, plain_step = u, np.arange(len(u)), h
    expected = run_c(block, node, driven, step)[keep]
    assert np.ptp(expected, axis=0).min() > 0, "an output that does not move tests nothing"
    plain = float("nan")
    if short_name not in FORGETS:
        form = numpy_forms.outputs(block, plain_driven, values_of(node), plain_step, plain_keep[::THIN])
        plain = relative(got[::THIN], form)
    rising = rows.get("tested.rising")
    return Outcome(
        name,
        len(got),
        int(np.count_nonzero(np.diff(rising))) if rising is not None else 0,
        relative(got, expected),
        bound(kind, short_name),
        plain,
        max(bound(kind, short_name), NUMPY_BOUNDS.get(short_name, 0.0)),
        against_reference(name, rows["time"], got),
        TUBE[kind],
        seconds,
    )


def compare_other(name: str, out: Path) -> Outcome:
    """Simulate a Validation model of another block and hold it against the unit of the same name."""
    model = library.classes()[name]
    tested = model.tree.symbols["tested"]
    c = library.find(str(tested.type), name)
    assert c is not None
    began = time.perf_counter()
    trajectory = simulate.run(name, out)
    seconds = time.perf_counter() - began
    if c.short_name in CLOSED:
        now = trajectory.at(library.experiment(model)["Interval"])
        expected = CLOSED[c.short_name](now["time"])
        got = np.column_stack([now[f"tested.{p}"] for p in library.ports(c, "RealOutput")])
    else:
        now, got, expected = against_unit(model, c, trajectory)
    assert len(got) >= 100
    moves = np.ptp(expected, axis=0) > 0
    assert moves.all() or (c.short_name in SHAPES and moves.any()), "an output that does not move tests nothing"
    size = np.abs(expected).max(axis=0)  # a derivative of a triangle or of steps is 0 and must be exactly that
    error = float((np.abs(got - expected).max(axis=0) / np.where(size > 0, size, 1e-300)).max())
    limit, nan = OTHER_BOUNDS.get(model.short_name, ROUNDING), float("nan")
    reference = against_reference(name, now["time"], got)
    return Outcome(name, len(got), 0, error, limit, nan, nan, reference, 10 * max(limit, 1e-10), seconds)


def against_unit(
    model: library.Class, c: library.Class, trajectory: simulate.Trajectory
) -> tuple[dict[str, Array], Array, Array]:
    """Rows of a simulation at its instants, outputs there, and what the unit gives for the recorded inputs."""
    tested = model.tree.symbols["tested"]
    kind, extra = SHAPES[c.short_name] if c.short_name in SHAPES else (TWINS[c.short_name], {})
    values = {k: library.evaluate(e, {}) for k, e in library.modifiers(tested.class_modification).items()}
    step = values.pop("Ts", library.experiment(model)["Interval"])
    dims = {d.name: values.pop(d.name) for d in kind.dims if d.name in values}
    if model.short_name == "TransferFunctionSteady":
        extra = {"hold": "foh"}  # its input is a ramp between the samples
    node = Node("tested", kind.name, dims, values | extra)
    now, before = trajectory.at(step), trajectory.at(step, "left")
    u = columns(now, kind, node, "input")
    if model.short_name in HELD:
        # the input of row k is what was held from instant k - 1 to instant k, whose left limit is the output
        u = np.vstack([u[:1], u[:-1]])
        now = before
    expected = Graph.single(node).executor().run(u, sum(node.sizes[v.name] for v in kind.of("output")), step)
    return now, columns(now, kind, node, "output"), np.asarray(expected)


def _held_lag(u: Array, a: float) -> Array:
    """q+ = a q + (1 - a) u from rest, the first row without a step."""
    weights = a ** np.arange(len(u))
    return (1 - a) * np.array([[u[1 : k + 1] @ weights[:k][::-1]] for k in range(len(u))])


def _lagged_sine(t: Array, omega: float, T: float) -> Array:
    """T r' = sin(omega t) - r, r(0) = 0: r and r'."""
    size = 1 + (omega * T) ** 2
    r = (np.sin(omega * t) - omega * T * (np.cos(omega * t) - np.exp(-t / T))) / size
    return np.column_stack([r, (np.sin(omega * t) - r) / T])


def compare_example(name: str, out: Path) -> Outcome:
    """Simulate an Example and hold it against its reference; what it should give otherwise is in test_loops.py."""
    began = time.perf_counter()
    rows = simulate.run(name, out).values
    seconds = time.perf_counter() - began
    got = np.column_stack([rows[n] for n in EXAMPLES[name.rsplit(".", 1)[-1]]])
    reference = against_reference(name, rows["time"], got)
    nan = float("nan")
    return Outcome(name, len(got), 0, nan, nan, nan, nan, reference, TUBE["Smooth"], seconds)


def fine(name: str, t: Array, h: float) -> tuple[Array, NDArray[np.int64], float]:
    """The input of a Validation model at a grid of step h, the places of the times t in it, and h.

    The value that is held over a step is the one of its middle: second order for the linear lags.
    """
    keep = np.rint(t / h).astype(np.int64)
    tested = library.classes()[name].tree.symbols["tested"]
    creeps = str(tested.type).endswith("Creep")
    signal = library.classes()[name].tree.symbols["signal"]
    v = {k: library.evaluate(e, {}) for k, e in library.modifiers(signal.class_modification).items()}
    grid = np.maximum(h * (np.arange(keep[-1] + 1) - (0.5 if creeps else 0.0)), 0.0)
    return v["offset"] + v["amplitude"] * signal_form(grid), keep, h


def signal_form(t: Array) -> Array:
    """Validation.BaseClasses.TestSignal, written once more."""
    pieces = [
        np.sin(2 * np.pi * 10 * t),
        0.6 * np.sin(2 * np.pi * 10 * (t - 0.2)) + 0.35 * np.sin(2 * np.pi * 40 * (t - 0.2)),
        np.exp(-6 * (t - 0.5)) * np.sin(2 * np.pi * 30 * (t - 0.5)),
        np.interp(
            t, [0.8, 0.85, 0.9, 0.92, 0.95, 1.0, 1.001, 1.05, 1.051], [0, 0.7, 0.7, 0.9, 0.9, 0.2, -0.8, -0.8, 0.6]
        ),
        0.6 * np.cos(2 * np.pi * (t - 1.1) / 0.15) + 0.01 * np.sin(2 * np.pi * 120 * (t - 1.1)),
    ]
    return np.choose(np.searchsorted([0.2, 0.5, 0.8, 1.1], t, side="right"), pieces)


def reference_file(name: str) -> Path:
    return REFERENCES.joinpath(*name.split(".")[1:]).with_suffix(".csv")


def against_reference(name: str, t: Array, got: Array) -> float:
    """Largest distance to the committed reference, relative to its largest value; nan if there is none."""
    file = reference_file(name)
    if RECORDING:
        record(file, t, got)
    if not file.is_file():
        return float("nan")
    table = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    at = np.searchsorted(t, table[:, 0] + 1e-9) - 1
    assert np.abs(t[at] - table[:, 0]).max() < 1e-9, "the simulation has no row at a time of the reference"
    return relative(got[at], table[:, 1:])


def record(file: Path, t: Array, got: Array) -> None:
    """Write the reference of a model: its outputs at about a hundred rows, if possible none at an event."""
    after = np.diff(t, append=t[-1] + 1) > 1e-9
    alone = np.flatnonzero((np.diff(t, prepend=-1.0) > 1e-9) & after)
    if len(alone) < 50:  # every row is a sample: its right limit
        alone = np.flatnonzero(after)
    at = alone[:: max(len(alone) // 100, 1)]
    file.parent.mkdir(parents=True, exist_ok=True)
    header = ",".join(["time", *(f"output_{i + 1}" for i in range(got.shape[1]))])
    np.savetxt(file, np.column_stack([t[at], got[at]]), "%.12g", ",", header=header, comments="")
