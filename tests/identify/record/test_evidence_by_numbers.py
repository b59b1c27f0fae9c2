"""What is told of modes, delay and noise by numbers: standard errors, shares of the static gain, texts."""

from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu.identify import evidence as module
from hystfmu.identify.evidence import Evidence, Mode

H = 1e-3
F = np.arange(10.0, 500.0, 10.0)


@pytest.mark.parametrize(("value", "error", "text"), [
    (123.456, 0.5, "123.5 +- 0.5"), (123.456, 50.0, "1.2e+02 +- 50"), (123.456, 0.0, "123.5 +- 0"),
    (0.0, 0.1, "0 +- 0.1"), (-123.456, 0.01234, "-123.456 +- 0.012"), (1 / 3, 1e-12, "0.33333333 +- 1e-12"),
    (3.0, 9.0, "3 +- 9"), (2.34, 9.0, "2.3 +- 9"),
])  # fmt: skip
def test_a_value_has_the_digits_that_its_error_leaves(value, error, text):
    assert module._known(value, error) == text


def seen(total=2.0):
    return SimpleNamespace(h=H, cells=SimpleNamespace(f=F, total=np.full(len(F), total)), noise=lambda e: e)


def test_the_error_of_a_response_near_a_mode_beside_the_noise():
    noise = np.where(np.abs(F - 100) < 25, 0.07, 9.0)
    found = module._model_error(seen(), noise, 0.004, 100.0, 0.1)  # 80 Hz to 120 Hz lie within 20 %
    near = np.abs(np.log(F / 100)) < 0.2
    assert near.sum() == 4
    assert found == pytest.approx(np.sqrt((0.07 - 0.004**2 / 2e-3) / (2.0 / 8)))
    assert module._model_error(seen(), noise, 0.004, 100.0, 0.001) == pytest.approx(found)  # at least 5 %
    assert module._model_error(seen(), noise, 1.0, 100.0, 0.1) == 0.0
    assert module._model_error(seen(0.0), noise, 0.004, 100.0, 0.1) == 1.0
    assert module._model_error(seen(), noise, 0.004, 1.0, 0.1) == 1.0  # no cell is near


def fitted(known=(True, True), gain=(0.8, 0.15, 0.05), zeta=(0.05, 0.1), rest=1, delay=1.5, rest_se=0.02):
    p = np.array([np.log(100), np.log(zeta[0]), np.log(300), np.log(zeta[1]), delay])
    sd = np.array([0.001, 0.02, 0.003, 0.05, 0.1, 0.01, 0.02, 0.03])[: 5 + len(gain)]
    structure = SimpleNamespace(modes=2, rest=rest)
    covariance = np.diag(sd**2)
    return SimpleNamespace(
        p=p, gain=np.array(gain), structure=structure, covariance=covariance, rest_se=rest_se,
        known=lambda seen: np.array(known),
    )  # fmt: skip


@pytest.mark.parametrize("excess", [0.0, 0.01])
def test_modes_and_delay_with_their_errors(excess):
    density = 0.004
    modes, delay, delay_se = module._told(fitted(), seen(), np.full(len(F), density**2 / 2e-3 + excess), density)
    error = np.sqrt(excess / 0.25)
    assert (delay, delay_se) == pytest.approx(
        (1.5 * H, H * np.sqrt(0.1**2 + 0.05**2 + (0.5 * error / (2 * np.pi * 100 * H)) ** 2))
    )
    wanted = ((100.0, 0.05, 0.8, 0.001, 0.02, 0), (300.0, 0.1, 0.15, 0.003, 0.05, 1))
    for found, (f, zeta, share, f_sd, zeta_sd, k) in zip(modes, wanted, strict=True):
        bent = 0.5 * error
        slope = -share * np.ones(3) + np.eye(3)[k]
        by_gains = np.sum((slope * [0.01, 0.02, 0.03]) ** 2)
        shape = share * np.array([0.5 * 0.05, (2 * np.pi * f * H) ** 2 / 24, 2 * zeta * bent])
        least = [0.02, 0.002, 2 * zeta * bent]
        assert (found.f_n, found.zeta, found.share) == pytest.approx((f, zeta, share))
        assert found.f_n_se == pytest.approx(f * np.sqrt(f_sd**2 + 1e-8 + (bent * zeta) ** 2))
        assert found.zeta_se == pytest.approx(zeta * np.sqrt(zeta_sd**2 + 0.003**2 + bent**2))
        assert found.share_se == pytest.approx(np.sqrt(by_gains + np.sum(shape**2) + np.sum(np.square(least))))


@pytest.mark.parametrize(("given", "shares"), [
    ({"known": (False, True), "gain": (0.2, 0.6, 0.2)}, [0.6]),  # another mode counts, though it is not told
    ({"known": (False, True), "zeta": (0.6, 0.1), "gain": (0.4, 0.6, 0.2)}, [0.75]),  # creep does not
    ({"known": (True, True), "gain": (1.2, -0.4, 0.2), "zeta": (0.05, 0.6)}, [1.2]),  # an overdamped one that falls
    ({"known": (True, True), "gain": (0.97, 0.01, 0.02)}, [0.97]),  # a share of its own error
    ({"known": (False, False)}, []),
    ({"gain": (0.8, 0.2), "rest": 0}, [0.8, 0.2]),
])  # fmt: skip
def test_which_modes_are_told_and_their_share_of_the_static_gain(given, shares):
    modes, _, delay_se = module._told(fitted(**given), seen(), np.zeros(len(F)), 0.004)
    assert [m.share for m in modes] == pytest.approx(shares)
    assert delay_se == pytest.approx(H * np.hypot(0.1, 0.05))
    assert module._told(fitted(delay=-0.4), seen(), np.zeros(len(F)), 0.004)[1] == 0.0
    assert module._told(None, seen(), np.zeros(3), 0.1) == ((), 0.0, np.inf)


def test_the_density_is_the_smallest_estimate_and_the_static_gain_that_of_low_frequencies(monkeypatch):
    windows = [SimpleNamespace(rows=slice(1, 3))]
    cells = SimpleNamespace(f=F, left=np.full(3, 12.0))
    of = SimpleNamespace(h=H, cells=cells, powers=lambda e: e[:2], windows=windows)
    asked = []
    monkeypatch.setattr(module, "noise_density", lambda power, *more: asked.append((power.tolist(), more[0])) or 3.0)
    monkeypatch.setattr(module, "quiet_density", lambda parts, h: asked.append([p.tolist() for p in parts]) or 2.0)
    assert module._density(of, np.arange(5.0)) == 2.0
    assert asked == [([2.0] * 3, 12), ([0.0, 1.0], 16), [[1.0, 2.0]]]
    g = np.array([9.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    r = SimpleNamespace(seen=np.arange(8) > 0, g=g + 0j)
    assert module._static_gain(r, None) == 1.5  # the first third of the coherent points
    assert module._static_gain(SimpleNamespace(seen=np.zeros(8, dtype=bool), g=g), None) == 1.0
    assert module._static_gain(r, fitted(gain=(-0.8, -0.15, -0.05))) == pytest.approx(1.0)
    assert module._static_gain(r, SimpleNamespace(structure=SimpleNamespace(modes=0))) == 1.5


def test_lines_of_what_a_record_shows():
    none = np.zeros(0)
    mode = Mode(100.0, 0.05, 0.8, 0.5, 0.005, 0.04)
    found = Evidence(H, "foh", (1.0, 400.0), none, none, none, none, none, (mode,), 0.001, 1e-5, 0.0123, 0.00045)
    assert found.lines("um") == [
        "record: input and output are coherent from 1 to 400 Hz; noise 0.012 um RMS, 0.00045 um/sqrt(Hz)",
        "mode at 100 +- 0.5 Hz, damping ratio 0.05 +- 0.005, 80 +- 4 % of the static gain",
        "delay 0.001 +- 1e-05 s",
    ]
    unknown = Evidence(H, "foh", (0.0, 0.0), none, none, none, none, none, (), 0.0, np.inf, np.nan, np.nan)
    assert unknown.lines() == ["record: no coherent band", "no mode inside this band", "delay not known"]
