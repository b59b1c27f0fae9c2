"""Makes the models of scenarios/papers: each box of the papers' block diagrams is a model file, later an FMU.

    python scenarios/models/make_paper_models.py

Zhao & Tan 2008: ten backlashes at rest, one decaying sine of 5 Hz at 1 kHz.  Model and inverse are trained on its first
half, the inverse with input and output exchanged and with the paper's inverse operator.  Of five seeds each is the one
whose largest error on the second half is the median.
Yu & Alici 2005: figs. 6 to 8 one after the other through hysteresis and G0; the inverse is a network on (y, dy/dt).
IPMC: a decaying sine of 10 Hz through the synthetic sensor, and the network on it.  The compensator is trained with
voltage and displacement exchanged, on sines and random reversals of 1, 2, 5 and 10 Hz.

Every record goes through a CSV file, as a measurement would: an inverse names the columns the other way round, as
`hystfmu fit record.csv --input y --output u` does.
"""

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from make_models import backlash, bouc_wen, save

from hystfmu.data import Dataset
from hystfmu.data.reader.reading import read
from hystfmu.data.signals import decaying_sine
from hystfmu.graph import Graph, Input, Node, Output, Value
from hystfmu.identify import fit
from hystfmu.model import Model
from papers.ipmc_sensor import BEND, DRIFT, LAG, RADII, STROKE, W0, WEIGHTS, ipmc, sensor
from papers.ipmc_sensor import RATE as IPMC_RATE
from papers.rate_plant import FIGURES, excitation


def columns(record: Dataset, name: str, exchanged: bool = False, train: slice | None = None) -> Dataset:
    """Columns t, u, y of a CSV file of the record; `exchanged` takes y as input and u as output."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        record.to_csv(path)
        data = read(path, "t", *(("y", "u") if exchanged else ("u", "y")), train=train)
    return replace(data, name=name, path="")


# ---- Zhao & Tan 2008 ---------------------------------------------------------------------------------------------
ROWS, CYCLE, STEP = 1200, 200, 1e-3
VIRGIN = CYCLE // 4  # rows of the virgin curve, which no later loop repeats
DECAY = 0.03  # per cycle; the paper does not print it
SEEDS = 5
WIDTHS = np.linspace(0.1, 1, 10)


def zhao_tan_actuator() -> Graph:
    """Ten backlashes of full widths 0.1 .. 1, scaled so that an input of +-1 gives +-1."""
    r = WIDTHS / 2
    w = np.full(len(r), 1 / np.sum(1 - r))
    return Graph.single(Node("actuator", "backlash_sum", {"n": len(r)}, {"w0": 0.0, "r": r, "w": w}))


def zhao_tan_record() -> Dataset:
    """Input and response of the decaying sine, both with a largest value of 1."""
    u = decaying_sine(ROWS / CYCLE, DECAY, CYCLE)[:ROWS]
    u = u / np.abs(u).max()
    y = zhao_tan_actuator().run(u[:, None], STEP)
    return Dataset.from_signal(u, y / np.abs(y).max(), STEP, "decaying sine of 5 Hz", slice(VIRGIN, None))


def zhao_tan_models() -> dict[str, Model]:
    """The actuator, and operator and network of the model and of the inverse."""
    record = zhao_tan_record()
    half = slice(VIRGIN, ROWS // 2)
    model = median_of_seeds(columns(record, record.name, train=half))
    inverse = median_of_seeds(
        columns(record, f"{record.name}, exchanged", exchanged=True, train=half), operator="zhao_tan_inverse"
    )
    actuator = Model("actuator", zhao_tan_actuator(), None, "ten backlashes of full widths 0.1 .. 1")
    return {
        "zhao_tan_actuator": actuator,
        **parts(model, "zhao_tan_operator", "zhao_tan_network"),
        **parts(inverse, "zhao_tan_inverse_operator", "zhao_tan_inverse_network"),
    }


def median_of_seeds(data: Dataset, **options: str) -> Model:
    """The network whose largest error on the second half of the record is the median over the seeds."""
    models = [fit(data, "zhao_tan_mlp", seed, **options) for seed in range(SEEDS)]
    second = slice(ROWS // 2, None)
    return sorted(models, key=lambda m: np.abs(m.predict(data.u)[second] - data.y[second]).max())[SEEDS // 2]


def parts(model: Model, operator: str, network: str) -> dict[str, Model]:
    """A model with a network on (x, h) as two: the operator with its scaling, and the network."""
    g = model.graph
    front = [n for n in g.nodes if n.name in ("input", "operator")]
    behind = [n for n in g.nodes if n not in front]
    inner = {n.name for n in front}
    crossing = [(a, b) for a, b in g.wires if a.split(".")[0] in inner and b.split(".")[0] not in inner]
    names = dict(zip(dict.fromkeys(a for a, _ in crossing), ("x", "h"), strict=True))
    texts = {"x": "scaled input", "h": "output of the operator"}
    outputs = [Output(name, source, text=texts[name]) for source, name in names.items()]
    inputs = [
        Input(name, tuple(b for a, b in crossing if a == source), text=texts[name]) for source, name in names.items()
    ]

    def wires(nodes: list[Node]) -> list[tuple[str, str]]:
        own = {n.name for n in nodes}
        return [(a, b) for a, b in g.wires if a.split(".")[0] in own and b.split(".")[0] in own]

    first = Graph(front, wires(front), g.inputs, outputs)
    second = Graph(behind, wires(behind), inputs, g.outputs)
    return {
        operator: Model("operator", first, model.step, f"operator of {model.text}", {}, model.provenance),
        network: Model("network", second, model.step, f"network of {model.text}", model.fit, model.provenance),
    }


# ---- Yu & Alici 2005 ---------------------------------------------------------------------------------------------
RATE, FINER = 10e3, 10


def yu_alici_record(plant: Graph, name: str) -> Dataset:
    """Figs. 6 to 8 through hysteresis and G0, 0.1 % noise."""
    u = 1.4 * np.concatenate([excitation(f, rate=FINER * RATE) for f in FIGURES])
    held = np.append(u[0], (u[1:] + u[:-1]) / 2)  # the plant holds its input, so it gets the mean over each fine step
    y = plant.run(np.column_stack([held, 0 * held]), 1 / (FINER * RATE))[::FINER]
    y = y + 1e-3 * np.random.default_rng(1).normal(size=len(y))
    return Dataset.from_signal(u[::FINER], y, 1 / RATE, f"{name}: figs. 6 to 8")


def yu_alici_models() -> dict[str, Model]:
    """For each plant the network inverse of the paper, u from (y, dy/dt)."""
    models = {}
    for name, plant in (("backlash", backlash), ("bouc_wen", bouc_wen)):
        d = yu_alici_record(plant(True), name)
        models[f"yu_alici_{name}_inverse"] = fit(
            columns(d, d.name, exchanged=True), "rate_mlp", memory="none", hidden=12, starts=3
        )
    return models


# ---- IPMC sensor -------------------------------------------------------------------------------------------------
F_SINE, CYCLES, TRAINED = 10.0, 10, 0.1  # Hz, cycles, decay per cycle; the paper prints none of them


def ipmc_sensor() -> Graph:
    """Displacement (mm) -> voltage (mV): plays, a bend, a lag and the drift of `papers.ipmc_sensor`."""
    size = W0 + np.sum(WEIGHTS * (1 - RADII))
    lags = [Node(f"drift_{i}", "transfer_function", {}, first_order(T)) for i, (_, T) in enumerate(DRIFT, 1)]
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / STROKE}),
        Node("plays", "backlash_sum", {"n": len(RADII)}, {"w0": W0 / size, "r": RADII, "w": WEIGHTS / size}),
        Node("bend", "polynomial_narx", {"n_u": 1, "n_f": 0, "n_y": 0, "q": 2, "n_k": 0}, {"theta": [1.0, BEND, 0.0]}),
        Node("lag", "transfer_function", {}, first_order(LAG)),
        *lags,
        Node("voltage", "sum", {"n": 1 + len(lags)}, {"k": [1.0, *(share for share, _ in DRIFT)]}),
    ]
    wires = [("input.y", "plays.u"), ("plays.y", "bend.u"), ("bend.y", "lag.u"), ("lag.y", "voltage.u[1]")]
    for i, lag in enumerate(lags, 2):
        wires += [("lag.y", f"{lag.name}.u"), (f"{lag.name}.y", f"voltage.u[{i}]")]
    return Graph(nodes, wires, [Input("u", ("input.u",), "mm")], [Output("y", "voltage.y", "mV")])


# ---- IPMC sensor in a loop: the network learns while it runs ---------------------------------------------------------
LATE = 5  # samples between the two voltages of the network
MONOMIALS = [(0,), (1,), (2,), (0, 0), (0, 2), (2, 2)]  # of voltage, its change, f


def ipmc_regressors() -> Graph:
    """Voltage (mV) -> monomials up to order 2 of it and of f, its change in `LATE` samples, and 1."""
    nodes = [
        Node("input", "scaling"),
        Node("before", "delay", {"n": LATE}),
        Node("change", "sum", {"n": 2}, {"k": np.array([10.0, -10.0])}),
        Node("f", "zhao_tan"),
        Node("one", "scaling", {}, {"gain": 0.0, "offset": 1.0}),
    ]
    sources = ("input.y", "change.y", "f.h")
    wires = [("input.y", "before.u"), ("input.y", "change.u[1]"), ("before.y", "change.u[2]")]
    wires += [("input.y", "f.x"), ("input.y", "one.u")]
    ends = []
    for k, factors in enumerate(MONOMIALS, 1):
        source = sources[factors[0]]
        if len(factors) == 2:
            nodes.append(Node(f"square_{k}", "product", {"n": 2, "m": 0}))
            wires += [(sources[i], f"square_{k}.u[{j}]") for j, i in enumerate(factors, 1)]
            source = f"square_{k}.y"
        ends.append(Output(f"phi_{k}", source))
    return Graph(nodes, wires, [Input("u", ("input.u",), "mV")], [*ends, Output(f"phi_{len(ends) + 1}", "one.y")])


def ipmc_weighted() -> Graph:
    """Weighted sum of the regressors, weights and regressors as inputs -> displacement (mm)."""
    n = len(MONOMIALS) + 1
    nodes = [Node(f"term_{k}", "product", {"n": 2, "m": 0}) for k in range(1, n + 1)]
    total = Node("displacement", "sum", {"n": n}, {"k": np.ones(n)})
    wires = [(f"term_{k}.y", f"displacement.u[{k}]") for k in range(1, n + 1)]
    inputs = [
        Input(f"{name}_{k}", (f"term_{k}.u[{i}]",)) for i, name in ((1, "phi"), (2, "theta")) for k in range(1, n + 1)
    ]
    return Graph([*nodes, total], wires, inputs, [Output("y", "displacement.y", "mm")])


def ipmc_first_weights() -> np.ndarray:
    """Weights of least squares on a record of 1 to 3 Hz with random reversals, as the scenario starts from."""
    record = ipmc(40, (1.0, 2.0, 3.0), seed=1)
    phi = ipmc_regressors().run(record.y[:, None], record.h)
    return np.linalg.lstsq(phi, record.u, rcond=None)[0]


def first_order(T: float) -> dict[str, Value]:
    """1 / (T s + 1), its input linear between samples."""
    return {"b": [1 / T], "a": [1.0, 1 / T], "hold": "foh"}


def ipmc_models() -> dict[str, Model]:
    """The sensor, the paper's network with and without f, and the compensator: displacement from voltage."""
    x = decaying_sine(CYCLES, TRAINED, round(IPMC_RATE / F_SINE))
    noise = 1e-3 * np.random.default_rng(0).normal(size=len(x))
    sine = Dataset.from_signal(STROKE * x, sensor(x) + noise, 1 / IPMC_RATE, "decaying sine of 10 Hz")
    sine = columns(sine, sine.name)
    rich = ipmc(frequencies=(1.0, 2.0, 5.0, 10.0))
    exchanged = columns(rich, "displacement from voltage, 1 to 10 Hz", exchanged=True)
    compensator = fit(exchanged, "polynomial_narx", n_k=0)
    return {
        "ipmc_sensor": Model("sensor", ipmc_sensor(), None, "synthetic IPMC sensor"),
        **parts(fit(sine, "polynomial_narx"), "ipmc_operator", "ipmc_network"),
        "ipmc_network_without_f": fit(sine, "polynomial_narx", n_f=0),
        **parts(compensator, "ipmc_compensator_operator", "ipmc_compensator_network"),
        "ipmc_regressors": Model("regressors", ipmc_regressors(), 1 / IPMC_RATE, "monomials of voltage and f"),
        "ipmc_weighted": Model("weighted", ipmc_weighted(), None, "weighted sum, weights as inputs"),
    }


def main() -> None:
    """Write all models."""
    for name, model in (zhao_tan_models() | yu_alici_models() | ipmc_models()).items():
        save(model, name)


if __name__ == "__main__":
    main()
