"""What a design sets, by its calls: which loops are opened, how poles are shared, the names of the coefficients."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.studies import designs
from hystfmu.studies.designs import LoopShapingDesign, RepetitiveDesign, in_parallel


@dataclass
class Case:
    units: dict[str, Any] = field(default_factory=dict)
    overrides: dict[str, Any] = field(default_factory=dict)


def test_filters_for_every_slope_of_every_loop(monkeypatch: Any) -> None:
    opened, asked = [], []
    monkeypatch.setattr(designs, "build", lambda case: case)
    monkeypatch.setattr(designs, "open_loop", lambda case, slopes: (opened.append((case.overrides, slopes)), case)[1])
    monkeypatch.setattr(designs, "behind_memory", lambda case, slope: (case.overrides.get("x"), slope))

    def filters(loops: Any, cutoff: float, gain: float, n_q: int, n_l: int) -> Any:
        asked.append((list(loops), cutoff, gain, n_q, n_l))
        return SimpleNamespace(q=np.array([1.0, 2.0]), l=np.array([3.0]))

    monkeypatch.setattr(designs, "repetitive_filters", filters)
    design = RepetitiveDesign.model_validate(
        {
            "method": "repetitive_filters",
            "unit": "rep",
            "loops": [{"case": "a", "slopes": [0.5, 1.5], "set": {"y": 7.0}}, {"case": "b"}],
        }
    )
    unit = SimpleNamespace(dims={"n_q": 4, "n_l": 9})
    cases: Any = {"a": Case({"rep": unit}, {"x": 1.0}), "b": Case({}, {"x": 2.0})}
    for cutoff in (30.0, 40.0):
        values = {"design.cutoff": cutoff, "design.gain": 0.8}
        assert design.settings(cases, values) == {"rep.q": [1.0, 2.0], "rep.l": [3.0]}
    assert opened == [({"x": 1.0, "y": 7.0}, (1.0, 1.0)), ({"x": 2.0}, (1.0, 1.0))]  # once
    loops = [(1.0, 0.5), (1.0, 1.5), (2.0, 1.0)]
    assert asked == [(loops, 30.0, 0.8, 4, 9), (loops, 40.0, 0.8, 4, 9)]


@pytest.mark.parametrize(("robust", "sizes"), [(["r.one"], [5]), (["r.slow", "r.fast"], [2, 3])])
def test_the_poles_of_a_controller_are_shared(monkeypatch: Any, robust: list[str], sizes: list[int]) -> None:
    asked: list[Any] = []
    h = 1e-3
    plant = (np.array([[-3.0]]), np.array([[1.0]]), np.array([[2.0]]), np.array([[0.0]]))
    opened = SimpleNamespace(plant=plant, h=h)
    monkeypatch.setattr(designs, "build", lambda case: case)
    monkeypatch.setattr(designs, "open_loop", lambda case, slopes: (asked.append((case, slopes)), opened)[1])

    def shaping(G: Any, W: Any, ratio: float) -> Any:
        s = 20j
        pade = (1 - 3e-3 * s / 2 + (3e-3 * s) ** 2 / 12) / (1 + 3e-3 * s / 2 + (3e-3 * s) ** 2 / 12)
        assert complex(G(s)) == pytest.approx(2 / (s + 3) * pade)
        assert complex(W(s)) == pytest.approx(4.0)
        assert ratio == 1.1
        return SimpleNamespace(robust=SimpleNamespace(A=np.eye(5), B="B", C="C"))

    def parallel(A: Any, B: Any, C: Any, got: list[int]) -> Any:
        asked.append(got)
        return [(np.array([1.0 * k]), np.array([2.0 * k, 1.0])) for k in range(1, len(got) + 1)]

    monkeypatch.setattr(designs, "loop_shaping", shaping)
    monkeypatch.setattr(designs, "in_parallel", parallel)
    design = LoopShapingDesign.model_validate(
        {"method": "loop_shaping", "case": "a", "delay": 3.0, "weight": {"K": "v"}, "robust": robust}
    )
    found = design.settings({"a": "the case"}, {"v": 4.0})  # type: ignore[dict-item]
    assert asked == [("the case", (1.0, 1.0)), sizes]
    want: dict[str, Any] = {}
    for k, name in enumerate(robust, 1):
        want |= {f"{name}_b": [1.0 * k], f"{name}_a": [2.0 * k, 1.0]}
    assert found == want


def test_slow_poles_first_and_real_ones_alone() -> None:
    poles = np.array([-5.0, -1.0, -30.0, -2.0])
    A, B, C = np.diag(poles), np.ones((4, 1)), np.array([[1.0, 2.0, 3.0, 4.0]])
    parts = in_parallel(A, B, C, [2, 2])
    assert [np.sort(np.roots(a)).tolist() for _, a in parts] == [
        pytest.approx([-2.0, -1.0]), pytest.approx([-30.0, -5.0])
    ]  # fmt: skip
    assert all(a[-1] == 1.0 for _, a in parts)
    for s in (1j, 3 + 2j):
        want = sum(c / (s - p) for c, p in zip(C[0], poles, strict=True))
        assert sum(np.polyval(b, s) / np.polyval(a, s) for b, a in parts) == pytest.approx(want)
    assert designs._pairs(np.array([-1.0, -2 + 1j, -3.0, -2 - 1j])) == [[0], [1, 3], [2]]
    assert designs._pairs(np.array([0.0, -1.0])) == [[0], [1]]
    assert designs._pairs(np.array([-1 + 1e-13j, -1 - 1e-13j])) == [[0], [1]]  # real but for rounding
