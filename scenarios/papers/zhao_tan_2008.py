"""Zhao & Tan 2008: operator with 2-12-1 network, KP model, and series connection of network inverse and actuator.

The measurements of the paper are not published. The input is that of the paper: a decaying sine of 5 Hz, sampled at
1000 Hz and scaled to [-1, 1]. The first half of the 1200 or 2400 samples is used for identification, and the second
half for validation. The actuator is that of section II, simulated in numpy: ten backlash operators with full widths of
0.1 to 1. The paper does not print the decay, the number of samples in each half, and the seed. A scan varies the decay
over `DECAYS` and the number of samples over `SPLITS`. The table uses the values for which the results of the literal
replica are closest to the printed numbers. Results are medians over `SEEDS` seeds.

In the literal replica, a branch of the operator starts at the last extremum. The replica uses 463 Powell-Beale
iterations from one start, a reconstructed inverse operator, and ordinary least squares for the weights of the
Krasnoselskii-Pokrovskii (KP) model. In our method, a branch starts at the last extremum that is not wiped out (dominant
extremum). It uses Levenberg-Marquardt iterations, the exact inverse operator, and KP weights >= 0.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset, signals
from hystfmu.graph import Graph, Node
from hystfmu.identify import errors, fit
from hystfmu.identify.methods.weighted_sums import grid, kernels, ridge
from hystfmu.inverse import inverse
from hystfmu.model import Model, accuracy
from hystfmu.report.plot import Plot
from papers import nested_loops
from papers.nested_loops import STEP, Response, recorded
from papers.statements import zhao_tan_2008 as statements
from papers.table import Report, Row, Stated, curves, nearest, report, scanned

ROW = Stated(__name__)

ROWS, CYCLE = 1200, 200
VIRGIN = CYCLE // 4  # rows of the virgin curve, which are omitted because no later loop repeats them
DECAYS = (0.01, 0.02, 0.03, 0.05, 0.1, 0.2)  # decays per cycle in the scan
SPLITS = (ROWS, 2 * ROWS)  # rows of the record; the first half is for training (600 + 600 or 1200 + 1200)
DECAY = 0.1  # decay of records without a scan
PRINTED, PRINTED_KP, PRINTED_CASCADE = (0.026735, 0.01027), (0.0363, 0.013), 0.0617
LEVELS = 20  # levels of the grid, that is, 210 KP operators
R = np.linspace(0.1, 1, 10) / 2
SEEDS = 5
REVERSALS = 400  # number of reversals in our training data
REPLICA: dict[str, Any] = {"trainer": "powell_beale", "starts": 1, "iterations": 463, "range": 2.0, "decay": 0.0}
LINEAR = 3.0  # weight of the linear term that makes the actuator invertible
ANOTHER = "the record differs from that of the paper"
MARGIN = 0.98  # range of the wanted outputs of the cascade over the range of the plant


def actuator(linear: float = 0.0) -> Response:
    """Return a plant that is the sum of ten backlash operators and `linear` times the input, from rest.

    The output is scaled to [-1, 1].
    """

    def response(u: Array) -> Array:
        z, out = np.zeros(len(R)), np.empty(len(u))
        for k, v in enumerate(u):
            z = np.maximum(v - R, np.minimum(v + R, z))
            out[k] = z.sum() + linear * v
        return out / (np.sum(1 - R) + linear)

    return response


def experiment(plant: Response, decay: float = DECAY, rows: int = ROWS) -> Dataset:
    """Return the record of a plant for the decaying sine of the paper, with input and output scaled to [-1, 1].

    `rows` is the number of samples, and `decay` is the decay per cycle. The training rows do not contain the virgin
    curve.
    """
    u = signals.decaying_sine(rows / CYCLE, decay, CYCLE)[:rows]
    u = u / np.abs(u).max()
    y = plant(u)
    return Dataset.from_signal(u, y / np.abs(y).max(), STEP, "decaying sine", slice(VIRGIN, None))


def quick() -> list[Row]:
    """Return the table rows that take only seconds: tests of lemmas, remarks and theorems, and the network size."""
    return [*statements.rows(actuator(), actuator(LINEAR)), _weights(actuator())]


def table(data: Path | None, progress: Callable[[float], None]) -> Report:
    """Return the table of the paper. `data` is not used. `progress` is called with the completed fraction of the work.

    The targets are the printed validation errors, and limits for the training error, the errors on nested loops, and
    the error of the exact inverse operator.
    """
    plant = actuator()
    validated, scan, (decay, size) = _validation(plant, lambda f: progress(0.3 * f))
    record = experiment(plant, decay, size)
    kp, kp_output = _kp(decay, size)
    cascade, cascades, shown = _cascade(size, lambda f: progress(0.3 + 0.2 * f))
    rows = [*quick(), *validated, *kp, *cascade, *scan, *cascades, *_training()]
    progress(0.6)
    rows += _held_out(plant, lambda f: progress(0.6 + 0.4 * f))
    rows += _beside(decay, size)
    rows += nested_loops.inverse_rows(actuator(LINEAR), REVERSALS)
    straight = actuator(LINEAR)
    for name, kind in (("with linear term", straight), ("the same, asymmetric", nested_loops.bent(straight))):
        rows += nested_loops.implicit_rows(name, kind, REVERSALS)
    drawings = (*_drawings(plant, record, kp_output), *shown)
    progress(1.0)
    return report(
        ROW, tuple(rows), drawings, decays_last=DECAYS[-1], sizes=" or ".join(map(str, SPLITS)), decay=decay, size=size
    )


# ---- model: validation against validation ----------------------------------------------------------------------------
def _validation(plant: Response, progress: Callable[[float], None]) -> tuple[list[Row], list[Row], tuple[float, int]]:
    """Return the table rows of figs. 5 and 6, the table rows of the scan, and the values that the table uses.

    These values are the decay of the sine and the number of rows.
    """
    points = [(decay, size) for size in SPLITS for decay in DECAYS]
    found: dict[tuple[float, int], list[list[dict[str, float]]]] = {}
    for k, point in enumerate(points):
        record = _first_half(experiment(plant, *point))
        found[point] = [
            [_second_half(fit(record, "zhao_tan_mlp", seed, **chosen), record) for seed in range(SEEDS)]
            for chosen in ({"memory": "last", **REPLICA}, {})
        ]
        progress((k + 1) / len(points))
    named = {"max": ("fig. 6", "max"), "rms": ("sec. V.A", "RMS (printed as MSE)")}
    made: dict[tuple[float, int], list[Row]] = {}
    for point, of in found.items():
        name = f"decay {point[0]:g} per cycle, {point[1] // 2} + {point[1] // 2} rows, validation"
        made[point] = [
            Row.over_seeds(f"{name}, {what}", printed, [[e[what] for e in v] for v in of], note=ANOTHER, group="scan")
            for what, printed in zip(named, PRINTED, strict=True)
        ]
    chosen_point = nearest([(p, [r.literal or 0.0 for r in rows]) for p, rows in made.items()], PRINTED)
    rows = [
        replace(
            row,
            quantity=f"2-12-1 network, validation, {what}",
            target=row.printed,
            note=f"at decay {chosen_point[0]:g}, {chosen_point[1]} rows",
            place=place,
            group="",
            scanned=scanned([of[k] for of in made.values()]),
        )
        for k, ((place, what), row) in enumerate(zip(named.values(), made[chosen_point], strict=True))
    ]
    return rows, [r for of in made.values() for r in of], chosen_point


def _weights(plant: Response) -> Row:
    """Return a table row with the number of weights and biases in the network of section IV."""
    model = fit(_first_half(experiment(plant)), "zhao_tan_mlp", iterations=1, starts=1)
    return ROW("weights", ours=float(model.fit["parameters"]))


def _first_half(record: Dataset) -> Dataset:
    return record.with_train((VIRGIN, len(record.u) // 2))


def _second_half(model: Model, data: Dataset) -> dict[str, float]:
    rows = slice(len(data.u) // 2, None)
    return errors(model.predict(data.u)[rows], data.y[rows], data.span)


def _kp(decay: float, size: int) -> tuple[list[Row], Array]:
    """Return the table rows of figs. 7 and 8 (KP model), and the output of our KP model (n,).

    `decay` and `size`, the number of samples, define the record.
    """
    of = {p: _kp_of(experiment(actuator(), *p)) for p in [(d, rows) for rows in SPLITS for d in DECAYS]}
    _, _, other, output = of[decay, size]
    rows = []
    for what, name, printed, place in (
        ("max", "max", PRINTED_KP[0], "fig. 8"),
        ("rms", "RMS (printed as MSE)", PRINTED_KP[1], "sec. V.A"),
    ):
        made = {
            p: Row(f"KP, 210 operators, validation, {name}", printed, a[what], b[what]) for p, (a, b, *_) in of.items()
        }
        note = f"literal: plain least squares; ours: weights >= 0; 40 plays instead: {other[what]:.2g}"
        counts = scanned([*made.values()])
        rows.append(replace(made[decay, size], target=printed, note=note, place=place, scanned=counts))
    return rows, output


def _kp_of(record: Dataset) -> tuple[dict[str, float], dict[str, float], dict[str, float], Array]:
    """Return the validation errors of three models of a record, and the output of our KP model.

    The models are the literal KP model, our KP model, and a sum of plays.
    """
    half = _first_half(record)
    second = slice(len(record.u) // 2, None)
    trained = record.u[half.train]
    a, p1, p2 = grid(float(trained.min()), float(trained.max()), LEVELS)
    columns = np.column_stack([kernels(record.u, a, p1, p2, ridge(-(p1 + p2) / 2, a)), np.ones(len(record.u))])
    plain = columns @ np.linalg.lstsq(columns[half.train], record.y[half.train], rcond=None)[0]
    ours = fit(half, "krasnoselskii_pokrovskii", levels=LEVELS).predict(record.u)
    literal, found = (errors(y[second], record.y[second], record.span) for y in (plain, ours))
    return literal, found, _second_half(fit(half, "prandtl_ishlinskii"), record), ours


def _training() -> list[Row]:
    """Return table rows with the errors on the training rows for a decay of 0.1, and with the time of a fit."""
    data = experiment(actuator(), 0.1)
    found = {}
    for name, chosen in (
        ("literal", {"memory": "last", **REPLICA}),
        ("dominant", REPLICA),
        ("lbfgs", {**REPLICA, "trainer": "lbfgs"}),
        ("ours", {}),
    ):
        found[name] = _median([_timed(data, seed, chosen) for seed in range(SEEDS)])
    literal, ours = found["literal"], found["ours"]
    what = "training error, decay 0.1, all rows,"
    return [
        Row(f"{what} max", None, literal["max"], ours["max"], 0.0267),
        Row(f"{what} RMS", None, literal["rms"], ours["rms"], 0.006),
        Row(f"{what} max, 463 Powell-Beale iterations, dominant extremum", ours=found["dominant"]["max"]),
        Row(f"{what} max, 463 L-BFGS iterations, dominant extremum", ours=found["lbfgs"]["max"]),
        Row("training of the network, s of one core", None, literal["seconds"], ours["seconds"], 1.0, group="speed"),
    ]


def _timed(data: Dataset, seed: int, chosen: dict[str, Any]) -> dict[str, float]:
    """Fit the network with the options `chosen`; return its errors on the training rows and the processor time (s)."""
    began = time.process_time()
    model = fit(data, "zhao_tan_mlp", seed, **chosen)
    return {"max": model.fit["max"], "rms": model.fit["rms"], "seconds": time.process_time() - began}


def _median(found: list[dict[str, float]]) -> dict[str, float]:
    return {k: float(np.median([f[k] for f in found])) for k in found[0]}


# ---- other signals ---------------------------------------------------------------------------------------------------
def _held_out(plant: Response, progress: Callable[[float], None]) -> list[Row]:
    """Return table rows with the errors on held-out signals.

    The literal replica is trained on one decaying sine, and our method on random nested reversals.
    """
    rich, bent = recorded(plant, REVERSALS), nested_loops.bent(plant)
    rich_bent = recorded(bent, REVERSALS)
    replica = accuracy.held_out_table(
        fit(experiment(plant), "zhao_tan_mlp", memory="last", **REPLICA), plant, rich.span
    )
    dominant, last = (
        accuracy.held_out_table(fit(rich, "zhao_tan_mlp", memory=memory), plant, rich.span)
        for memory in ("dominant", "last")
    )
    asymmetric = accuracy.held_out_table(fit(rich_bent, "zhao_tan_mlp"), bent, rich_bent.span)
    progress(0.4)
    rows = []
    for name, e in dominant.items():
        nested = name == "nested reversals"
        rows.append(
            ROW(
                "held_out",
                replica[name]["rms_percent"],
                e["rms_percent"],
                target=1.0 if nested else None,
                note="(x, h) does not determine the output, see theorem 1: floor about 0.9" if nested else "",
                name=name,
            )
        )
    rows += [
        ROW("asymmetric", ours=asymmetric["nested reversals"]["rms_percent"]),
        ROW("extremum", ours=last["nested reversals"]["rms_percent"] / dominant["nested reversals"]["rms_percent"]),
    ]
    rows += nested_loops.bank_rows("ten backlashes", plant, rich)
    progress(0.55)
    return [*rows, *nested_loops.bank_rows("asymmetric", bent, rich_bent)]


# ---- inverse in cascade ----------------------------------------------------------------------------------------------
def _cascade(size: int, progress: Callable[[float], None]) -> tuple[list[Row], list[Row], list[Plot]]:
    """Return table rows with the error of the inverse network in series with the actuator, without the virgin curve.

    The networks are trained on the first half of a decaying sine of `size` samples. The wanted output has another
    decay. The result contains the table rows of fig. 13, those of a scan over both decays, and diagrams that correspond
    to figs. 12 and 13.
    """
    plant = actuator()
    asked = {decay: MARGIN * signals.decaying_sine(size / CYCLE, decay, CYCLE)[:size] for decay in DECAYS}
    networks: dict[float, list[list[Model]]] = {}
    scan: dict[tuple[float, float], Row] = {}
    for k, trained in enumerate(DECAYS):
        networks[trained] = _inverses(plant, trained, size)
        for wanted in DECAYS:
            if wanted != trained:
                of = [[_largest(m, asked[wanted], plant) for m in models] for models in networks[trained]]
                what = f"network inverse in cascade, trained at decay {trained:g}, asked for {wanted:g}, max"
                scan[trained, wanted] = Row.over_seeds(what, PRINTED_CASCADE, of, note=ANOTHER, group="scan")
        progress((k + 1) / len(DECAYS))
    trained, wanted = nearest([(p, [r.literal or 0.0]) for p, r in scan.items()], [PRINTED_CASCADE])
    point, models, r = scan[trained, wanted], networks[trained], asked[wanted]
    at = [[_where(plant(m.predict(r)), r) for m in of] for of in models]
    rows = [
        replace(
            point,
            quantity="network inverse in cascade, ten backlashes, decaying sine, max",
            target=PRINTED_CASCADE,
            note=f"decay of the training signal {trained:g}, of the wanted output {wanted:g}; ours: exact inverse",
            place="fig. 13",
            group="",
            scanned=scanned([*scan.values()]),
        ),
        ROW.over_seeds("where", at),
    ]
    middle = sorted(models[1], key=lambda m: _largest(m, r, plant))[SEEDS // 2]
    return rows, [*scan.values()], _compensated(r, plant(middle.predict(r)))


def _beside(decay: float, size: int) -> list[Row]:
    """Return table rows with the errors of network inverses and of the inverse of plays, in series with two actuators.

    One actuator has a linear term. The wanted outputs are a decaying sine and nested reversals.
    """
    asked = {
        "decaying sine": MARGIN * signals.decaying_sine(size / CYCLE, decay, CYCLE)[:size],
        "nested reversals": MARGIN * signals.held_out()["nested reversals"],
    }
    rows = []
    for linear, which in ((0.0, "ten backlashes"), (LINEAR, "with linear term")):
        plant = actuator(linear)
        exact = inverse(fit(recorded(plant, REVERSALS), "prandtl_ishlinskii", w0_min=0.01))
        networks = _inverses(plant, decay, size)
        for name, r in asked.items():
            of = [[_largest(m, r, plant) for m in models] for models in networks]
            rows += [
                Row.over_seeds(f"network inverse in cascade, {which}, {name}, max", None, of),
                ROW(
                    "plays",
                    ours=_largest(exact, r, plant),
                    note="no continuous inverse exists: least linear weight 0.01" if linear == 0.0 else "",
                    which=which,
                    name=name,
                ),
            ]
    return rows


def _inverses(plant: Response, decay: float, size: int) -> list[list[Model]]:
    """Return the inverse networks for every seed: first those of the literal replica, then ours.

    They are trained on the first half of a decaying sine with `size` samples.
    """
    record = experiment(plant, decay, size)
    swapped = Dataset.from_signal(record.y, record.u, STEP, "exchanged", slice(VIRGIN, size // 2))
    settings: tuple[dict[str, Any], ...] = (
        {"operator": "zhao_tan_inverse_reconstructed", **REPLICA},
        {"operator": "zhao_tan_inverse"},
    )
    return [[fit(swapped, "zhao_tan_mlp", seed, **chosen) for seed in range(SEEDS)] for chosen in settings]


def _largest(model: Model, r: Array, plant: Response) -> float:
    return errors(plant(model.predict(r))[VIRGIN:], r[VIRGIN:], 2.0)["max"]


def _where(y: Array, wanted: Array) -> float:
    """Return the absolute wanted output at the sample with the largest error, divided by the largest wanted output.

    The virgin curve is excluded.
    """
    e, r = np.abs(y - wanted)[VIRGIN:], np.abs(wanted)[VIRGIN:]
    return float(r[np.argmax(e)] / r.max())


# ---- figures ---------------------------------------------------------------------------------------------------------
def _drawings(plant: Response, record: Dataset, kp: Array) -> list[Plot]:
    """Return diagrams from our data that correspond to figs. 1, 2 and 5 to 10 of the paper.

    `kp` is the output of our KP model for the record.
    """
    u = signals.decaying_sine(3, 0.2, 400)
    forward, back = (Graph.single(Node("operator", name)) for name in ("zhao_tan", "zhao_tan_inverse"))
    model = fit(_first_half(record), "zhao_tan_mlp")
    swapped = Dataset.from_signal(record.y, record.u, STEP, "exchanged", slice(VIRGIN, len(record.u) // 2))
    backward = fit(swapped, "zhao_tan_mlp", operator="zhao_tan_inverse")
    predicted, inverted = model.predict(record.u), backward.predict(record.y)
    return [
        curves(
            "fig. 1: operator and hysteresis", ("x", "h, y"), u, {"hysteresis": plant(u), "operator": forward.run(u)}
        ),
        curves("fig. 2: inverse operator", ("x", "h"), u, {"operator": back.run(u)}),
        *_validated("fig. 5", "fig. 6", "network", record.y, predicted, PRINTED[0]),
        *_validated("fig. 7", "fig. 8", "KP model", record.y, kp, PRINTED_KP[0]),
        *_validated("fig. 9", "fig. 10", "inverse network", record.u, inverted, None),
    ]


def _validated(first: str, second: str, name: str, truth: Array, model: Array, printed: float | None) -> list[Plot]:
    """Return diagrams of the output and the error of a model on the second half, with a line at the printed error.

    `first` and `second` are the numbers of the two figures. `truth` is the true output.
    """
    rows = slice(len(truth) // 2, None)
    t: Array = STEP * np.arange(len(truth), dtype=np.float64)[rows]
    limit = {} if printed is None else {"printed max": np.full(len(t), printed)}
    return [
        curves(f"{first}: validation, {name}", ("t (s)", "y"), t, {"measured": truth[rows], "model": model[rows]}),
        curves(f"{second}: validation error, {name}", ("t (s)", "error"), t, {"error": (model - truth)[rows], **limit}),
    ]


def _compensated(wanted: Array, y: Array) -> list[Plot]:
    t: Array = STEP * np.arange(len(wanted), dtype=np.float64)
    error = {"error": y - wanted, "printed max": np.full(len(t), PRINTED_CASCADE)}
    return [
        curves("fig. 12: inverse in cascade", ("wanted", "y"), wanted, {"output": y}),
        curves("fig. 13: error of the cascade", ("t (s)", "error"), t, error),
    ]
