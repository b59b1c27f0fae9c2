"""Tangent of every block against one-sided differences, at kinks too; sensitivities against those of whole runs."""

import numpy as np
import pytest
from excitation import STEP, every_block, node, perturbed, plain, rows, some
from raw import Raw

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.core.executor import SEED, Executor
from hystfmu.core.library import block_types


def one_sided(raw: Raw, du: np.ndarray, dx: np.ndarray, e: float) -> np.ndarray:
    """Second-order difference of outputs and derivatives on the side of the seeds only."""
    u, x = raw.u.copy(), raw.x.copy()

    def at(s: float) -> np.ndarray:
        raw.u[:] = u + s * du
        raw.x[: raw.n_cstates] = x[: raw.n_cstates] + s * dx
        both = raw.output(), raw.deriv() if raw.c.deriv else np.zeros(0)
        raw.u[:], raw.x[:] = u, x
        return np.concatenate(both)

    return np.asarray((4 * at(e / 2) - at(e) - 3 * at(0.0)) / e)


def limited(n: Node) -> Node | None:
    """The node with limits that its signals reach, where it has none; None where there is nothing to limit."""
    wide = {v.name: n.value(v.name) for v in n.block.parameters if v.type == "real"}
    narrow = {name: np.sign(x) * 0.4 for name, x in wide.items() if x.size and (np.abs(x) > 1e290).all()}
    return node(n.block, {**n.values, **{name: plain(x) for name, x in narrow.items()}}) if narrow else None


DIMS = {  # other sizes than those of the table
    "mlp": [{"n_in": 3, "n_hidden": 4, "n_out": 2}],
    "polynomial_narx": [{"n_k": 0}, {"n_k": 0, "n_u": 2, "n_f": 2, "n_y": 1, "q": 3}],
    "preisach": [{"n": 7}],
    "transfer_function": [{"na": 3, "nb": 3}, {"na": 3, "nb": 1}],
}


@every_block
@pytest.mark.parametrize("kink", [False, True])
def test_tangent_is_the_one_sided_derivative(name: str, kink: bool) -> None:
    """At inputs that no update has seen, and at the last input itself: there a seed back is a reversal."""
    block, rng, depends = block_types()[name], np.random.default_rng(4), False
    real = [v for v in block.parameters if v.type == "real"]
    # output() by an integration rule: its derivative is that of the operator up to the error of the rule
    bound = 1e-6 if block.of("cstate") else max(1e-6, block.rule_error)
    nodes = [perturbed(n, {v.name for v in real}) for n in some(block)]
    nodes += [n for n in map(limited, nodes) if n]
    for dims in DIMS.get(name, []):
        sizes = Node("b", name, dims).sizes
        nodes.append(
            Node("b", name, dims, {v.name: 0.1 * rng.normal(size=sizes[v.name]) for v in real if v.size != "1"})
        )
    for n in nodes:
        raw = Raw(n)
        for rounds in range(0, 12, 2):
            u = rows(block, dict(n.dims), 16 + rounds, seed=rounds)
            raw.run(u, STEP)
            if not kink:
                raw.set_inputs(rng.uniform(-1.3, 1.3, u.shape[1]), 1.0)
            before = [a.tobytes() for a in (raw.p, raw.x, raw.u)]
            for _ in range(4):
                du, dx = rng.normal(size=raw.u.size), rng.normal(size=raw.n_cstates)
                du[raw.time] = 0.0
                dy, ddx = raw.tangent(du, dx)
                got = np.concatenate([dy, ddx])
                assert [a.tobytes() for a in (raw.p, raw.x, raw.u)] == before
                want = one_sided(raw, du, dx, block.smooth)
                finite = np.isfinite(got)
                assert (np.abs(want[~finite]) > 10).all(), "an infinite slope where there is none"
                scale = 1 + np.abs(want[finite]).max(initial=0)
                assert (np.abs(got - want)[finite] <= bound * scale).all(), (n.values, raw.u, got, want)
                depends |= bool(np.abs(want[finite]).max(initial=0) > 1e-3)
    assert depends == bool(block.raw.tangent), "a dependency without a tangent, or a tangent without one"


ROWS = 60
STEPPED = {"in_range"}  # the output is 0 or 1: no derivative differs from 0


def behind_scaling(n: Node) -> Graph:
    """The node behind a gain and an offset for each of its inputs, with all its outputs."""
    inputs, outputs = (
        [f"b.{v.name}" + (f"[{k + 1}]" if n.sizes[v.name] > 1 else "") for v in rows for k in range(n.sizes[v.name])]
        for rows in (n.block.of("input"), n.block.of("output"))
    )
    sources = [Node(f"a{k}", "scaling", {"n": 1}) for k in range(max(len(inputs), 1))]
    return Graph(
        [*sources, n],
        [(f"{source.name}.y", end) for source, end in zip(sources, inputs, strict=False)],
        [Input(f"u{k}", (f"{source.name}.u",)) for k, source in enumerate(sources)],
        [Output(f"y{k}", end) for k, end in enumerate(outputs)],
    )


def differences(x: Executor, u: np.ndarray, n_y: int, place: int, size: float) -> list[np.ndarray]:
    """One-sided differences of the run by moving a parameter up and down; twice the same at a limit, 0 between two."""
    value, y, found = x.get(place), x.run(u, n_y, STEP), []
    for s in (size, -size):
        try:
            x.set(place, value + s)
            found.append((x.run(u, n_y, STEP) - y) / s)
        except InputError:
            pass
        x.set(place, value)
    return (2 * (found or [np.zeros_like(y)]))[:2]


@every_block
def test_sensitivities_are_the_derivatives_of_the_run(name: str) -> None:
    """A column for each element of a parameter, then all in two, where two sides show that there is no kink."""
    block, compared = block_types()[name], 0
    real = {v.name for v in block.parameters if v.type == "real"}
    for n in [perturbed(n, real) for n in some(block) if not block.trial][:4]:
        graph = behind_scaling(n)
        x, n_y = Executor(graph.to_bytes()), graph.n_outputs
        u = rows(block, dict(n.dims), ROWS)
        u = u if u.shape[1] else np.zeros((ROWS, 1))
        free = [p for p in graph.ports if p.is_parameter and p.var.type == "real"]
        free = [p for p in free if graph.nodes[p.node].name == "b" or p.var.name in ("gain", "offset")]
        places = [k for p in free for k in range(p.reference, p.reference + min(p.size, 3))]
        sizes = np.array([0.3 * abs(x.get(k)) or 0.3 for k in places])
        seeds = np.array([(k, i, s) for i, (k, s) in enumerate(zip(places, sizes, strict=True))], dtype=SEED)
        y, dy = x.sensitivities(u, n_y, STEP, seeds)
        assert y.tobytes() == x.run(u, n_y, STEP).tobytes()
        both = [differences(x, u, n_y, k, 1e-6 * s) for k, s in zip(places, sizes, strict=True)]
        above, below = (np.stack(side, axis=2) * sizes for side in zip(*both, strict=True))
        central = (above + below) / 2
        scale = np.abs(central).max(axis=(0, 1)) + 1e-3 * np.abs(y).max()
        smooth = np.abs(above - below) <= 1e-4 * scale
        assert np.mean(smooth) > 0.8
        assert np.quantile((np.abs(dy - central) / scale)[smooth], 0.98) < 2e-5, n.values
        compared += int(np.count_nonzero(central[smooth]))
        seeds["column"] %= 2
        _, total = x.sensitivities(u, n_y, STEP, np.concatenate([seeds[::2], seeds[1::2]]))
        sums = [dy[..., k::2].sum(axis=2) for k in range(total.shape[2])]
        wrong = np.abs(np.moveaxis(total, 2, 0) - sums).max(axis=0) / scale.sum()
        assert np.quantile(wrong[smooth.all(axis=2)], 0.98) < 2e-5, n.values
    assert compared or block.trial or name in STEPPED
