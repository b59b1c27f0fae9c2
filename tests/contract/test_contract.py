"""What every block must satisfy, as loops over the block table: a new block is tested without a new line here."""

from __future__ import annotations

import keyword
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from excitation import BLOCKS, STEP, configurations, node, rows
from raw import Raw
from scipy.integrate import solve_ivp

from hystfmu.core import RATE_INDEPENDENT, BlockType, Var, block_types
from hystfmu.core import STEP as STEP_FLAG
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.model import Model
from hystfmu.unit import Unit

ROOT = Path(__file__).parents[2]
C_WORDS = set(
    re.findall(
        r"\w+",
        """auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    and asm bool catch class delete explicit export false friend mutable namespace new not operator or private protected
    public template this throw true try typename using virtual xor""",
    )
)
MODELICA_WORDS = set(
    re.findall(
        r"\w+",
        """algorithm and annotation assert block break class connect connector constant constrainedby der discrete each
    else elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for function
    if import impure in initial inner input loop model not operator or outer output package parameter partial protected
    public pure record redeclare replaceable return stream then time true type when while within""",
    )
)
POSITIVE = 2.2250738585072014e-308  # as a lower bound: "greater than 0"

every_block = pytest.mark.parametrize("name", BLOCKS)


def default(name: str) -> Graph:
    return Graph.single(Node(name, name))


def some(block: BlockType) -> list[Node]:
    """All legal configurations as nodes."""
    nodes = [n for n in (node(block, c) for c in configurations(block)) if n]
    assert nodes, "no configuration of the block can be built"
    return nodes


def run(n: Node, u: np.ndarray, h: float = STEP) -> np.ndarray:
    return Graph.single(n).run(u, h).reshape(len(u), -1)


# ---- the table ------------------------------------------------------------------------------------------------------
def legal(name: str) -> bool:
    return (
        re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*[A-Za-z0-9]|[A-Za-z]", name) is not None  # C, Python, Modelica, XML NCName
        and not keyword.iskeyword(name)
        and name not in C_WORDS
        and name not in MODELICA_WORDS
        and name != "dt"  # an argument of update() and prepare()
    )


@every_block
def test_names_are_legal_in_four_languages(name: str) -> None:
    block = block_types()[name]
    words = [c for v in block.vars for c in v.choices]
    names = [v.name for v in block.vars] + [d.name for d in block.dims]
    assert [n for n in [*names, *words, name, block.class_name] if not legal(n)] == []


@every_block
def test_no_name_is_used_twice(name: str) -> None:
    block = block_types()[name]
    names = [v.name for v in block.vars] + [d.name for d in block.dims]
    assert sorted(names) == sorted(set(names))
    visible = [s for p in default(name).ports for s in p.scalar_names]
    assert len(visible) == len(set(visible))


@every_block
def test_rows_come_in_the_order_that_the_layout_needs(name: str) -> None:
    kinds = [v.kind for v in block_types()[name].vars]
    for first, then in (("cstate", "state"), ("param", "derived"), ("fixed", "derived")):
        if first in kinds and then in kinds:
            assert max(i for i, k in enumerate(kinds) if k == first) < kinds.index(then), f"{first} after {then}"


@every_block
def test_every_row_is_complete(name: str) -> None:
    block = block_types()[name]
    for text in (
        block.text,
        block.equation,
        block.source,
        *(d.text for d in block.dims),
        *(v.text for v in block.vars),
    ):
        assert text.strip() == text
        assert text
        assert not text.endswith(".")
    assert block.of("output"), "no output"
    for d in block.dims:
        assert 0 <= d.lo <= d.start <= d.hi, d
    for v in block.vars:
        assert v.unit, v
        assert v.lo <= v.start <= v.hi, v
        assert np.isfinite(v.start), v
        assert v.type in ("real", "int", "bool") or len(v.choices) > 1, v
        if v.choices:
            assert (v.lo, v.hi) == (0, len(v.choices) - 1), v
        if v.type == "bool":
            assert (v.lo, v.hi) == (0, 1), v
    assert bool(block.of("cstate")) == bool(block.raw.deriv), "continuous states and deriv() go together"
    assert bool(block.of("derived")) <= bool(block.raw.prepare), "derived values need prepare()"


@every_block
def test_derived_values_that_depend_on_the_step_are_flagged(name: str) -> None:
    block = block_types()[name]
    for n in some(block):
        a, b = Raw(n), Raw(n)
        a.prepare(0.01), b.prepare(0.02)
        assert np.array_equal(a.p, b.p) or block.flags & STEP_FLAG


def test_registry_is_the_folder() -> None:
    files = {f.stem for f in (ROOT / "fmu_build" / "core" / "blocks").glob("*.c")}
    assert files == set(block_types())


def test_registry_is_sorted() -> None:
    assert list(block_types()) == sorted(block_types())


@every_block
def test_at_least_one_sourced_vector(name: str) -> None:
    files = [ROOT / "tests" / "vectors" / kind / f"{name}.toml" for kind in ("published", "derived")]
    assert any(f.exists() for f in files), f"no tests/vectors/{{published,derived}}/{name}.toml"


# ---- purity and state -----------------------------------------------------------------------------------------------
@every_block
def test_output_is_pure(name: str) -> None:
    for n in some(block_types()[name]):
        raw = Raw(n)
        u = rows(n.block, dict(n.dims), 24)
        raw.run(u, STEP)
        for k, row in enumerate(rows(n.block, dict(n.dims), 8, seed=2)):  # inputs that no update() has seen
            raw.set_inputs(row, 1.0 + 0.1 * k)
            before = [a.tobytes() for a in (raw.p, raw.x, raw.u)]
            first = raw.output()
            assert [a.tobytes() for a in (raw.p, raw.x, raw.u)] == before
            raw.y[:] = -1.0
            assert raw.output().tobytes() == first.tobytes()
            if n.block.raw.deriv:
                d = raw.deriv()
                assert [a.tobytes() for a in (raw.p, raw.x, raw.u)] == before
                assert raw.deriv().tobytes() == d.tobytes()
        raw.check_guards()


@every_block
def test_no_feedthrough_means_no_feedthrough(name: str) -> None:
    for n in some(block_types()[name]):
        if n.feeds_through():
            continue
        raw = Raw(n)
        raw.run(rows(n.block, dict(n.dims), 24), STEP)
        before = raw.output()
        raw.u += 1.0
        assert raw.output().tobytes() == before.tobytes()


@every_block
def test_feedthrough_is_claimed_only_where_it_is(name: str) -> None:
    """A claim too many would make a false algebraic loop."""
    block = block_types()[name]
    claiming = [n for n in some(block) if n.feeds_through() and block.of("input")]
    for n in claiming:
        raw = Raw(n)
        raw.run(rows(n.block, dict(n.dims), 24), STEP)
        before = raw.output()
        raw.u += 3.0 * np.arange(1, raw.u.size + 1)  # inputs that differ by more than before
        assert raw.output().tobytes() != before.tobytes()


def steps(unit: Unit, names: list[str], u: np.ndarray, first: int, outputs: list[str]) -> np.ndarray:
    result = []
    for k, row in enumerate(u, start=first):
        for name, value in zip(names, row, strict=True):
            unit.set(name, value)
        unit.do_step((k - 1) * STEP, STEP)
        result.append([unit.get(o) for o in outputs])
    return np.array(result)


def ports(graph: Graph, kind: str) -> list[str]:
    return [s for p in graph.ports if p.kind == kind for s in p.scalar_names]


@every_block
def test_state_saved_mid_run_continues_bit_for_bit(name: str) -> None:
    for n in some(block_types()[name]):
        graph = Graph.single(n)
        u = rows(n.block, dict(n.dims), 80)
        ins, outs = ports(graph, "input"), ports(graph, "output")
        unit = Unit(graph)
        unit.initialize(0.0, **dict(zip(ins, u[0], strict=True)))
        steps(unit, ins, u[1:40], 1, outs)
        saved, seen = unit.state, [unit.get(v) for v in (*ins, *outs)]
        straight = steps(unit, ins, u[40:], 40, outs)
        unit.state = saved
        assert [unit.get(v) for v in (*ins, *outs)] == seen
        assert steps(unit, ins, u[40:], 40, outs).tobytes() == straight.tobytes()
        other = Unit(graph)
        other.initialize(0.0)
        other.state = saved
        assert steps(other, ins, u[40:], 40, outs).tobytes() == straight.tobytes()
        unit.reset()
        unit.initialize(0.0, **dict(zip(ins, u[0], strict=True)))
        steps(unit, ins, u[1:40], 1, outs)
        assert unit.state.tobytes() == saved.tobytes()


@every_block
def test_graph_unit_and_bare_functions_agree_bit_for_bit(name: str) -> None:
    for n in some(block_types()[name]):
        graph = Graph.single(n)
        u = rows(n.block, dict(n.dims), 60)
        by_graph = run(n, u)
        ins, outs = ports(graph, "input"), ports(graph, "output")
        unit = Unit(graph)
        unit.initialize(0.0, **dict(zip(ins, u[0], strict=True)))
        first = [[unit.get(o) for o in outs]]
        by_unit = np.concatenate([first, steps(unit, ins, u[1:], 1, outs)])
        assert by_unit.tobytes() == by_graph.tobytes()
        assert Raw(n).run(u, STEP).tobytes() == by_graph.tobytes()


@every_block
def test_model_file_keeps_every_bit(name: str, tmp_path: Path) -> None:
    block = block_types()[name]
    for n in some(block):
        changed = perturbed(n, {v.name for v in block.parameters if v.type == "real"})
        graph = Graph.single(changed).with_step(STEP)
        Model(name, graph, STEP).save(tmp_path / "m.model.toml")
        again = Model.load(tmp_path / "m.model.toml")
        assert again.graph.token == graph.token
        assert again.graph.to_bytes() == graph.to_bytes()


# ---- behaviour ------------------------------------------------------------------------------------------------------
@every_block
@pytest.mark.parametrize("h", [1e-9, STEP, 10.0])
def test_defaults_run_and_do_something(name: str, h: float) -> None:
    n = Node(name, name)
    u = rows(n.block, dict(n.dims))
    y = run(n, u, h)
    assert np.isfinite(y).all()
    if h == STEP:
        assert np.ptp(y, axis=0).max() > 0


@pytest.mark.parametrize("name", [n for n in BLOCKS if block_types()[n].flags & RATE_INDEPENDENT])
def test_rate_independence(name: str) -> None:
    block = block_types()[name]
    for n in some(block):
        u = rows(block, dict(n.dims))
        assert run(n, u, STEP).tobytes() == run(n, u, STEP / 2).tobytes()


# Blocks whose update() is an integration rule and no exact solution: they agree with deriv() for small steps.
SMALL_STEP = {"bouc_wen_oscillator": 1e-6}
RAMP = {"bouc_wen_oscillator"}  # the input runs linearly over a step


@pytest.mark.parametrize("name", [n for n in BLOCKS if block_types()[n].of("cstate")])
def test_deriv_integrates_to_update(name: str) -> None:
    block, h = block_types()[name], SMALL_STEP.get(name, STEP)
    rise = 0.7 * h / STEP  # of the inputs over the step
    for n in some(block):
        ramp = name in RAMP or n.values.get("hold") == "foh"
        raw = Raw(n)
        u = rows(block, dict(n.dims), 24)
        raw.run(u, STEP)
        raw.prepare(h)
        begin, last = raw.x.copy(), u[-1]

        c = raw.n_cstates

        def f(t: float, x: np.ndarray, raw: Raw = raw, last: np.ndarray = last, ramp: bool = ramp) -> np.ndarray:
            raw.x[: raw.n_cstates] = x
            raw.set_inputs(last + rise * (t / h if ramp else 1.0), t)
            return raw.deriv()

        by_deriv = solve_ivp(f, (0, h), begin[:c], method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
        raw.x[:] = begin
        raw.set_inputs(last + rise, h)
        raw.update(h)
        change = np.abs(raw.x[:c] - begin[:c])
        assert (np.abs(raw.x[:c] - by_deriv) <= 1e-6 * change + 1e-10 * np.abs(begin[:c]).max()).all()
        assert change.max() > 0


def one_sided(raw: Raw, du: np.ndarray, dx: np.ndarray, e: float) -> np.ndarray:
    """Second-order difference of outputs and derivatives to the side of the seeds, and nowhere across it."""
    u, x = raw.u.copy(), raw.x.copy()

    def at(s: float) -> np.ndarray:
        raw.u[:] = u + s * du
        raw.x[: raw.n_cstates] = x[: raw.n_cstates] + s * dx
        both = raw.output(), raw.deriv() if raw.c.deriv else np.zeros(0)
        raw.u[:], raw.x[:] = u, x
        return np.concatenate(both)

    return np.asarray((4 * at(e / 2) - at(e) - 3 * at(0.0)) / e)


# outputs by an integration rule: its derivative is that of the operator up to the error of the rule
RULE = {"bouc_wen": 1e-5, "duhem": 1e-4}
WIDTH = {
    "bouc_wen_oscillator": 1e-8,
    "constraint_factor_inverse": 1e-7,
}  # of the difference: small velocities, steep branches
DIMS = {  # other sizes than those of the table
    "mlp": [{"n_in": 3, "n_hidden": 4, "n_out": 2}],
    "polynomial_narx": [{"n_k": 0}, {"n_k": 0, "n_u": 2, "n_f": 2, "n_y": 1, "q": 3}],
    "preisach": [{"n": 7}],
    "transfer_function": [{"na": 3, "nb": 3}, {"na": 3, "nb": 1}],
}


@every_block
@pytest.mark.parametrize("corner", [False, True])
def test_tangent_is_the_one_sided_derivative(name: str, corner: bool) -> None:
    """At inputs that no update has seen, and at the last input itself: there a seed back is a reversal."""
    block, rng, depends = block_types()[name], np.random.default_rng(4), False
    real = [v for v in block.parameters if v.type == "real"]
    nodes = [perturbed(n, {v.name for v in real}) for n in some(block)]
    for dims in DIMS.get(name, []):
        sizes = Node("b", name, dims).sizes
        nodes.append(
            Node("b", name, dims, {v.name: 0.1 * rng.normal(size=sizes[v.name]) for v in real if v.size != "1"})
        )
    for n in nodes:
        raw = Raw(n)
        for rounds in range(12):
            u = rows(block, dict(n.dims), 16 + rounds, seed=rounds)
            raw.run(u, STEP)
            if not corner:
                raw.set_inputs(rng.uniform(-1.3, 1.3, u.shape[1]), 1.0)
            before = [a.tobytes() for a in (raw.p, raw.x, raw.u)]
            for _ in range(4):
                du, dx = rng.normal(size=raw.u.size), rng.normal(size=raw.n_cstates)
                du[raw.time] = 0.0
                dy, ddx = raw.tangent(du, dx)
                got = np.concatenate([dy, ddx])
                assert [a.tobytes() for a in (raw.p, raw.x, raw.u)] == before
                want = one_sided(raw, du, dx, WIDTH.get(name, 1e-5))
                finite = np.isfinite(got)
                assert (np.abs(want[~finite]) > 10).all(), "an infinite slope where there is none"
                scale = 1 + np.abs(want[finite]).max(initial=0)
                assert (np.abs(got - want)[finite] <= RULE.get(name, 1e-6) * scale).all(), (n.values, raw.u, got, want)
                depends |= bool(np.abs(want[finite]).max(initial=0) > 1e-3)
    assert depends == bool(block.raw.tangent), "a dependency without a tangent, or a tangent without one"


def candidates(v: Var, flat: np.ndarray) -> list[np.ndarray]:
    """Other legal values of a parameter, gentle ones first."""
    up = np.linspace(1.0, 2.0, flat.size) if flat.size > 1 else np.array([1.5])
    tried = [flat * up + 0.1, flat * up, flat * 0.5, flat - 0.4, flat * 0 + 0.3 * up, flat * 0 - 0.3 * up, flat + 1.0]
    if v.type == "int":
        tried = [flat + 1, flat - 1, flat + 2]
    return [t for t in tried if (t >= v.lo).all() and (t <= v.hi).all() and not np.array_equal(t, flat)]


def plain(flat: np.ndarray) -> Any:
    return [float(f) for f in flat] if flat.size > 1 else float(flat[0])


def perturbed(n: Node, names: set[str]) -> Node:
    """The node with all these parameters changed as far as they fit together."""
    for v in n.block.parameters:
        for value in candidates(v, n.value(v.name)) if v.name in names else []:
            made = node(n.block, {**n.values, v.name: plain(value)})
            if made and made.dims == n.dims:
                n = made
                break
    return n


@every_block
def test_every_parameter_has_an_effect(name: str) -> None:
    block = block_types()[name]
    nodes = some(block)
    nodes += [perturbed(n, {v.name for v in block.parameters if v.type == "real"}) for n in nodes]
    u = rows(block, dict(nodes[0].dims))
    base = [run(n, u) for n in nodes]
    without: list[str] = []
    for v in block.parameters:
        if v.choices or v.type == "bool":
            choices: list[Any] = list(v.choices or (0, 1))
            pairs = [(a, b) for i, a in enumerate(choices) for b in choices[:i]]
            for a, b in pairs:
                if not any(
                    n.values[v.name] == a
                    and (other := node(block, {**n.values, v.name: b}))
                    and differ(y, run(other, u))
                    for n, y in zip(nodes, base, strict=True)
                ):
                    without.append(f"{v.name} = {a} against {b}")
        elif not any(
            (other := node(block, {**n.values, v.name: plain(value)}))
            and other.dims == n.dims
            and differ(y, run(other, u))
            for n, y in zip(nodes, base, strict=True)
            for value in candidates(v, n.value(v.name))
        ):
            without.append(v.name)
    assert without == []


def differ(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.abs(a - b).max() > 1e-7 * np.abs(a).max())


# ---- errors ---------------------------------------------------------------------------------------------------------
def noun(v: Var) -> str:
    """The range of a variable as the error sentence must write it."""
    if v.choices:
        return f"one of {v.type} (0, 1, ...)"
    if v.type == "bool":
        return "a bool (0 or 1)"
    left = "(0" if v.lo == POSITIVE else "(-inf" if v.lo == -np.inf else f"[{v.lo:.10g}"
    right = "inf)" if v.hi == np.inf else f"{v.hi:.10g}]"
    return f"{'a float' if v.type == 'real' else 'an int'} in {left}, {right}"


def illegal(v: Var) -> list[tuple[float, str]]:
    """Values that must be refused, with how the sentence writes them."""
    bad = [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf")]
    if v.lo > -np.inf:
        bad.append((-1.0, "-1") if v.lo >= 0 else (1.5 * v.lo, f"{1.5 * v.lo:.10g}"))
    if v.lo == POSITIVE:
        bad.append((0.0, "0"))
    if v.hi < np.inf and v.hi > 0:
        bad.append((2 * v.hi + 1, f"{2 * v.hi + 1:.10g}"))
    if v.type != "real":
        bad.append((0.5, "0.5"))
    return bad


@every_block
def test_values_out_of_range_are_refused_in_one_sentence(name: str) -> None:
    block, graph = block_types()[name], default(name)
    executor = graph.executor()
    checked = 0
    for v in (*block.parameters, *block.of("input")):
        port = graph.port(v.name)
        role = "input" if v.kind == "input" else "parameter"
        for value, written in illegal(v):
            if role == "parameter":
                with pytest.raises(InputError) as e:
                    Node(name, name, dict(graph.nodes[0].dims), {v.name: value})
                assert str(e.value) == f"The '{v.name}' parameter of {name} must be {noun(v)}. Got {written} instead."
            with pytest.raises(InputError) as e:
                executor.set(port.reference, value)
            assert str(e.value) == f"The '{v.name}' {role} of {name} must be {noun(v)}. Got {written} instead."
            checked += 1
        for unknown in ("no_such_word",) if v.choices else ():
            with pytest.raises(InputError, match="Got 'no_such_word' instead"):
                Node(name, name, {}, {v.name: unknown})
    assert checked or not (block.parameters or block.of("input"))


def test_the_sentence_of_the_design() -> None:
    with pytest.raises(InputError) as e:
        Node("sliding_mode", "sliding_mode", {}, {"rho": -1})
    assert str(e.value) == "The 'rho' parameter of sliding_mode must be a float in [0, inf). Got -1 instead."


@every_block
def test_sizes_out_of_range_are_refused(name: str) -> None:
    for d in block_types()[name].dims:
        for n in (d.lo - 1, d.hi + 1):
            with pytest.raises(InputError) as e:
                Node(name, name, {d.name: n})
            assert str(e.value) == f"The size '{d.name}' of {name} must be an int in [{d.lo}, {d.hi}]. Got {n}."
