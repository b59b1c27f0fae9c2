"""The block that learns: against the covariance form, the batch solution, and what must not break it."""

import numpy as np
import pytest

from hystfmu.graph import Graph, Node
from hystfmu.identify.methods.polynomial_narx import basis, lagged
from hystfmu.identify.solvers.ridge import least_squares
from hystfmu.unit import Unit
from papers import ipmc_sensor
from papers.statements.printed import PrintedRecursive

H = 1e-3


def learner(n, **values):
    return Graph.single(Node("learner", "recursive_least_squares", {"n": n}, values))


def regression(rows=400, n=4, noise=0.05):
    """Regressors that are nearly dependent, as lags are."""
    rng = np.random.default_rng(0)
    phi = np.cumsum(rng.normal(size=(rows, 1)), axis=0) / 20 + 0.05 * rng.normal(size=(rows, n))
    return phi, phi @ rng.normal(size=n) + noise * rng.normal(size=rows)


def columns(y, n):
    return y[:, 0], y[:, 1 : 1 + n], y[:, 1 + n]


@pytest.mark.parametrize("mu", [1.0, 0.98])
@pytest.mark.parametrize(("form", "dead_zone", "share"), [("plain", None, 1.0), ("corrected", 0.15, 0.3)])
def test_it_is_the_recursion_of_the_covariance(form, dead_zone, share, mu):
    phi, y = regression()
    values = {} if dead_zone is None else {"r": dead_zone, "share": share}
    run = learner(4, form=form, eta=1e4, mu=mu, **values).run(np.column_stack([phi, y]), H)
    y_hat, theta, learned = columns(run, 4)
    inverse, right = np.eye(4) / 1e4, np.zeros(4)  # of P, and P^-1 theta
    for k, (h, v) in enumerate(zip(phi, y, strict=True)):
        before = np.linalg.solve(inverse, right)
        e = v - h @ before
        assert abs(v - e - y_hat[k]) <= 1e-8
        if dead_zone is None:
            inverse, right = mu * inverse + np.outer(h, h), mu * right + h * v
        elif abs(e) > dead_zone:
            c = share * (e**2 - dead_zone**2) / (h @ np.linalg.solve(inverse, h) * dead_zone**2)
            inverse, right = mu * (inverse + c * np.outer(h, h)), mu * (right + c * h * v)
        want = np.linalg.solve(inverse, right)
        np.testing.assert_allclose(theta[k], want, rtol=0, atol=1e-7 * (1 + np.abs(want).max()))
    assert learned[-1] == len(y) if dead_zone is None else 5 < learned[-1] < len(y)


def test_as_printed_it_is_the_printed_recursion():
    phi, y = regression()
    run = learner(4, form="printed", eta=10.0, mu=0.995, r=0.15).run(np.column_stack([phi, y]), H)
    y_hat, theta, learned = columns(run, 4)
    other = PrintedRecursive(4, 0.15, 10.0, 0.005)
    for k, (h, v) in enumerate(zip(phi, y, strict=True)):
        e = other.update(h, v)
        assert abs(v - e - y_hat[k]) <= 1e-9
        np.testing.assert_allclose(theta[k], other.theta, rtol=0, atol=1e-9 * (1 + np.abs(other.theta).max()))
    assert learned[-1] > 10


def test_weights_converge_to_batch_on_the_ipmc_record():
    """28 monomials of lags of displacement and operator; r and share were chosen on a record of its own (seed 5)."""
    phi, voltage = ipmc_regression(ipmc_sensor.ipmc(60, rest=1.0, seed=3))
    held, truth = ipmc_regression(ipmc_sensor.ipmc(30, (1.5, 3.0, 4.0), noise=0.0, seed=4))
    batch, _ = least_squares(phi, voltage, 1e-3)
    noise, eta = float(np.std(voltage - phi @ batch)), 1 / (len(phi) * 1e-3**2)
    for values, limit in (
        ({"form": "plain", "mu": 1.0}, 1 + 1e-9),
        ({"form": "corrected", "mu": 1.0, "r": 2 * noise, "share": 0.1}, 1.2),
    ):
        run = learner(phi.shape[1], eta=eta, **values).run(np.column_stack([phi, voltage]), H)
        theta = run[-1, 1:-1]
        ratio = np.std(held @ theta - truth) / np.std(held @ batch - truth)
        print(f"{values['form']}: {ratio:.3f} of batch, {run[-1, -1]:.0f} of {len(phi)} samples learned from")
        assert ratio <= limit


def ipmc_regression(record, n=3):
    x = record.u / ipmc_sensor.STROKE
    operator = Graph.single(Node("f", "zhao_tan")).run(x)
    return basis(np.column_stack([lagged(x, n), lagged(operator, n)]), 2), record.y


def test_the_prediction_precedes_the_update():
    run = learner(1, form="plain", mu=1.0, eta=1e12, theta0=[3.0]).run(np.array([[2.0, 10.0], [4.0, 0.0]]), H)
    assert run[0, 0] == 6.0
    assert run[0, 1] == pytest.approx(5.0)
    assert run[1, 0] == pytest.approx(20.0)


def test_forgetting_follows_weights_that_change():
    rng = np.random.default_rng(1)
    phi = rng.normal(size=(2000, 2))
    theta = np.where(np.arange(2000)[:, None] < 1000, [1.0, -2.0], [4.0, 0.5])
    u = np.column_stack([phi, np.sum(phi * theta, axis=1)])
    follows, keeps = (learner(2, form="plain", mu=mu).run(u, H)[-1, 1:3] for mu in (0.97, 1.0))
    np.testing.assert_allclose(follows, [4.0, 0.5], atol=1e-9)
    assert np.abs(keeps - [4.0, 0.5]).max() > 0.5


def test_dependent_regressors_and_long_runs_stay_finite():
    """P = U D U' with D > 0 in the worst case for a stored P: two equal regressors, no excitation, forgetting."""
    n = 20000
    x = np.where(np.arange(n) < 500, np.sin(0.1 * np.arange(n)), 0.0)
    x[-500:] = np.sin(0.1 * np.arange(500))
    run = learner(2, form="plain", mu=0.99).run(np.column_stack([x, x, 3 * x]), H)
    assert np.isfinite(run).all()
    np.testing.assert_allclose(run[-1, 1] + run[-1, 2], 3.0, atol=1e-9)


@pytest.mark.parametrize("form", ["corrected", "printed", "plain"])
def test_an_update_that_is_not_finite_starts_p_anew_and_says_so(form):
    phi, y = regression(60)
    u = np.column_stack([phi, y])
    u[40] = [1e200, 1e200, -1e200, 1e160, 1e300]
    run = learner(4, form=form, r=1e-3).run(u, H)
    _, theta, learned = columns(run, 4)
    assert np.isfinite(theta).all()
    assert learned[39] > 0
    assert learned[40] == 0.0
    assert (theta[40] == theta[39]).all()
    assert learned[-1] > 0 or form == "printed"  # sigma^2 as printed never comes back


def test_a_tuned_dead_zone_stops_the_learning():
    phi, y = regression(200)
    unit = Unit(learner(4, form="corrected", r=1e-3))
    names = [f"phi_{i + 1}" for i in range(4)]
    unit.initialize(0.0, **dict(zip(names, phi[0], strict=True)), y=y[0])
    learned = []
    for k in range(1, 200):
        if k == 100:
            unit.set("r", 1e3)
        for name, value in zip([*names, "y"], [*phi[k], y[k]], strict=True):
            unit.set(name, value)
        unit.do_step((k - 1) * H, H)
        learned.append(unit.get("learned"))
    assert learned[98] > 50
    assert learned[-1] == learned[98]
