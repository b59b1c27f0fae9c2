"""State of every block: pure outputs, true feed-through, bit-exact saved states and files."""

from pathlib import Path

import numpy as np
from excitation import STEP, every_block, perturbed, rows, run, some
from raw import MARK, Raw

from hystfmu import Graph, Unit
from hystfmu.core.library import block_types
from hystfmu.model import Model


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
    """A false declaration of feed-through would make a false algebraic loop."""
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
        assert np.concatenate([first, steps(unit, ins, u[1:], 1, outs)]).tobytes() == by_graph.tobytes()
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


@every_block
def test_every_element_of_memory_is_used(name: str) -> None:
    """An element of a row of fixed size that is neither written at the start nor moved by a run is not needed."""
    block = block_types()[name]
    own = [v for v in block.of("state", "derived") if v.size.isdigit()]
    unused = {v.name: np.ones(int(v.size), dtype=bool) for v in own}
    for n in some(block):
        for mark in (MARK, None):
            raw, u = Raw(n), rows(n.block, dict(n.dims), 60)
            for v in own:
                (raw.x if v.kind == "state" else raw.p)[raw.places[v.name]] = v.start if mark is None else mark
            raw.prepare(0.0)
            raw.init(mark)
            for k, row in enumerate(u if mark is None else u[:1]):
                raw.set_inputs(row, k * STEP)
                raw.prepare(STEP if k else 0.0)
                raw.update(STEP if k else 0.0)
            raw.prepare(STEP)
            for v in own:
                now = (raw.x if v.kind == "state" else raw.p)[raw.places[v.name]]
                unused[v.name] &= now == (v.start if mark is None else mark)
    if not any(n.block.trial for n in some(block)):  # its memory follows from the blocks behind it
        assert not {name: np.flatnonzero(at).tolist() for name, at in unused.items() if at.any()}
