"""Inputs at the end of a step: derivatives in FMI 2.0, intermediate update in FMI 3.0, against closed forms."""

import ctypes as C
import math
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.simulation import Input as Source
from fmu_master import ERROR, OK, Array, H, Make, Master, mixed, only_fmi2, single
from fmu_slave import Slave

from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output

SIZE = C.c_size_t(1)


def slope(m: Master, value: float, order: int = 1, name: str = "u") -> int:
    """Set a derivative of an input."""
    reference, n = C.c_uint(m.ports[name].reference), C.c_int(order)
    return m.call("SetRealInputDerivatives", C.byref(reference), SIZE, C.byref(n), C.byref(C.c_double(value)))


def play(width: float) -> Graph:
    return Graph.single(Node("play", "backlash_sum", {"n": 1}, {"w0": 0.0, "r": [width], "w": [1.0]})).with_step(H)


def test_fmpy_with_derivatives_meets_the_closed_form_of_a_play(tmp_path: Path) -> None:
    """On a ramp the play follows at its half-width, after a reversal on the other side; without slopes a step late."""
    path = export_fmu(play(0.1), tmp_path / "play.fmu")
    t = np.arange(201) * H
    u = np.where(t <= 0.1, 10 * t, 1 - 10 * (t - 0.1))
    exact = np.maximum(u - 0.1, 0.0)
    exact[t > 0.1] = np.minimum(0.9, u[t > 0.1] + 0.1)
    # begins early and names the kink twice, because fmpy has no slope at the first point and the left one at a kink
    table = np.array([(-0.1, -1.0), (0.1, 1.0), (0.1, 1.0), (0.2, 0.0)], dtype=[("time", float), ("u", float)])

    description = fmpy.read_model_description(str(path))

    def run(derivatives: bool) -> Array:
        slave = Slave(path, tmp_path / "unpacked")
        source = Source(slave.fmu, description, table, set_input_derivatives=derivatives)
        # fmpy 0.3.32 has room for nine derivatives whatever the number of inputs, and stops at any other
        source.continuous = [c._replace(derivatives=(C.c_double * len(c.vrs))()) for c in source.continuous]
        y = [slave.start({"u": 0.0})[0]]
        for k in range(len(t) - 1):
            source.apply(t[k], after_event=True)
            y.append(slave.step(t[k], H)[0])
        slave.free()
        return np.array(y)

    assert np.abs(run(True) - exact).max() < 1e-13
    late = np.concatenate([exact[:1], exact[:-1]])
    assert np.abs(run(False) - late).max() < 1e-13
    assert np.abs(late - exact).max() == pytest.approx(0.01, rel=1e-6)  # 1 % of the span


@only_fmi2
def test_a_lag_with_lines_between_points_meets_its_closed_form(make: Make) -> None:
    """T y' + y = u for u = t^2: with first and second derivative the ends of all steps are exact."""
    values = {"b": [1.0], "a": [0.02, 1.0], "hold": "foh"}
    m = make(Graph.single(Node("lag", "transfer_function", {"nb": 0, "na": 1}, values)).with_step(H))
    m.initialize()
    y, x = [], 0.0
    fall, gain = math.exp(-H / 0.02), 0.02 * (1 - math.exp(-H / 0.02)) / H
    for k in range(50):
        t = k * H
        assert m.set("u", t * t) == OK
        assert slope(m, 2 * t) == OK
        assert slope(m, 2.0, order=2) == OK
        assert m.step(t) == OK
        a, b = t * t, (t + H) ** 2
        x = fall * x + (gain - fall) * a + (1 - gain) * b  # exact response to the line from a to b
        y.append((m.get("y"), x))
    assert np.ptp(np.array(y), axis=0).min() > 1e-4
    assert max(abs(a - b) for a, b in y) < 1e-15


@only_fmi2
def test_a_sampled_block_samples_at_the_end_of_the_step(make: Make) -> None:
    m = make(Graph.single(Node("d", "differentiator")).with_step(H))
    m.initialize()
    for k in range(5):
        assert m.set("u", 3.0 * k * H) == OK
        assert slope(m, 3.0) == OK
        assert m.step(k * H) == OK
        assert m.get("u") == pytest.approx(3.0 * (k + 1) * H, rel=1e-15)
    assert m.get("du") == pytest.approx(3.0, rel=1e-12)


@only_fmi2
def test_derivatives_of_zero_change_no_bit(make: Make) -> None:
    graph, u = mixed(), np.sin(np.arange(100.0))
    plain, zero = make(graph), make(graph)
    plain.initialize()
    zero.initialize()
    want = plain.run(u)
    got = []
    for k, value in enumerate(u):
        assert zero.set("u", float(value)) == OK
        assert slope(zero, 0.0) == OK
        assert zero.step(k * H) == OK
        got.append(zero.get("y"))
    assert np.array(got).tobytes() == np.array(want).tobytes()


# ---- FMI 3.0 ------------------------------------------------------------------------------------------------------
_B, _D = C.c_bool, C.c_double


UPDATE = C.CFUNCTYPE(None, C.c_void_p, _D, _B, _B, _B, _B, C.POINTER(_B), C.POINTER(_D))


class Asked(Master):
    """An FMI 3.0 instance that asks `answer(t)` for what to do in an intermediate update."""

    def __init__(self, graph: Graph, folder: Path) -> None:
        self.answer: Callable[[float], Any] = lambda t: None
        self.flags: list[tuple[bool, ...]] = []
        super().__init__(graph, folder, 3)

    def instantiate(self, location: bytes | None, **given: Any) -> C.c_void_p:
        """Make an instance whose updates come here."""

        def update(_: Any, t: float, wanted: bool, readable: bool, done: bool, early: bool, *_out: Any) -> None:
            self.flags.append((wanted, readable, done, early))
            self.answer(t)

        self._update = UPDATE(update)
        return super().instantiate(location, references=[self.ports["u"].reference], update=self._update)


def test_an_intermediate_update_hands_over_the_input_at_the_end(tmp_path: Path) -> None:
    m = Asked(play(0.1), tmp_path)
    m.answer = lambda t: m.set("u", 10 * t)
    m.initialize()
    y = []
    for k in range(50):
        assert m.step(k * H) == OK
        y.append(m.get("y"))
    exact = np.maximum(10 * (np.arange(50) + 1) * H - 0.1, 0.0)
    assert np.abs(np.array(y) - exact).max() < 1e-14
    assert set(m.flags) == {(True, False, False, False)}
    m.free()


def test_only_inputs_are_set_in_an_intermediate_update(tmp_path: Path) -> None:
    statuses: list[int] = []
    m = Asked(play(0.1), tmp_path)
    m.initialize()

    def answer(t: float) -> None:
        statuses.extend([m.set("w0", 2.0), m.step(0.0), m.call("Terminate"), m.set("u", 0.5)])

    m.answer = answer
    assert m.step(0.0) == OK
    assert statuses == [ERROR, ERROR, ERROR, OK]
    assert any("only inputs are set in an intermediate update" in x[2] for x in m.messages)
    assert any("is not allowed in the state 'Intermediate Update Mode' of Co-Simulation" in x[2] for x in m.messages)
    assert m.get("y") == 0.4
    m.free()


def test_an_input_that_is_not_finite_there_discards_the_step(tmp_path: Path) -> None:
    m = Asked(play(0.1), tmp_path)
    m.initialize()
    m.answer = lambda t: m.set("u", math.nan)
    assert m.step(0.0) == 2
    m.answer = lambda t: m.set("u", 0.3)
    assert m.set("u", 0.3) == OK
    assert m.step(0.0) == OK
    assert m.get("y") == pytest.approx(0.2, abs=1e-15)
    m.free()


@pytest.mark.parametrize(("names", "update"), [(True, False), (False, True)], ids=["callback", "variables"])
def test_intermediate_updates_without_their_callback_or_variables_are_refused(
    tmp_path: Path, names: bool, update: bool
) -> None:
    m = Asked(play(0.1), tmp_path)
    m.free()
    m.messages.clear()
    references = C.byref(C.c_uint(m.ports["u"].reference)) if names else None
    location = m.resources.as_uri().encode()
    words = [b"i", m.token.encode(), location, 0, 0, 0, 0, references, C.c_size_t(1), None]
    made = m.lib.fmi3InstantiateCoSimulation
    assert not made(*words, m._log, m._update if update else None)
    assert m.messages == [(ERROR, "logStatusError", "Intermediate updates need a callback and a list of variables.")]
    assert not made(*words, None, m._update if update else None)  # without a logger nothing is said


def test_the_description_declares_both(tmp_path: Path) -> None:
    graph = single("prandtl_ishlinskii")
    two = fmpy.read_model_description(str(export_fmu(graph, tmp_path / "2.fmu")))
    assert two.coSimulation.canInterpolateInputs
    three = fmpy.read_model_description(str(export_fmu(graph, tmp_path / "3.fmu", 3)))
    assert three.coSimulation.providesIntermediateUpdate
    (u,) = ET.fromstring(zipfile.ZipFile(tmp_path / "3.fmu").read("modelDescription.xml")).findall(
        ".//*[@intermediateUpdate='true']"
    )
    assert u.get("name") == "u"


# ---- every order of every element ------------------------------------------------------------------------------------
N = 3


def ways() -> Graph:
    """Return a graph with two scalar inputs and one of three elements, each of which is an output."""
    nodes = [Node(n, "sum", {"n": 1}, {"k": [1.0]}) for n in "ab"] + [Node("s", "scaling", {"n": N})]
    inputs = [Input("ua", ("a.u[1]",)), Input("us", ("s.u",)), Input("ub", ("b.u[1]",))]
    outputs = [Output("ya", "a.y"), Output("yb", "b.y"), Output("ys", "s.y")]
    return Graph(nodes, [], inputs, outputs).with_step(H)


def elements(m: Master) -> list[int]:
    """Return the references of all elements of all inputs."""
    return [m.ports[n].reference + k for n in ("ua", "us", "ub") for k in range(m.ports[n].size)]


def slopes(m: Master, *rows: tuple[int, int, float]) -> int:
    """Set derivatives by (reference, order, value) in one call."""
    refs, orders, values = zip(*rows, strict=True)
    n = len(rows)
    arrays = (C.c_uint * n)(*refs), C.c_size_t(n), (C.c_int * n)(*orders), (C.c_double * n)(*values)
    return m.call("SetRealInputDerivatives", *arrays)


def read(m: Master) -> list[float]:
    """Return the values of all elements of all inputs."""
    return [x for n in ("ua", "us", "ub") for x in np.atleast_1d(m.get(n))]


def begun(make: Make) -> Master:
    m = make(ways())
    m.initialize()
    assert m.set("us", 1.0, 2.0, 3.0) == OK
    return m


@only_fmi2
def test_every_order_of_every_element_is_its_own(make: Make) -> None:
    """u + s1 h + s2 h^2 / 2 + s3 h^3 / 6 at the end of a step of h; a step later all stay where they are."""
    h = 0.5
    seed = int(np.random.default_rng().integers(2**32))
    print("seed", seed)
    given = np.random.default_rng(seed).uniform(-1, 1, (N + 2, 3))
    m = begun(make)
    start = np.array(read(m))
    rows = [(r, k + 1, float(given[j, k])) for j, r in enumerate(elements(m)) for k in range(3)]
    assert slopes(m, *rows) == OK
    content = m.memory()
    assert slopes(m, *rows[::-1]) == OK
    assert m.memory() == content, "in any order of a call, and at no other place"
    for t in (0.0, h, 2 * h):
        assert m.step(t, h) == OK
        want = start + given @ [h, h**2 / 2, h**3 / 6]
        np.testing.assert_allclose(read(m), want, rtol=1e-14, atol=1e-15)


@only_fmi2
def test_each_derivative_is_part_of_the_state_of_its_element(make: Make) -> None:
    m = begun(make)
    plain = m.memory()
    seen = set()
    for reference in elements(m):
        for order in (1, 2, 3):
            state = m.save()
            assert slopes(m, (reference, order, 0.75)) == OK
            content = m.memory()
            differs = [k // 8 for k in range(len(plain)) if plain[k] != content[k]]
            seen.add(max(differs))
            again, copy = m.deserialize(content)
            assert again == OK
            assert m.restore(copy) == OK
            before = read(m)
            assert m.step(0.0) == OK
            moved = np.subtract(read(m), before)
            place = elements(m).index(reference)
            assert moved[place] == pytest.approx(0.75 * H**order / math.factorial(order), rel=1e-6)
            assert np.count_nonzero(moved) == 1
            assert m.restore(state) == OK
            assert m.memory() == plain
            m.forget(state), m.forget(copy)
    assert len(seen) == 3 * (N + 2), "a place for each"


@only_fmi2
def test_a_zero_after_another_derivative_keeps_the_other(make: Make) -> None:
    m = begun(make)
    first, second = elements(m)[:2]
    assert slopes(m, (first, 1, 8.0), (second, 1, 0.0)) == OK
    assert slopes(m, (second, 2, 0.0)) == OK
    before = read(m)
    assert m.step(0.0) == OK
    assert m.get("ua") == before[0] + 8.0 * H
    assert m.get("ya") == before[0] + 8.0 * H
    assert slopes(m, (first, 1, 8.0)) == OK
    assert slopes(m, (first, 1, 0.0)) == OK
    before = read(m)
    assert m.step(H) == OK
    assert read(m) == before, "taken back"


@only_fmi2
@pytest.mark.parametrize("value", [4.0, -4.0])
def test_one_step_uses_derivatives_up(make: Make, value: float) -> None:
    """The state after the step is that of an importer which set the same value at the end of the step."""
    m, plain = begun(make), begun(make)
    for reference in elements(m):
        assert slopes(m, (reference, 1, value)) == OK
    assert m.memory() != plain.memory()
    assert m.step(0.0, 0.5) == OK
    for name in ("ua", "us", "ub"):
        assert plain.set(name, *map(float, np.atleast_1d(m.get(name)))) == OK
    assert plain.step(0.0, 0.5) == OK
    for name in ("ya", "ys", "yb"):
        assert m.get(name) == plain.get(name)
    for each in (m, plain):
        assert each.step(0.5, 0.5) == OK
    assert m.memory() == plain.memory()


@only_fmi2
def test_a_call_sets_all_derivatives_or_none(make: Make) -> None:
    m = begun(make)
    before = m.memory()
    good = (elements(m)[0], 1, 1.0)
    y = m.ports["ya"].reference
    for bad, said in [
        ((y, 1, 1.0), "'ya' is not an input."),
        ((10**6, 1, 1.0), "no variable has the value reference 1000000."),
        ((good[0], 4, 1.0), "the order must be in 1..3. Got 4 instead."),
        ((good[0], 0, 1.0), "the order must be in 1..3. Got 0 instead."),
        *(((good[0], 1, x), "a derivative of 'ua' is not finite.") for x in (math.inf, math.nan)),
    ]:
        for rows in [(good, bad), (bad, good), (bad,)]:
            assert slopes(m, *rows) == ERROR
            assert m.messages.pop()[2] == f"fmi2SetRealInputDerivatives: {said}"
            assert m.memory() == before


@only_fmi2
def test_a_reset_forgets_derivatives(make: Make) -> None:
    m = begun(make)
    assert slopes(m, *[(r, 1, 1.0) for r in elements(m)]) == OK
    assert m.call("Reset") == OK
    m.initialize()
    before = read(m)
    assert m.step(0.0) == OK
    assert read(m) == before


@only_fmi2
def test_the_element_that_leaves_its_range_stops_all(make: Make) -> None:
    """Any element: none has moved, and a smaller derivative makes the same step."""
    for place, reference in enumerate(elements(begun(make))):
        m = begun(make)
        before, others = read(m), [r for r in elements(m) if r != reference]
        assert slopes(m, (reference, 1, 1e308), *[(r, 1, 1.0) for r in others]) == OK
        assert m.step(0.0, 10.0) == ERROR
        name = ["ua", "us", "us", "us", "ub"][place]
        lead = f"The derivatives of '{name}' lead to inf at the end of the step, out of its range."
        assert m.messages.pop()[2] == lead
        assert read(m) == before
        assert slopes(m, (reference, 1, 1.0)) == OK
        assert m.step(0.0, 10.0) == OK
        assert read(m) == [x + 10.0 for x in before]
