"""Yu & Alici 2005: network for rate-dependent hysteresis, its inverse, and a loop with sliding mode control.

The paper prints only diagrams and the formulas of two bounds. The literal replica is a network with the inputs (u,
du/dt), an inverse network with the inputs (y, dy/dt), and the control law of eq. 5. Our model is a sum of plays in
series with linear dynamics G0(s) and a delay, fitted by variable projection. Our loop has a feed-forward of G0 in front
of the exact inverse of the hysteresis, and feedback with integral action. The identification is tested on the numpy
actuator in `rate_plant`. The loops are simulated at 10 kHz with the plant of the shipped scenarios. The errors of the
loops include the errors between samples.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset, signals
from hystfmu.graph import Graph
from hystfmu.identify import errors, fit
from hystfmu.identify.estimate.dynamics import hysteresis
from hystfmu.inverse import inverse
from hystfmu.model import Model, accuracy
from hystfmu.report.plot import Plot
from hystfmu.scenario.system.spec import shipped_scenarios
from papers.rate_plant import DELAY, F_N, FIGURES, RATE, ZETA, actuator, excitation
from papers.statements import yu_alici_2005_smc as statements
from papers.table import Report, Row, Stated, curves, report

if TYPE_CHECKING:
    from hystfmu.scenario.outcome.trace import Trace
from hystfmu.graph import Node
from hystfmu.identify.features.smooth_density import triangles

ROW = Stated(__name__)

NOISE = 1e-3  # RMS noise over half the stroke
LITERAL: dict[str, Any] = {"memory": "none", "hidden": 12, "starts": 1}  # one start per seed
SEEDS = 5  # number of seeds, each for the noise of a record and the start values of its networks
W0_MIN = 0.05  # smallest weight of the linear term, which makes the model invertible


def quick() -> list[Row]:
    """Return the table rows that take only seconds: tests of equations and statements."""
    return statements.rows()


def table(data: Path | None, progress: Callable[[float], None]) -> Report:
    """Return the table of the paper. `data` is not used. `progress` is called with the completed fraction of the work.

    Targets of the identification: the error is at most 1 % for f_n and for the damping ratio, 0.1 sample for the delay,
    and 0.06 %FS on held-out signals. Targets of the loops at 10 kHz with one step of delay: the RMS error is at most
    0.03 % of the stroke at 10 Hz and 0.02 % at 100 Hz. If the plant differs by 20 % from the model, the limits are 0.08
    % and 0.75 %, and only the internal model controller has these targets.
    """
    rows = [*quick(), *_figures()]
    progress(0.2)
    identified, fig_9 = _identification()
    progress(0.5)
    controlled, figs_10_11 = _control(lambda fraction: progress(0.5 + 0.5 * fraction))
    rows += [*identified, *controlled]
    return report(ROW, tuple(rows), (*_drawings(), *drawings_of_relays(), fig_9, *figs_10_11))


def measured(u: Array, seed: int = 0) -> Dataset:
    """Return a noisy record of the numpy actuator for an input u (n,). `seed` determines the noise."""
    y = actuator(u) + NOISE * np.random.default_rng(seed).normal(size=len(u))
    return Dataset.from_signal(u, y, 1 / RATE, "rate-dependent actuator")


def _figures() -> list[Row]:
    """Return table rows of networks that are trained and tested on the signal of one figure, as in the paper."""
    titles = {"6": "frequency falls", "7": "frequency rises, amplitude falls", "8": "frequency and amplitude fall"}
    rows = []
    for figure in FIGURES:
        records = [measured(excitation(figure), seed) for seed in range(SEEDS)]
        of = [[fit(d, "rate_mlp", k, **o).fit["rms_percent"] for k, d in enumerate(records)] for o in (LITERAL, {})]
        rows.append(ROW.over_seeds("trained", of, title=titles[figure], figure=figure))
    tone = measured(np.sin(2 * np.pi * 50 * np.arange(2000) / RATE))
    literal = [fit(tone, "rate_mlp", k, **LITERAL).fit["rms_percent"] for k in range(SEEDS)]
    return [*rows, ROW.over_seeds("tone", [literal, []])]


def _identification() -> tuple[list[Row], Plot]:
    """Return table rows with the errors of models, of eqs. 2 and 3, and of inverses, and a diagram like fig. 9."""
    u = np.concatenate([excitation(f) for f in FIGURES])
    records = [measured(u, seed) for seed in range(SEEDS)]
    literal = [fit(d, "rate_mlp", k, **LITERAL) for k, d in enumerate(records)]
    network = [fit(d, "rate_mlp") for d in records[:1]]
    ours = [fit(d, "g0_prandtl_ishlinskii") for d in records]
    of = [
        [accuracy.held_out_table(m, actuator, d.span) for m, d in zip(models, records, strict=False)]
        for models in (literal, network, ours)
    ]

    def held_out(name: str) -> list[list[float]]:
        return [[t[name]["rms_percent"] for t in of[k]] for k in (0, 2)]

    rows = [Row.over_seeds(f"held out, {name}: RMS, %FS", None, held_out(name), target=0.06) for name in of[0][0]]
    worst = [[max(e["rms_percent"] for e in t.values()) for t in tables] for tables in of]
    found = {name: [m.fit[name] for m in ours] for name in ("f_n", "zeta", "delay")}
    inverse_row, drawing = _inverse(records, ours[0])
    medians = float(np.median([m.fit["rms_percent"] for m in ours])), float(np.median(worst[2]))
    return [
        *rows,
        *_preisach_rows(records[0], actuator, medians),
        ROW.over_seeds("network", worst[:2]),
        ROW.over_seeds("f_n", [[], [100 * abs(v / F_N - 1) for v in found["f_n"]]]),
        ROW.over_seeds("zeta", [[], [100 * abs(v / ZETA - 1) for v in found["zeta"]]]),
        ROW.over_seeds("delay", [[], [abs(v - DELAY) * RATE for v in found["delay"]]]),
        inverse_row,
    ], drawing


def _inverse(records: list[Dataset], model: Model) -> tuple[Row, Plot]:
    """Return a table row that compares the network inverses with the exact inverse, and a diagram like fig. 9.

    The inverses are tested in series with the actuator at 2 Hz. `model` is the model that is inverted exactly.
    """
    literal = [fit(replace(d, u=d.y, y=d.u), "rate_mlp", k, **LITERAL) for k, d in enumerate(records)]
    exact = inverse(hysteresis(model))
    wanted = 0.8 * signals.decaying_sine(4, 0.2, 5000)

    def largest(m: Model) -> float:
        return errors(actuator(m.predict(wanted, 1 / RATE)), wanted, 1.6)["max_percent"]

    of = [[largest(m) for m in literal], [largest(exact)]]
    named = {"network on (y, dy/dt)": literal[0], "ours": exact}
    lines = {name: m.predict(wanted, 1 / RATE) for name, m in named.items()}
    drawing = curves("fig. 9: inverse models", ("wanted y", "u"), wanted, lines, points=2000)
    return ROW.over_seeds("cascade", of), drawing


# ---- closed loops ------------------------------------------------------------------------------------------------
class _Loops:
    """The shipped scenarios with inverses that are identified here.

    There are two kinds of inverse: the exact inverse of our model, and one inverse network for every seed.
    """

    def __init__(self) -> None:
        self.folder = shipped_scenarios()
        d = self._data()
        model = fit(d, "g0_prandtl_ishlinskii", w0_min=W0_MIN)
        self.ours = inverse(hysteresis(model)).graph
        self.dynamics = {"feedforward.f_n": model.fit["f_n"], "feedforward.zeta": model.fit["zeta"]}
        exchanged = replace(d, u=d.y, y=d.u)
        self.literal = [fit(exchanged, "rate_mlp", seed, **LITERAL).graph for seed in range(SEEDS)]

    def _data(self) -> Dataset:
        """Return a record of the plant of the scenarios for the inputs of figs. 6 to 8.

        The plant is simulated with ten steps in each sampling interval.
        """
        plant = Model.load(self.folder / "models" / "backlash_plant.model.toml").graph
        u = 1.4 * np.concatenate([excitation(f, rate=10 * RATE) for f in FIGURES])
        held = np.append(
            u[0], (u[1:] + u[:-1]) / 2
        )  # the input of the plant is constant over a fine step, so the mean over the step is used
        y = plant.run(np.column_stack([held, np.zeros(len(u))]), 0.1 / RATE)[::10]
        y = y + NOISE * np.random.default_rng(1).normal(size=len(y))
        return Dataset.from_signal(u[::10], y, 1 / RATE, "plant of the scenarios")

    def run(self, scenario: str, case: str, inverse: Graph | None = None, **changed: float) -> tuple[float, float]:
        """Simulate a case of a scenario, and return two results: RMS tracking error and relative total variation of u.

        The RMS tracking error is in % of the stroke. The total variation of the command u is divided by that of the
        feed-forward signal. `inverse` replaces the inverse in the scenario; by default, the inverse is not changed.
        `changed` contains new parameter values. If the loop diverges, both results are infinite.
        """
        from hystfmu.scenario.outcome.metrics import measure
        from hystfmu.scenario.outcome.trace import Stopped

        try:
            trace, metrics = self.trace(scenario, case, inverse, **changed)
        except Stopped:
            return np.inf, np.inf
        variation = measure(metrics["variation"], trace) if "variation" in metrics else 1.0
        return measure(metrics["tracking"], trace), variation

    def trace(self, scenario: str, case: str, inverse: Graph | None = None, **changed: float) -> "tuple[Trace, Any]":
        """Simulate a case of a scenario with the arguments of `run`, and return the signals and the metrics."""
        from hystfmu.scenario import Cases, build, simulate

        overrides: dict[str, Any] = {key.replace("__", "."): v for key, v in changed.items()}
        # the input of the network is the reference, without feed-forward
        if any(inverse is network for network in self.literal):
            overrides |= {"feedforward.f_n": 1e12, "feedforward.zeta": 0.0}
        elif inverse is not None:
            overrides |= self.dynamics
        cases = Cases(self.folder / scenario, overrides).cases
        system = build(next(c for c in cases if c.name == case))
        if inverse is not None:
            parts = tuple(replace(p, graph=inverse) if p.name == "inverse" else p for p in system.parts)
            system = replace(system, parts=parts)
        return simulate(system, "native"), system.case.metrics

    def drawings(self, case: str = "sine_10") -> tuple[Plot, ...]:
        """Return diagrams like fig. 10 (actuator with inverse) and fig. 11 (tracking in open and closed loop).

        `case` is the case of the scenarios that is simulated.
        """
        law, off = "sliding_mode_2005", {"sliding_mode__eta": 0.0, "sliding_mode__rho": 0.0}
        none = self.trace("open_loop", case)[0]
        alone = {n: self.trace(law, case, i, **off)[0] for n, i in (("network", self.literal[0]), ("ours", self.ours))}
        closed = {n: self.trace(law, case, i)[0] for n, i in (("network", self.literal[0]), ("ours", self.ours))}
        r, y = "reference.r", "plant.y"
        inverses = {f"inverse: {n}": (t[r], t[y]) for n, t in alone.items()}
        loops = {"open loop": none} | {f"closed loop: {n}": t for n, t in closed.items()}
        outputs, errors_of = ({n: t[y] for n, t in loops.items()}, {n: t[y] - t[r] for n, t in loops.items()})
        linear, time = "fig. 10: linearised hysteresis, 10 Hz", none.t
        return (
            curves(linear, ("wanted y", "y"), None, {"no inverse": (none[r], none[y]), **inverses}, points=2000),
            curves("fig. 11: tracking, 10 Hz", ("t (s)", "y"), time, {"wanted": none[r], **outputs}),
            curves("fig. 11: tracking error, 10 Hz", ("t (s)", "error"), time, errors_of),
        )


def _against_open(f: int, alone: float, closed: list[list[float]]) -> list[Row]:
    """Return table rows with the RMS error of the open loop, and with the closed-loop errors relative to it.

    `f` is the frequency of the sine (Hz), `alone` is the open-loop error, and `closed` contains the closed-loop errors.
    Fig. 11 shows no numbers for this comparison.
    """
    return [
        Row(f"{f} Hz, open loop: RMS, % of stroke", None, alone, place="fig. 11"),
        ROW.over_seeds("closed_over_open", [[e / alone for e in of] for of in closed], f=f),
    ]


def _drawings() -> tuple[Plot, ...]:
    """Return diagrams like figs. 3 and 6 to 8, from the numpy actuator and the networks of the table."""
    cycles = {}
    for f in (2, 20, 100):
        last = round(RATE / f)
        u = np.sin(2 * np.pi * f * np.arange(2 * last) / RATE)
        cycles[f"{f} Hz"] = u[-last:], actuator(u)[-last:]
    plots = [curves("fig. 3: fixed amplitude, several frequencies", ("u", "y"), None, cycles)]
    for figure in FIGURES:
        d = measured(excitation(figure))
        models = {"network on (u, du/dt)": fit(d, "rate_mlp", **LITERAL), "ours": fit(d, "rate_mlp", starts=1)}
        lines = {"actuator": d.y} | {n: m.predict(d.u, d.h) for n, m in models.items()}
        plots.append(curves(f"fig. {figure}: hysteresis and network", ("u", "y"), d.u, lines, points=2000))
    return tuple(plots)


def _control(progress: Callable[[float], None]) -> tuple[list[Row], tuple[Plot, ...]]:
    """Return the table rows of the closed loops, and diagrams like figs. 10 and 11."""
    loops = _Loops()
    progress(0.8)
    off = {"sliding_mode__eta": 0.0, "sliding_mode__rho": 0.0}
    law, integral = "sliding_mode_2005", "sliding_mode"

    def both(scenario: str, case: str, **changed: float) -> list[list[float]]:
        """Return the RMS tracking errors of a case with the network of each seed, and with our inverse."""
        return [[loops.run(scenario, case, inv, **changed)[0] for inv in of] for of in (loops.literal, [loops.ours])]

    def ours(scenario: str, case: str) -> float:
        return loops.run(scenario, case, loops.ours)[0]

    rows = []
    for f, nominal in ((10, 0.03), (100, 0.02)):
        case = f"sine_{f}"
        printed = both(law, case)
        rows += [
            *_against_open(f, loops.run("open_loop", case)[0], printed),
            ROW.over_seeds("inverse_alone", both(law, case, **off), f=f),
            ROW.over_seeds("as_printed", printed, f=f),
            Row(f"{f} Hz, PID and our inverse", None, None, ours("pid", case), nominal),
            Row(f"{f} Hz, sliding mode with integral", None, None, ours(integral, case), nominal),
            Row(f"{f} Hz, internal model", None, None, ours("internal_model", case), nominal),
        ]
    for suffix, name in (
        ("", "20 % mismatch, "),
        ("_two_steps", "this mismatch and a sample of delay more than known, "),
    ):
        for f, target in ((10, 0.08), (100, 0.75)):
            case = f"up_400{suffix}_{f}"
            limit = None if suffix else target
            rows += [
                Row.over_seeds(f"{f} Hz, {name}sliding mode as printed", None, both(law, case)),
                Row(f"{f} Hz, {name}PID", None, None, ours("pid", case)),
                Row(f"{f} Hz, {name}sliding mode with integral", None, None, ours(integral, case)),
                Row(f"{f} Hz, {name}internal model", None, None, ours("internal_model", case), limit),
            ]
    limits = {"sliding_mode__u_min": -2.0, "sliding_mode__u_max": 2.0}
    chattering = loops.run(law, "sine_10", loops.ours, sliding_mode__eta=1.1, **limits)
    smooth = loops.run(integral, "sine_10", loops.ours)
    rows += [ROW("variation", chattering[1], smooth[1]), ROW("tracking", chattering[0], smooth[0])]
    return rows, loops.drawings()


STEPS = 12  # number of intervals of the grid over the range of u, that is, 78 cells
THIN = 5  # every fifth row is used for training
RIDGES = (1e-4, 1e-3, 1e-2, 1e-1)  # candidates of the ridge, relative to the norm of a column
INNER = 2 / 3  # fraction of the training rows that is fitted when the ridge is chosen on the other rows
REACH = 1.02  # range of the grid over the trained range
ALPHA, BETA = 0.3, -0.2  # thresholds of the relay in the diagram

Response = Callable[[Array], Array]


def relays(u: Array, n: int, most: float) -> Array:
    """Return the outputs of the relays of all cells in the Preisach plane, shape (rows, n (n + 1) / 2).

    `u` is the input, shape (rows,). The plane is divided by a grid with n intervals over [-most, most].
    """
    cells = triangles(n)
    out = np.empty((len(u), cells.shape[1]), order="F")
    for c, E in enumerate(cells.T):
        out[:, c] = Graph.single(Node("relays", "preisach", {"n": n}, {"lo": -most, "hi": most, "E": E})).run(u)
    return out


def preisach(record: Dataset, dynamic: bool) -> Response:
    """Fit the model of eq. 2 to a record, and return a function that computes its response to an input.

    If `dynamic` is True, the model is that of eq. 3, whose density depends on the rate of the input. It is y = c + sum
    over the cells of (mu_0 + mu_1 du/dt) relay[u]: the density is expanded to first order in du/dt (Mayergoyz 1991, ch.
    2). The parameters c, mu_0 and mu_1 are linear. If the data contain no information about a cell, a ridge penalty
    makes its density almost 0. The strength of this penalty is chosen on the last part of the training rows. The relays
    switch as in the classical Preisach model.
    """
    most = REACH * float(np.abs(record.u).max())

    def regressors(u: Array) -> Array:
        cells = relays(u, STEPS, most)
        parts = [np.ones((len(u), 1)), cells]
        return np.hstack([*parts, cells * np.gradient(u, record.h)[:, None]] if dynamic else parts)

    A, y = regressors(record.u)[::THIN], record.y[::THIN]
    scale = np.maximum(np.linalg.norm(A, axis=0), 1e-12)
    n, inner = A.shape[1], round(INNER * len(y))

    def weights(ridge: float, end: int) -> Array:
        B = np.vstack([A[:end] / scale, ridge * np.eye(n)])
        return np.asarray(np.linalg.lstsq(B, np.concatenate([y[:end], np.zeros(n)]), rcond=None)[0] / scale)

    ridge = min(RIDGES, key=lambda r: float(np.linalg.norm(A[inner:] @ weights(r, inner) - y[inner:])))
    w = weights(ridge, len(y))
    return lambda u: np.asarray(regressors(u) @ w)


def _preisach_rows(record: Dataset, plant: Response, ours: tuple[float, float]) -> list[Row]:
    """Return table rows with the errors of the models of eqs. 2 and 3 on the training record and on held-out signals.

    Parameters
    ----------
    record : Dataset
        Training data.
    plant : function
        Function that returns the true output (n,) for an input (n,).
    ours : tuple of float
        RMS error of our model on the training signal, and its largest RMS error on the held-out signals (%FS).
    """
    tests = {name: (u, plant(u)) for name, u in signals.held_out().items()}
    cells = STEPS * (STEPS + 1) // 2
    found = []
    for place, dynamic, name in (("eq. 2", False, "Preisach sum"), ("eq. 3", True, "dynamic Preisach sum")):
        model = preisach(record, dynamic)
        trained = errors(model(record.u), record.y, record.span)["rms_percent"]
        worst = max(errors(model(u), y, record.span)["rms_percent"] for u, y in tests.values())
        note = f"{(1 + dynamic) * cells + 1} weights; ours: plays, then G0(s)"
        found += [
            Row(f"{name}: RMS, %FS, {what}", None, e, best, note=note, place=place)
            for what, e, best in (("training signal", trained, ours[0]), ("held out, worst", worst, ours[1]))
        ]
    return found


def drawings_of_relays() -> tuple[Plot, ...]:
    """Return diagrams like figs. 4 (output of a relay) and 5 (Preisach plane after a decaying input) of the paper."""
    u = signals.decaying_sine(3, 0.3, 200)
    relay, state = np.empty(len(u)), -1.0
    for k, v in enumerate(u):
        state = 1.0 if v >= ALPHA else -1.0 if v <= BETA else state
        relay[k] = state
    turns = u[np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1]
    alpha, beta = np.repeat(turns[::2], 2)[1:], np.repeat(turns[1::2], 2)[:-1]
    line = np.array([-1.0, 1.0])
    plane = {"alpha = beta": (line, line), "memory": (np.append(-1.0, beta), np.append(alpha[0], alpha))}
    return (
        curves("fig. 4: elementary operator", ("u", "relay"), u, {"relay": relay}),
        curves("fig. 5: Preisach plane after a decaying input", ("beta", "alpha"), None, plane),
    )
