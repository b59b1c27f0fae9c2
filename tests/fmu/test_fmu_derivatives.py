"""Directional and adjoint derivatives in every mode, against differences; untrusted block files, forged phases."""

import os
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from block_files import input_between_outputs, raw_bytes
from fmu_events import Events
from fmu_master import BLOCKS, DISCARD, ERROR, OK, Array, H, Make, Master, loop, mixed, rows, single

from hystfmu.graph import Graph, Node
from hystfmu.graph.graph import is_sampled

GRAPHS: dict[str, Callable[[], Graph]] = {"loop": loop, "mixed": mixed, **{n: lambda n=n: single(n) for n in BLOCKS}}
PLAYS = Graph.single(Node("p", "prandtl_ishlinskii", {}, {"w0": 0.3, "r": [0.1, 0.4], "w": [0.5, 0.2]}))


def references(graph: Graph, kind: str) -> list[int]:
    """Return the references of all elements of all inputs or outputs."""
    return [p.reference + k for p in graph.ports if p.kind == kind for k in range(p.size)]


def unknowns(graph: Graph) -> list[int]:
    """Return the references of outputs, then derivatives."""
    n, first = len(graph.continuous_states), sum(p.size for p in graph.ports) + 1
    return references(graph, "output") + list(range(first + n, first + 2 * n))


def knowns(graph: Graph) -> list[int]:
    """Return the references of inputs, then states."""
    first = sum(p.size for p in graph.ports) + 1
    return references(graph, "input") + list(range(first, first + len(graph.continuous_states)))


def answer(m: Events, point: Array) -> Array:
    """Return outputs and derivatives in Continuous-Time Mode for the given inputs and states."""
    n = m.n_states
    m.put(point[: len(point) - n])
    assert m.set_x(point[len(point) - n :]) == OK
    return np.array(m.outputs() + list(m.derivatives() if n else ()))


@pytest.mark.some(20)
@pytest.mark.parametrize("fmi", [2], indirect=True)
@pytest.mark.parametrize("name", list(GRAPHS))
def test_the_sign_of_the_seed_selects_the_side(make: Make, name: str) -> None:
    graph = GRAPHS[name]()
    m = make(graph, "me")
    u = rows(graph, 9)
    y = m.integrate(u[:7], H, lambda f, t, end, x: x + (end - t) * f(t, x))
    assert np.isfinite(y).all()
    known, unknown = knowns(graph), unknowns(graph)
    x, moved = m.x, 0
    for row in (u[6], u[8], -u[8]):  # at the last input, and away from it
        point = np.concatenate([row, x])
        for j, reference in enumerate(known):
            for side in (1.0, -1.0):
                base = answer(m, point)
                status, slope = m.tangent(unknown, [reference], np.array([side]), len(unknown))
                e = 1e-6 * max(1.0, abs(point[j]))
                there = point.copy()
                there[j] += side * e
                difference = (answer(m, there) - base) / e
                if status == DISCARD:  # the inverse of a flat branch has an infinite slope
                    assert m.messages[-1][2] == "fmi2GetDirectionalDerivative: the derivative is not finite here."
                    assert np.abs(difference).max() > 100
                    continue
                assert status == OK, m.messages[-1:]
                np.testing.assert_allclose(slope, difference, rtol=2e-4, atol=2e-4 * (1 + np.abs(base).max()))
                moved += np.abs(slope).max() > 1e-3
    still = ("implicit_inverse", "in_range", "quantiser")  # it needs a model; outputs that jump
    if known and name not in still and (name in ("loop", "mixed") or not is_sampled(graph)):
        assert moved, "all but sampled blocks respond in Continuous-Time Mode"


def test_a_kink_has_two_derivatives(make: Make) -> None:
    """At a maximum of the input all plays follow an increase, none follows a decrease."""
    for interface in ("me", "cs"):
        m = make(PLAYS, interface)
        if interface == "me":
            m.begin(np.array([0.0]))
            m.put(np.array([1.0]))
            assert m.completed() == OK
        else:
            m.initialize()
            assert m.set("u", 1.0) == OK
            assert m.step(0.0) == OK
        for seed, slope in ((1.0, 1.0), (2.0, 2.0), (-1.0, -0.3), (0.0, 0.0)):
            status, got = m.tangent([1], [0], np.array([seed]), 1)
            assert status == OK
            assert got[0] == pytest.approx(slope, rel=1e-15)


def test_both_standards_and_the_adjoint_agree(make: Make, fmi: int) -> None:
    """The adjoint is the transposed matrix, evaluated in the same directions."""
    if fmi == 2:
        pytest.skip("FMI 2.0 has no adjoint")
    for graph in (mixed(), single("bouc_wen_oscillator"), single("mlp"), single("scaling")):
        m = make(graph, "me")
        m.begin(rows(graph, 2)[1])
        n_y = sum(p.size for p in graph.ports if p.kind == "output") + m.n_states
        n_u = graph.n_inputs + m.n_states
        first = sum(p.size for p in graph.ports) + 1
        unknown = [p.reference for p in graph.ports if p.kind == "output"]
        known = [p.reference for p in graph.ports if p.kind == "input"]  # arrays have one reference
        unknown += range(first + m.n_states, first + 2 * m.n_states)
        known += range(first, first + m.n_states)
        columns = [m.tangent(unknown, known, np.eye(n_u)[k], n_y)[1] for k in range(n_u)]
        weights = np.cos(np.arange(n_y))
        status, got = m.tangent(unknown, known, weights, n_u, "Adjoint")
        assert status == OK
        np.testing.assert_allclose(got, np.array(columns) @ weights, rtol=1e-14, atol=1e-14)
        assert m.tangent(unknown, known, weights, n_u + 1, "Adjoint")[0] == ERROR
        assert m.tangent(unknown, known, np.ones(n_u + 1), n_y)[0] == ERROR
        assert "the variables have" in m.messages[-1][2]


@pytest.mark.parametrize("name", ["prandtl_ishlinskii", "creep", "mlp", "bouc_wen"])
def test_co_simulation_gives_derivatives_of_the_next_step_and_keeps_its_outputs(make: Make, name: str) -> None:
    graph = single(name)
    u, unknown, known = rows(graph, 3), unknowns(graph), knowns(graph)
    m, exchange = make(graph), make(graph, "me")
    m.initialize()
    exchange.begin(np.zeros(graph.n_inputs))
    at = 0
    for p in graph.ports:
        if p.kind == "input" and m.fmi == 3:
            known, unknown = [p.reference], references(graph, "output")
        if p.kind == "input":
            assert m.set(p.name, *u[1, at : at + p.size]) == OK
            at += p.size
    assert m.step(0.0) == OK
    before = m.memory()
    seed = np.ones(len(known) if m.fmi == 2 else graph.n_inputs)
    status, got = m.tangent(unknown, known, seed, len(unknown))
    assert status == OK
    assert m.memory() == before
    assert np.isfinite(got).all()
    if name != "creep":
        exchange.put(u[1])
        assert exchange.completed() == OK
        np.testing.assert_array_equal(exchange.tangent(unknown, known, seed, len(unknown))[1], got)


@pytest.mark.parametrize("name", ["prandtl_ishlinskii", "pid", "creep", "bouc_wen", "loop"])
def test_initialization_mode(make: Make, name: str) -> None:
    """The derivative includes the whole initialisation, as differences show."""
    graph = GRAPHS[name]()
    m = make(graph, "me")
    assert m.enter() == OK
    row = rows(graph, 1)[0] + 0.3
    unknown, inputs = unknowns(graph), references(graph, "input")

    def start(point: Array) -> Array:
        m.put(point)
        return np.array(m.outputs() + list(m.derivatives() if m.n_states else ()))

    for j, reference in enumerate(inputs):
        e = np.zeros(len(row))
        e[j] = 1e-6
        base = start(row)
        want = (start(row + e) - base) / 1e-6
        start(row)
        before = m.memory()
        status, got = m.tangent(unknown, [reference], np.array([1.0]), len(unknown))
        assert status == OK
        np.testing.assert_allclose(got, want, rtol=1e-4, atol=1e-5 * (1 + np.abs(base).max()))
        m.outputs()
        assert m.memory() == before


def test_a_sample_in_event_mode(make: Make) -> None:
    """A controller responds to a sample with its proportional gain plus the integral over one period."""
    graph = Graph.single(Node("c", "pid", {}, {"Kp": 0.4, "Ki": 60.0})).with_step(H)
    m = make(graph, "me")
    m.begin(np.zeros(3))
    y_d, u = graph.port("y_d").reference, graph.port("u").reference
    assert m.tangent([u], [y_d], np.ones(1), 1)[1][0] == 0, "the output is held between samples"
    assert m.set_time(H) == OK
    assert m.call("EnterEventMode") == OK
    assert m.set("y_d", 0.5) == OK
    y = m.get("u")
    status, slope = m.tangent([u], [y_d], np.ones(1), 1)
    assert (status, m.get("u")) == (OK, y)
    assert slope[0] == pytest.approx(0.4 + 60.0 * H, rel=1e-6)
    assert m.update() == OK
    assert m.get("u") == y


def test_missing_derivatives_are_refused(make: Make) -> None:
    m = make(mixed(), "me")
    m.begin(np.array([0.2]))
    u, y = m.ports["u"].reference, m.ports["y"].reference
    gain = m.ports["op_w0"].reference
    one, before = np.ones(1), m.memory()
    for unknown, known, text in (
        (y, gain, "'op_w0' is not an input or continuous state here."),
        (u, u, "'u' is not an output or derivative here."),
        (y, 10**6, "no variable has the value reference 1000000."),
    ):
        assert m.tangent([unknown], [known], one, 1)[0] == ERROR
        assert m.messages[-1][2] == f"fmi{m.fmi}GetDirectionalDerivative: {text}"
    simulation = make(mixed())
    simulation.initialize()
    assert simulation.tangent([y], [u], one, 1)[0] == ERROR
    end = "GetDirectionalDerivative is not available: sampled blocks respond in steps and have no derivatives."
    assert simulation.messages[-1][2] == f"fmi{m.fmi}{end}"
    assert m.memory() == before


# ---- edge cases that the MC/DC run (tests/stress) listed as uncovered; tests/c/drive_edges.c has failures of malloc --
ONE = np.ones(1)


# ---- derivatives ----------------------------------------------------------------------------------------------------


def test_states_are_not_knowns_in_initialization_mode(make: Make) -> None:
    m = make(mixed(), "me")
    assert m.enter() == OK
    x = sum(p.size for p in m.graph.ports) + 1
    assert m.tangent([m.ports["y"].reference], [x], ONE, 1)[0] == ERROR
    assert m.messages[-1][2].endswith("is not an input or continuous state here.")


def test_derivative_of_a_sample_with_respect_to_a_continuous_state(make: Make) -> None:
    """rate = (x - previous x) / H and y = x + 1e-3 rate, with x a sum of the states."""
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    assert m.set_time(H) == OK
    assert m.call("EnterEventMode") == OK
    y, x, du = (m.ports[n].reference for n in ("y", "x", "du"))
    state = sum(p.size for p in m.graph.ports) + 1
    seen = []
    for k in range(m.n_states):
        slope = m.tangent([x, du, y], [state + k], ONE, 3)[1]
        assert slope == pytest.approx(slope[0] * np.array([1.0, 1 / H, 1 + 1e-3 / H]), rel=1e-6)
        seen.append(slope[0])
    assert max(np.abs(seen)) > 0


def test_adjoint_of_a_failing_initialisation(make: Make, fmi: int) -> None:
    if fmi == 2:
        pytest.skip("FMI 2.0 has no adjoint")
    m = make()
    assert m.enter() == OK
    assert m.set("r", *np.linspace(1.0, 0.0, 10)) == OK
    assert m.tangent([m.ports["y"].reference], [m.ports["u"].reference], ONE, 1, "Adjoint")[0] == ERROR
    assert "must not decrease" in m.messages[-1][2]


def untrusted(tmp_path: Path, fmi: int, file: bytes) -> Master:
    """Make an instance from a given block file."""
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "block.bin").write_bytes(file)
    token = file[20:60].rstrip(b"\0").decode()
    return Master(single("scaling"), tmp_path, fmi, token=token, location=(tmp_path / "own").as_uri())


def test_ports_in_any_order(tmp_path: Path, fmi: int) -> None:
    """Two gains, 2 and 3; the file lists the input between the outputs, after the parameters."""
    file, graph = input_between_outputs()
    first = sum(p.size for p in graph.ports if p.kind not in ("input", "output"))
    a, u, b = first, first + 1, first + 2
    m = untrusted(tmp_path, fmi, file)
    assert m.enter() == OK
    assert m.tangent([a, b], [u], ONE, 2)[1] == pytest.approx([2.0, 3.0], rel=1e-6)
    assert m.call("ExitInitializationMode") == OK
    assert m.tangent([b, a], [u], ONE, 2)[1].tolist() == [3.0, 2.0]
    m.free()


# ---- files ----------------------------------------------------------------------------------------------------------
def test_a_file_with_parameters_that_do_not_fit(tmp_path: Path, fmi: int) -> None:
    m = untrusted(tmp_path, fmi, raw_bytes(Node("f", "feedforward", {}, {"gain": 0.0})))
    assert not m.c.value
    assert m.messages[0][2].endswith("at f: gain must not be 0")


@pytest.mark.skipif(sys.platform != "linux", reason="opens a folder and a pipe as files")
@pytest.mark.parametrize("kind", ["folder", "pipe"])
def test_paths_that_are_not_regular_files(tmp_path: Path, fmi: int, kind: str) -> None:
    file = tmp_path / "block.bin"
    opened = -1
    if kind == "folder":
        file.mkdir()
    else:
        os.mkfifo(file)
        opened = os.open(file, os.O_RDWR)  # opening it for reading would wait for a writer
    m = Master(single("scaling"), tmp_path / "good", fmi, location=tmp_path.as_uri())
    assert not m.c.value
    assert m.messages == [(ERROR, "logStatusError", f"cannot read '{file}'")]
    if opened >= 0:
        os.close(opened)


# ---- saved states ---------------------------------------------------------------------------------------------------
EVENT, STEPPING, CONTINUOUS, INITIALIZATION = 4, 8, 16, 2


@pytest.mark.parametrize(
    ("interface", "legal"),
    [("cs", {STEPPING, INITIALIZATION}), ("me", {EVENT, CONTINUOUS, INITIALIZATION}), ("event", {EVENT, STEPPING})],
)
def test_a_forged_phase(make: Make, fmi: int, interface: str, legal: set[int]) -> None:
    """Bytes with a valid checksum may contain only phases of the interface."""
    if (fmi, interface) == (2, "event"):
        pytest.skip("FMI 2.0 has no Event Mode in Co-Simulation")
    m = make(Graph.single(Node("p", "prandtl_ishlinskii")), interface)
    content = m.memory()
    for phase in {EVENT, STEPPING, CONTINUOUS, *legal, 0, 3}:
        forged = content[:72] + struct.pack("<i", phase) + content[76:]
        forged = forged[:12] + struct.pack("<I", zlib.crc32(forged[16:])) + forged[16:]
        assert m.deserialize(forged)[0] == (OK if phase in legal else ERROR), phase
