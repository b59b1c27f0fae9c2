"""Recursion as printed, preisach terms: each against the equations row by row."""

import numpy as np
import pytest

from hystfmu import Dataset
from hystfmu.graph.recursion import lag
from hystfmu.identify.features.smooth_density import smooth_density
from hystfmu.identify.methods import preisach
from hystfmu.identify.methods.preisach import Penalised, dead_zones, knots
from papers.statements.printed import PrintedRecursive

H = 1e-3
SEED = int(np.random.default_rng().integers(1 << 31))


@pytest.mark.parametrize(("rho", "fraction"), [(0.005, 1.0), (0.1, 0.5)])
def test_the_printed_recursion(rho, fraction):
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    r, eta, n = 0.4, 20.0, 3
    learner = PrintedRecursive(n, r, eta, rho, fraction)
    theta, P, variance, Sigma, mu = np.zeros(n), eta * np.eye(n), 0.0, r**2, 1 - rho
    for k in range(1, 15):
        h, y = rng.normal(size=n), float(rng.normal())
        e = y - h @ theta
        variance += e**2 / k
        Sigma = (1 - rho) * Sigma + rho * variance
        hPh = h @ P @ h
        lam = fraction * mu * Sigma * (variance - r**2) / (hPh * r**2) if abs(e) > r else 0.0
        divisor = mu * Sigma + lam * hPh
        if abs(divisor) < 1e-2 * mu * Sigma:  # lambda is negative as printed: both terms cancel, rounding decides
            break
        theta = theta + lam * P @ h / divisor * e
        P = (P - lam * np.outer(P @ h, P @ h) / divisor) / mu
        assert learner.update(h, y) == pytest.approx(e)
        assert learner.theta == pytest.approx(theta, rel=1e-6, abs=1e-9)
        assert pytest.approx(P, rel=1e-6) == learner.P
        assert (learner.samples, learner.Sigma) == (k, pytest.approx(Sigma))
    border = PrintedRecursive(1, 0.5)
    border.update(np.ones(1), 0.5)  # an error of the dead zone changes nothing
    assert border.theta.tolist() == [0.0]
    assert border.P[0, 0] == pytest.approx(1e6 / 0.995)


@pytest.fixture(scope="module")
def data():
    u = 5 + 2 * np.sin(np.arange(400) / 9) * np.linspace(1, 0.4, 400)
    return Dataset.from_signal(u, 40 + 3 * u + np.r_[u[0], u[:-1]] ** 2 / 4, H, "sine")


# ---- preisach -------------------------------------------------------------------------------------------------------
OPTIONS = {"n": 8, "widths": 4, "means": 3, "rate": None, "start": "demagnetised", "density": "linear"}


def strengths_of(monkeypatch, errors):
    """Skip the cross-validation: given errors, the middle strengths; note the problems."""
    asked, left = [], iter(errors)

    def best(problem, levels, progress):
        progress(0.5)
        asked.append((problem, levels))
        return tuple(some[1] for some in levels), next(left)

    monkeypatch.setattr(preisach, "best_strengths", best)
    return asked


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("rate", "errors", "kept"),
    [(None, (1.0, 0.59), True), (None, (1.0, 0.61), False), ("yes", (1.0,), True), ("no", (1.0,), False)],
)
def test_rate_dependent_terms_must_gain(monkeypatch, data, sign, rate, errors, kept):
    record, told = data.with_output(sign * data.y).with_train((50, 350)), []
    asked = strengths_of(monkeypatch, errors)
    graph, count = preisach.build(record, {**OPTIONS, "rate": rate}, 0, told.append)
    assert len(asked) == len(errors)
    assert asked[0][1] == ((1e-4, 1e-3, 1e-2), (3e-3, 3e-2, 0.3), (3e-3, 3e-2, 0.3))
    u, rows = record.u, slice(50, 350)
    density = smooth_density(u[rows], 8, 4, 3, "demagnetised")
    T, middle = np.geomspace(H, max(350 * H / 3, 10 * H), 6), u[rows].mean()
    *crept, late = (lag(H, t).run(u[:, None])[:, 0] for t in (*T, 4 * H))
    beside = np.column_stack([*crept, dead_zones(late - middle, knots(u[rows] - middle, 6))])
    free = beside if kept else np.zeros((400, 0))
    columns = density.columns(u)
    problem = Penalised(columns[rows], free[rows], sign * record.y[rows], (density.along_mean, density.along_width))
    x, v, c = problem.solve((1e-3, 3e-2, 3e-2))
    want = sign * (columns @ x + free @ v + c)
    assert graph.run(u, H).reshape(-1) == pytest.approx(want, rel=1e-6, abs=1e-6)
    assert count == len(x) + len(v) + 1
    assert len(v) == 12 * kept
    assert told == pytest.approx([0.2, *(0.2 + 0.4 * k + 0.2 for k in range(len(errors)))])
    assert graph.inputs[0].start == u[0]


def test_a_short_record_has_lags_up_to_ten_rows(data):
    rate = preisach._Rate(data.with_train((0, 20)))
    assert rate.T[-1] == pytest.approx(10 * H)
    assert rate.T[0] == pytest.approx(H)
    assert len(rate.T) == len(rate.s) == 6
