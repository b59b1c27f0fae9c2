"""Inputs at the end of a step: derivatives in FMI 2.0, intermediate update in FMI 3.0, against closed forms."""

from __future__ import annotations

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
from fmpy.fmi2 import FMU2Slave
from fmpy.simulation import Input
from fmu_master import ERROR, OK, Array, H, Master, mixed, single

from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Node

SIZE = C.c_size_t(1)


def slope(m: Master, value: float, order: int = 1, name: str = "u") -> int:
    """Set a derivative of an input."""
    reference, n = C.c_uint(m.ports[name].reference), C.c_int(order)
    return m.call("SetRealInputDerivatives", C.byref(reference), SIZE, C.byref(n), C.byref(C.c_double(value)))


def play(width: float) -> Graph:
    return Graph.single(Node("play", "backlash_sum", {"n": 1}, {"w0": 0.0, "r": [width], "w": [1.0]})).with_step(H)


@pytest.fixture
def fmi() -> int:
    return 2


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
        slave = FMU2Slave(
            guid=description.guid,
            modelIdentifier="play",
            unzipDirectory=fmpy.extract(str(path), str(tmp_path / "unpacked")),
            instanceName="i",
        )
        slave.instantiate()
        source = Input(slave, description, table, set_input_derivatives=derivatives)
        # fmpy 0.3.32 has room for nine derivatives whatever the number of inputs, and stops at any other
        source.continuous = [c._replace(derivatives=(C.c_double * len(c.vrs))()) for c in source.continuous]
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        source.apply(0.0)
        slave.exitInitializationMode()
        y = [slave.getReal([1])[0]]
        for k in range(len(t) - 1):
            source.apply(t[k], after_event=True)
            slave.doStep(t[k], H)
            y.append(slave.getReal([1])[0])
        slave.terminate()
        slave.freeInstance()
        return np.array(y)

    assert np.abs(run(True) - exact).max() < 1e-13
    late = np.concatenate([exact[:1], exact[:-1]])
    assert np.abs(run(False) - late).max() < 1e-13
    assert np.abs(late - exact).max() == pytest.approx(0.01, rel=1e-6)  # 1 % of the span


def test_a_lag_with_lines_between_points_meets_its_closed_form(make: Callable[..., Master]) -> None:
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


def test_a_sampled_block_samples_at_the_end_of_the_step(make: Callable[..., Master]) -> None:
    m = make(Graph.single(Node("d", "differentiator")).with_step(H))
    m.initialize()
    for k in range(5):
        assert m.set("u", 3.0 * k * H) == OK
        assert slope(m, 3.0) == OK
        assert m.step(k * H) == OK
        assert m.get("u") == pytest.approx(3.0 * (k + 1) * H, rel=1e-15)
    assert m.get("du") == pytest.approx(3.0, rel=1e-12)


def test_derivatives_of_zero_change_no_bit(make: Callable[..., Master]) -> None:
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
