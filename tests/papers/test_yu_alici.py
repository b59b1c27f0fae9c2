"""Yu & Alici 2005: the dynamic Preisach sum against relays in a plain loop, and the whole table."""

import numpy as np
import pytest
import reasons

from hystfmu import Dataset
from hystfmu.data import signals
from papers import dynamic_preisach, reproduce

H, STEPS = 1e-3, 4


def relays(u, nodes):
    """Switch every relay of the cells of a grid, from its definition; a cell is one relay at its centre."""
    centres = (nodes[1:] + nodes[:-1]) / 2
    pairs = [(a, b) for i, a in enumerate(centres) for b in centres[: i + 1]]
    state = [1.0 if a + b < 0 else -1.0 for a, b in pairs]  # demagnetised about 0
    out = []
    for v in u:
        state = [1.0 if v > a else -1.0 if v < b else s for (a, b), s in zip(pairs, state, strict=True)]
        out.append(state)
    return np.array(out)


@pytest.mark.parametrize("dynamic", [False, True])
def test_a_density_that_depends_on_the_rate_needs_equation_3(monkeypatch, dynamic):
    monkeypatch.setattr(dynamic_preisach, "STEPS", STEPS)
    monkeypatch.setattr(dynamic_preisach, "THIN", 1)
    rng = np.random.default_rng(0)
    fine = np.linspace(-1, 1, 25)  # several relays in a cell
    density = [rng.uniform(0.5, 1, 24 * 25 // 2), 1e-2 * rng.uniform(0.5, 1, 24 * 25 // 2)]

    def plant(u):
        switched = relays(u, fine)
        return 0.2 + (switched @ density[0] + switched @ density[1] * np.gradient(u, H)) / 300

    t = H * np.arange(3001)
    sweep = (1 - t / 4) * np.sin(2 * np.pi * (2 * t + 6 * t**2))
    record = Dataset.from_signal(sweep, plant(sweep), H)
    model = dynamic_preisach.preisach(record, dynamic)
    error = 100 * np.std(model(sweep) - record.y) / record.span
    assert (error < 2.5) == dynamic, error


def test_the_relay_and_the_plane_are_drawn():
    relay, plane = dynamic_preisach.drawings()
    assert [relay.place, plane.place] == ["fig. 4", "fig. 5"]
    u, y = relay.plot.lines[0].x, relay.plot.lines[0].y
    assert set(y[u > dynamic_preisach.ALPHA]) == {1.0}
    assert set(y[u < dynamic_preisach.BETA]) == {-1.0}
    beta, alpha = plane.plot.lines[1].x, plane.plot.lines[1].y
    assert (np.diff(beta) >= 0).all()
    assert (np.diff(alpha) <= 0).all()
    assert ((np.diff(beta) == 0) ^ (np.diff(alpha) == 0)).all(), "a staircase"
    assert {beta[1], alpha[0]} <= set(signals.decaying_sine(3, 0.3, 200))


@pytest.mark.stress
def test_the_whole_table():
    report = reproduce("yu_alici_2005_smc")
    assert [f"{r.quantity}: {r.verdict()}" for r in report.rows if r.met is False] == []
    assert {d.place for d in report.drawings} == {f"fig. {n}" for n in range(3, 12)}
    reasons.check(report)
    of = {r.quantity: r for r in report.rows}
    static, dynamic = (of[f"{name}: RMS, %FS, training signal"] for name in ("Preisach sum", "dynamic Preisach sum"))
    assert dynamic.literal < static.literal / 3
