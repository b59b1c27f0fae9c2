"""Exported models: every kind from a small fit, its Example simulated by rumoca and compared with `predict`."""

import re
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import form
import library
import lint
import numpy as np
import simulate

from hystfmu import Dataset, Graph, Node
from hystfmu.identify import METHODS, fit
from hystfmu.model import Model
from hystfmu.modelica import export_modelica
from hystfmu.modelica.block import rated_ports
from hystfmu.modelica.measures import si, zero
from hystfmu.modelica.package import CLASSES, package_name
from hystfmu.modelica.ports import names
from hystfmu.modelica.realisation import kinds

Array = simulate.Array
KEYS = tuple(k for k in METHODS if k != "auto")  # auto chooses one of the others
CONTINUOUS_KEYS = tuple(  # kinds that have a continuous realisation
    k
    for k in KEYS
    if not k.endswith("_oscillator")
    and k not in ("lugre", "modified_bouc_wen", "narx_network", "polynomial_narx", "rate_mlp")
)
CONTINUOUS_BOUND = {"Events": 2e-4, "Smooth": 1e-3}  # creep is exact here, discretised there; corners and polygons
ROUNDING = 1e-12  # |Modelica - predict| / span of predict
OSCILLATORS = ("bouc_wen_oscillator", "duhem_oscillator", "maxwell_slip_oscillator")
QUICK: dict[str, Any] = {"starts": 1, "iterations": 10, "hidden": 3}
OPTIONS: dict[str, dict[str, Any]] = {
    "prandtl_ishlinskii": {"N": 8}, "zhao_tan_mlp": {**QUICK, "range": 1.0}, "constraint_factor_mlp": {**QUICK, "m": 3},
    "fitted_operator_mlp": {**QUICK, "N": 8}, "play_bank_mlp": {**QUICK, "N": 4},
    "krasnoselskii_pokrovskii": {"levels": 4}, "preisach": {"n": 6, "widths": 4, "means": 2, "rate": "yes"},
    "polynomial_narx": {"n_u": 2, "n_f": 2, "n_y": 1},
    "narx_network": {"lags": 2, "hidden": 2, "one_step": 10, "iterations": 5}, "bouc_wen": {"starts": 1},
    "duhem": {"q": 2}, "rate_mlp": {**QUICK, "N": 4}, "actuator": {"N": 6, "dynamics": "no", "creep": "yes"},
    "g0_prandtl_ishlinskii": {"N": 6},
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What the report prints about one exported model."""

    name: str
    values: int
    rows: int
    error: float
    bound: float
    seconds: float

    @property
    def good(self) -> bool:
        return self.error <= self.bound


def small(key: str) -> Model:
    """A model of that kind, fitted to 400 rows of a bent play or, for the oscillator, of an oscillator."""
    h = 1e-3
    t = h * np.arange(400)
    u = np.exp(-3 * t) * np.sin(2 * np.pi * 10 * t)
    if key in OSCILLATORS:
        f = np.arange(5, 150, 5)
        u = 10 * np.cos(2 * np.pi * np.outer(t, f) + np.random.default_rng(0).uniform(0, 6, len(f))).sum(axis=1)
        y = Graph.single(Node("plant", "bouc_wen_oscillator")).run(u, h)[:, 0]
    else:
        play, y = 0.0, np.empty(len(u))
        for k, v in enumerate(u):
            play = max(v - 0.2, min(v + 0.2, play))
            y[k] = v + 2 * play + 0.3 * play**2
    return fit(Dataset.from_signal(u, y, h, "bent play"), key, **OPTIONS.get(key, {}))


def simulated(package: Path, file: Path | None = None) -> dict[str, Array]:
    """The Example of a package, or the model of another file of it: what it has at 0, Ts, 2 Ts, ..."""
    file = file or package / "Example.mo"
    found = simulate.as_stated(file, f"{package.name}.{file.stem}", (library.ROOT, package))
    return found.at(library.experiment_of(file.read_text())["Interval"])


def complaints(package: Path) -> list[str]:
    """What the second parser, the lint and the form of a folder have against a package."""
    found = list(form.order_complaints(package))
    for file in package.glob("*.mo"):
        found += form.place_complaints(file, package.parent)
        found += form.encoding_complaints(file)
    with library.beside(package) as classes:
        return found + [complaint for c in classes for complaint in lint.complaints(c)]


def compare(model: Model, name: str, folder: Path) -> Outcome:
    """Export a model with one output, simulate it, and compare it with `predict`."""
    package = export_modelica(model, folder, package_name(name), "a test")
    assert complaints(package) == []
    began = time.perf_counter()
    rows = simulated(package)
    seconds = time.perf_counter() - began
    u, *others, y = columns(model, rows)
    if model.key in OSCILLATORS:
        expected = fine(model, rows["time"])
    else:
        expected = model.predict(np.column_stack([u, *others]) if others else u).reshape(len(u), -1)[:, 0]
    assert len(u) >= 399
    assert np.ptp(u) > 0
    assert np.ptp(expected) > 0, "an output that does not move tests nothing"
    error = float(np.abs(y - expected).max() / np.ptp(expected))
    values = sum(n.parameters().size for n in model.graph.nodes)
    return Outcome(name, values, len(u), error, bound(model), seconds)


def columns(model: Model, rows: dict[str, Array]) -> list[Array]:
    """Inputs and first output of the block in an Example, in the units of measure of the model."""
    ports, _ = names(model.graph, set(CLASSES), rated_ports(model.graph))
    found = (*model.graph.inputs, model.graph.outputs[0])
    return [(rows[f"tested.{ports[p.name]}"] - zero(p.unit)) / si(p.unit)[1] for p in found]


def compare_realisations(model: Model, name: str, folder: Path) -> list[Outcome]:
    """Export a model and hold its continuous realisations, put into its Example, against `predict` at fine steps.

    Events are exact but for the dynamics, which the unit discretises; Smooth rounds corners, and replaces a bent branch
    by a polygon.
    """
    package = export_modelica(model, folder, package_name(name), "a test")
    found = []
    for kind in kinds(model.graph):
        file = package / f"In{kind}.mo"
        experiment = re.search(r"experiment\([^)]*\)", (package / "Example.mo").read_text())
        assert experiment is not None
        file.write_text(
            f"within {package.name}; model In{kind} import HystFMU; extends Example(redeclare {kind} tested); "
            f"annotation ({experiment[0]}); end In{kind};"
        )
        began = time.perf_counter()
        rows = simulated(package, file)
        seconds = time.perf_counter() - began
        y = columns(model, rows)[-1]
        expected = fine(model, rows["time"])
        error = float(np.abs(y - expected).max() / np.ptp(expected))
        values = sum(n.parameters().size for n in model.graph.nodes)
        found.append(Outcome(f"{name}.{kind}", values, len(y), error, CONTINUOUS_BOUND[kind], seconds))
    return found


def bound(model: Model) -> float:
    """What |Modelica - predict| / span of predict may be: rounding, or the error of the rule of a continuous block."""
    return max([ROUNDING, *(n.block.rule_error for n in model.graph.nodes if n.block.rate == "continuous")])


def fine(model: Model, t: Array, times: int = 100) -> Array:
    """`predict` at steps of a hundredth of the sample period, for the input of the Example in between."""
    assert model.step is not None
    low, high = model.provenance["span_u"]
    f = 1 / (100 * model.step)
    h = model.step / times
    at = h * np.arange((len(t) - 1) * times + 1)
    u = (high + low) / 2 + (high - low) / 2 * np.exp(-f / 2 * at) * np.sin(2 * np.pi * f * at)
    ports = len(model.graph.inputs)  # the signal drives all of them
    return model.predict(np.column_stack([u] * ports) if ports > 1 else u, h).reshape(len(u), -1)[::times, 0]


def line(o: Outcome) -> str:
    """One row of the report."""
    return f"{o.name:58} {o.values:6} {o.rows:5} {o.error:9.1e}  {o.seconds:5.1f}  {'good' if o.good else 'BAD'}"
