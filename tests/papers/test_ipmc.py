"""IPMC paper: monomials, auxiliary function, batch and recursive least squares, the model, the table."""

import itertools
import math

import numpy as np
import pytest
import reasons
from loop_simulation import Blocks

import papers as reproduce
from hystfmu import Graph, InputError, Model, Node, signals
from hystfmu.identify import fit
from hystfmu.identify.methods.polynomial_narx import basis, count, lagged
from hystfmu.identify.solvers.ridge import least_squares
from papers import ipmc_sensor
from papers.recursive import Recursive
from papers.statements.printed import PrintedRecursive, auxiliary
from papers.table import figure


@pytest.fixture(scope="module")
def problem():
    """A regression with columns that are nearly dependent, as lags are."""
    rng = np.random.default_rng(0)
    z = np.cumsum(rng.normal(size=(400, 1)), axis=0) / 20 + 0.05 * rng.normal(size=(400, 3))
    phi = basis(z, 2)
    return phi, phi @ rng.normal(size=phi.shape[1]) + 0.01 * rng.normal(size=400)


@pytest.fixture(scope="module")
def data():
    return ipmc_sensor.ipmc(20, (2.0, 5.0), seed=1)


# ---- monomials -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("p", "q"), [(1, 3), (4, 1), (3, 2), (2, 4), (18, 2)])
def test_monomials_in_the_order_of_equation_11(p, q):
    z = np.random.default_rng(p).normal(size=p)
    expected = []
    for degree in range(1, q + 1):
        for factors in itertools.product(range(p), repeat=degree):
            if list(factors) == sorted(factors):
                expected.append(math.prod(z[i] for i in factors))
    np.testing.assert_allclose(basis(z, q), [*expected, 1.0], rtol=1e-14)
    assert count(p, q) == len(expected) + 1 == math.factorial(p + q) // math.factorial(p) // math.factorial(q)
    np.testing.assert_array_equal(basis(np.tile(z, (5, 1)), q)[3], basis(z, q))


def test_lags_rest_at_the_first_value():
    np.testing.assert_array_equal(lagged(np.array([5.0, 6, 7, 8]), 2), [[5, 5], [5, 5], [6, 5], [7, 6]])
    np.testing.assert_array_equal(lagged(np.array([5.0, 6, 7, 8]), 2, 0), [[5, 5], [6, 5], [7, 6], [8, 7]])
    assert lagged(np.arange(4.0), 0).shape == (4, 0)


# ---- auxiliary function --------------------------------------------------------------------------------------------
def test_printed_auxiliary_function_only_ratchets():
    u = np.sin(2 * np.pi * np.arange(20 * 200 + 1) / 200)
    printed, corrected = auxiliary(u, corrected=False), auxiliary(u)
    # a first and a last quarter with |u - u_ex| = 1, and 39 half cycles with 2 between them
    closed_form = 2 * (1 - math.exp(-1)) + 39 * 2 * (1 - math.exp(-2))
    np.testing.assert_allclose(printed[-1], closed_form, rtol=1e-12)
    assert round(printed[-1], 1) == 68.7
    assert (np.diff(printed[[*range(50, 4000, 100)]]) > 1.7).all()
    assert np.ptp(corrected) < 2 * (1 - math.exp(-2)) + 1e-12
    np.testing.assert_allclose(corrected[1050:1250], corrected[3050:3250], atol=1e-12, err_msg="a closed loop")


def test_corrected_auxiliary_function_is_the_zhao_tan_operator():
    u = signals.nested_reversals(40, 3)
    u = np.concatenate([np.repeat(u[:50], 2), u[50:]])  # plateaus are no reversals
    block = Graph.single(Node("f", "zhao_tan", {}, {"memory": "last", "x0": float(u[0])}))
    np.testing.assert_allclose(auxiliary(u), block.run(u), atol=1e-12)


# ---- least squares -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("mu", [1.0, 0.97])
def test_recursive_equals_weighted_batch_after_every_sample(problem, mu):
    phi, y = problem
    n, eta, start = phi.shape[1], 1e4, np.linspace(-1, 1, phi.shape[1])
    model = Recursive(n, eta, mu, theta=start)
    np.testing.assert_allclose(model.theta, start, rtol=1e-12)
    for k in range(120):
        e = model.update(phi[k], y[k])
        if k % 17 == 0 or k == 119:
            w = np.sqrt(mu ** np.arange(k, -1, -1.0))
            stacked = np.vstack([w[:, None] * phi[: k + 1], np.sqrt(mu ** (k + 1) / eta) * np.eye(n)])
            right = np.concatenate([w * y[: k + 1], np.sqrt(mu ** (k + 1) / eta) * start])
            expected = np.linalg.lstsq(stacked, right, rcond=None)[0]
            np.testing.assert_allclose(model.theta, expected, rtol=1e-8, atol=1e-8)
            before = e
    assert before == pytest.approx(y[119] - phi[119] @ _theta_before(phi, y, 119, n, eta, mu, start), abs=1e-9)


def _theta_before(phi, y, k, n, eta, mu, start):
    model = Recursive(n, eta, mu, theta=start)
    for i in range(k):
        model.update(phi[i], y[i])
    return model.theta


def test_square_root_form_keeps_digits_that_the_covariance_form_loses():
    """Two nearly equal regressors and a large P(0): P = P - K h' P is subtraction of equal numbers."""
    rng = np.random.default_rng(0)
    t = rng.normal(size=300)
    phi = np.column_stack([t, t + 1e-8 * rng.normal(size=300)])
    y = phi @ [1.0, -2.0]
    eta = 1e16
    model, P, theta = Recursive(2, eta), eta * np.eye(2), np.zeros(2)
    for h, value in zip(phi, y, strict=True):
        model.update(h, value)
        K = P @ h / (1 + h @ P @ h)
        theta, P = theta + K * (value - h @ theta), P - np.outer(K, h @ P)
    exact = np.linalg.lstsq(np.vstack([phi, np.eye(2) / np.sqrt(eta)]), np.append(y, [0, 0]), rcond=None)[0]
    assert np.abs(model.theta - exact).max() < 1e-6
    assert np.abs(theta - exact).max() > 1e-4


# ---- dead zone -----------------------------------------------------------------------------------------------------
def test_dead_zone_equals_the_equations_in_covariance_form(problem):
    """Eqs. 13 to 18 with the errata, written out with P."""
    phi, y = problem
    n, eta, r, mu, fraction = phi.shape[1], 100.0, 0.05, 0.999, 0.4
    model = Recursive(n, eta, mu, dead_zone=r, fraction=fraction)
    theta, P, Sigma, variance, updates = np.zeros(n), eta * np.eye(n), 0.7, 0.0, 0
    for k, (h, value) in enumerate(zip(phi, y, strict=True), 1):
        e = value - h @ theta
        variance += (e**2 - variance) / k
        Sigma += 0.1 * (variance - Sigma)  # cancels: beta is a fraction of mu Sigma
        if abs(e) > r:
            lam = fraction * mu * Sigma * (e**2 - r**2) / (h @ P @ h * r**2)
            K = lam * P @ h / (lam * h @ P @ h + mu * Sigma)
            theta, P = theta + K * e, (P - np.outer(K, h @ P)) / mu
            updates += 1
        assert model.update(h, value) == pytest.approx(e, abs=1e-8)
    np.testing.assert_allclose(model.theta, theta, atol=1e-7)
    assert 10 < updates < len(y)


def test_after_an_update_with_the_largest_beta_the_error_is_r2_over_e(problem):
    phi, y = problem
    model = Recursive(phi.shape[1], 10.0, dead_zone=0.05)
    e = model.update(phi[7], y[7])
    assert abs(e) > 0.05
    assert y[7] - phi[7] @ model.theta == pytest.approx(0.05**2 / e, rel=1e-9)


def test_a_dead_zone_below_the_achievable_error_diverges(problem):
    phi, y = problem
    residual = y - phi @ least_squares(phi, y, 1e-9)[0]
    held = {}
    for factor in (1.2, 1e-3):
        model = Recursive(phi.shape[1], 1e6, dead_zone=factor * np.abs(residual).max())
        try:
            for h, value in zip(np.tile(phi, (5, 1)), np.tile(y, 5), strict=True):
                model.update(h, value)
            held[factor] = np.abs(y - phi @ model.theta).max()
        except InputError:
            held[factor] = np.inf
    assert held[1.2] < 2 * np.abs(residual).max()
    assert held[1e-3] > 100 * np.abs(residual).max()
    model, samples = Recursive(phi.shape[1], 1e6, dead_zone=1e-9), zip(np.tile(phi, (5, 1)), np.tile(y, 5), strict=True)
    with pytest.raises(InputError, match=r"diverged at sample .*dead zone 1e-09 is below the achievable error"):
        list(itertools.starmap(model.update, samples))


def test_printed_recursion_fails_where_the_corrected_one_holds():
    # after small signals the error leaves the dead zone while sigma^2 = sum e^2/k is still below r^2
    phi, y, r = np.ones((400, 1)), np.r_[np.full(200, 0.02), np.full(200, 0.2)], 0.1
    printed, corrected = PrintedRecursive(1, r, eta=1.0), Recursive(1, 1.0, dead_zone=r)
    worst = [max(abs(model.update(h, v)) for h, v in zip(phi, y, strict=True)) for model in (printed, corrected)]
    assert worst[0] > 3 * 0.2, "a negative lambda moves theta away"
    assert worst[1] <= 0.2
    # a long time inside the dead zone: P = P / mu each sample
    quiet = PrintedRecursive(1, r, eta=1.0, rho=0.1)
    with np.errstate(all="ignore"):
        for _ in range(7000):
            quiet.update(np.ones(1), 0.0)
    assert np.isnan(quiet.theta).all(), "without any error"


@pytest.mark.parametrize(("given", "words"), [
    ({"n": 0}, "'n' parameter of recursive least squares must be"),
    ({"n": 2, "eta": 0.0}, "'eta' parameter of recursive least squares must be in"),
    ({"n": 2, "mu": 1.5}, "'mu' parameter of recursive least squares must be in"),
    ({"n": 2, "dead_zone": -1.0}, "'dead_zone' parameter of recursive least squares must be in"),
    ({"n": 2, "fraction": 2.0}, "'fraction' parameter of recursive least squares must be in"),
    ({"n": 2, "theta": np.zeros(3)}, "'theta' array must have shape"),
])  # fmt: skip
def test_wrong_settings_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        Recursive(**given)


def test_wrong_samples_are_refused():
    model = Recursive(2)
    with pytest.raises(InputError, match="'phi' array must have shape"):
        model.update(np.ones(3), 0.0)
    with pytest.raises(InputError, match=r"sample 0: The values of phi and y must be finite\. Got nan instead"):
        model.update(np.ones(2), np.nan)
    assert not model.theta.any()


# ---- the model -----------------------------------------------------------------------------------------------------
def by_hand(model, u):
    """Free run of a model by the blocks of the oracles, from the values in its graph."""
    unit, states, out = Blocks(model.graph), None, []
    for k, x in enumerate(u):
        found, states = unit.step(states, {"u": x}, k * model.step, model.step if k else 0.0)
        out.append(unit.results(found, {})[0])
    return np.array(out)


@pytest.mark.turn("figures of papers")
@pytest.mark.some(2)
@pytest.mark.parametrize("lags", [(3, 2, 0, 1, 2), (2, 0, 0, 1, 3), (2, 2, 2, 1, 1), (3, 3, 0, 0, 2), (1, 1, 1, 0, 2)])
def test_free_run_against_a_plain_loop(data, lags, tmp_path):
    n_u, n_f, n_y, n_k, q = lags
    m = fit(data, "polynomial_narx", n_u=n_u, n_f=n_f, n_y=n_y, n_k=n_k, q=q)
    m.save(tmp_path / "m.model.toml")
    u = 5 * signals.decaying_sine(2, 0.2, 100) + 0.3
    y = Model.load(tmp_path / "m.model.toml").predict(u)
    np.testing.assert_allclose(y, by_hand(m, u), atol=1e-10)
    assert m.fit["parameters"] == count(n_u + n_f + n_y, q)


@pytest.mark.turn("figures of papers")
def test_f_makes_the_error_five_times_smaller(data):
    """S8 on a small scale; the whole table is below."""
    with_f = fit(data, "polynomial_narx", n_u=4, n_f=4)
    without = fit(data, "polynomial_narx", n_u=8, n_f=0)
    assert with_f.fit["parameters"] == without.fit["parameters"] == 45
    for x in (signals.decaying_sine(8, 0.12, 333), ipmc_sensor.excitation(30, (3.0, 4.0), seed=9)):
        truth = ipmc_sensor.sensor(x)
        e = [np.abs(m.predict(5 * x) - truth).max() for m in (with_f, without)]
        assert e[1] > 5 * e[0]


def test_wrong_options(data):
    with pytest.raises(InputError, match=r"number of weights must be at most .* Got 10626 for"):
        fit(data, "polynomial_narx", n_u=10, n_f=10, q=4)


# ---- synthetic sensor ----------------------------------------------------------------------------------------------
def test_sensor_depends_on_the_rate_and_drifts_but_little():
    slow, fast = (ipmc_sensor.sensor(signals.decaying_sine(3, 0.0, n)) for n in (10000, 100))
    # 10 Hz against 0.1 Hz: the 4 ms lag takes 1 - 1/sqrt(1 + (0.08 pi)^2) of the amplitude and delays by 4 samples
    assert 0.01 < np.ptp(slow[10000:]) / np.ptp(fast[100:]) - 1 < 0.05
    held = ipmc_sensor.sensor(np.concatenate([np.linspace(0, 1, 100), np.ones(9000)]))
    assert 0.012 < held[150] - held[-1] < 0.022


def test_sensor_against_an_exact_lag():
    """A step held: every play travels 1 - r, so z = 1 and v = 1.04 (1 - e^-t/T), but for drift and ramp."""
    y = ipmc_sensor.sensor(np.concatenate([[0.0], np.ones(200)]))
    t = np.arange(201) / 1000 - 0.0005  # the ramp of 1 ms delays by half of it
    assert np.abs(y - 1.04 * (1 - np.exp(-t / 0.004)))[2:].max() < 0.02


def test_frequencies_are_checked():
    with pytest.raises(InputError, match="frequencies"):
        ipmc_sensor.ipmc(frequencies=(0.0,))


# ---- the table -----------------------------------------------------------------------------------------------------
@pytest.mark.stress
def test_table_meets_its_targets():
    fractions = []
    report = reproduce.reproduce("ipmc_bfbnn", progress=fractions.append)
    assert [r.quantity for r in report.rows if r.met is False] == []
    by_name = {r.quantity: r for r in report.rows}
    assert sum(r.quantity.startswith("without / with f") and r.target == 5.0 for r in report.rows) == 7
    assert by_name["f after 20 cycles of amplitude 1"].literal == pytest.approx(68.7, abs=0.05)
    assert by_name["TC(9), mV^2"].printed == 4.68e-6
    assert by_name["IC(7) / IC(10): effect of more lags"].scanned == (0, 12), "table 1 stays missed"
    third = [r for r in report.rows if r.place == "fig. 3"]
    assert [r.printed for r in third] == [0.014, 0.14, pytest.approx(10)]
    assert 1 / 1.2 < third[0].literal / third[0].printed < 1.2, "the replica is of the paper's order"
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert "68.7" in report.text()
    assert {figure(d) for d in report.drawings} == {"fig. 1", "fig. 3", "fig. 4"}
    reasons.check(report)
