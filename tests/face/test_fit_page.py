"""Errors on every part of a record, the page of a fit, and the interval for new rows."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import plants
import pytest
from click.testing import CliRunner
from invoked import invoked
from scipy.signal import lfilter

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.cli import main
from hystfmu.data.signals import decaying_sine, training
from hystfmu.face.interval import FOLDS, cross_errors, interval_text, known, parts
from hystfmu.face.page import densities
from hystfmu.identify.cuts import validation_rows
from hystfmu.identify.one import fit_one
from hystfmu.model.accuracy import interval, width


def measured(name="<b>&"):
    u = 50 + 40 * training(30, 4, 0.05)
    y = plants.prandtl_ishlinskii(u / 40)
    y = y + 2e-3 * np.ptp(y) * np.random.default_rng(0).normal(size=len(y))
    n = len(u)
    return hy.Dataset(np.arange(n) * 1e-3, u, y, name, train=(n // 4, n // 2), unit_u="V", unit_y="um")


def test_errors_of_every_part():
    data = measured()
    y = data.y + np.arange(len(data.y))
    found = {(p.name, p.rows.start, p.rows.stop): p.errors for p in parts(y, data, True)}
    n, (a, b) = len(data.t), (data.train.start, data.train.stop)
    assert list(found) == [("training rows", a, b), ("held-out rows", 0, a), ("held-out rows", b, n)]
    assert [e["max"] for e in found.values()] == pytest.approx([b - 1, a - 1, n - 1])
    assert found["held-out rows", 0, a]["max_percent"] == pytest.approx(100 * (a - 1) / data.span)
    two = hy.Dataset.joined([data, data])
    named = [(p.name, p.rows.start) for p in parts(np.concatenate([y, y]), two, False)]
    assert named == [("all rows", 0), ("record 1", 0), ("record 2", n)]


@pytest.mark.parametrize("n", [7, 1000, 1024, 5000])
def test_the_densities_are_those_of_scipy(n):
    from scipy.signal import welch

    v = np.random.default_rng().normal(size=n)
    f, power = welch(v, 1e3, nperseg=min(1024, n))
    found = densities(v, 1e-3)
    assert found[0] == pytest.approx(f)
    assert found[1] == pytest.approx(power, rel=1e-9)


def test_the_page_of_a_fit(tmp_path):
    data = measured()
    model = hy.fit(data, "prandtl_ishlinskii", N=20)
    page = model.report(data, tmp_path / "fit.html").read_text()
    for text in ("&lt;b&gt;&amp;", "u (V)", "measured - model (um)", "spectrum of the error", "loops", "held-out rows"):
        assert text in page, text
    assert "<b>&" not in page
    assert page.count("<svg") == 6
    assert re.search(r"within \+-[\d.]+ um with a probability of 95 % \(conformal over 40 blocks", page)
    assert "://" not in page.replace("http://www.w3.org", "")
    whole = data.with_train(None)
    page = hy.fit(whole, "prandtl_ishlinskii", N=5).report(whole, tmp_path / "b.html").read_text()
    assert "on blocks between reversals, each held out of one of 2 fits of the same kind" in page
    short = hy.Dataset(data.t[:90], data.u[:90], data.y[:90])
    page = hy.fit(short, "prandtl_ishlinskii", N=5).report(short, tmp_path / "d.html").read_text()
    assert "No interval for new rows" in page
    with pytest.raises(hy.InputError, match="must have a measured output"):
        model.report(hy.Dataset(data.t, data.u, np.full(len(data.t), np.nan)), tmp_path / "c.html")


def test_a_record_that_was_fitted_as_a_whole_gives_errors_of_fits_without_blocks():
    data = measured().with_train(None)
    model = hy.fit(data, "prandtl_ishlinskii", N=20)
    wanted = np.full(len(data.t), np.nan)
    for fold in FOLDS:
        held = validation_rows(data.u, fold)
        other = fit_one(data.with_held(held), "prandtl_ishlinskii", 0, print, model.provenance["options"])
        wanted[held] = (data.y - other.predict(data.u, data.h))[held]
    e = cross_errors(model, data, data.y - model.predict(data))
    np.testing.assert_array_equal(e, wanted[np.isfinite(wanted)])


def decaying():
    u = decaying_sine(12, 0.15)
    y = plants.bouc_wen(u, A=1.0, beta=1.0, gamma=0.5, n=1.4, a=0.4, b=0.7, c=0.0)
    y = y + 1e-3 * np.ptp(y) * np.random.default_rng(0).normal(size=len(y))
    return hy.Dataset.from_signal(u, y, 1e-3, "decay")


def test_what_a_record_does_not_show_is_said_alike_on_terminal_page_and_in_json(tmp_path, monkeypatch):
    """Plays miss Bouc-Wen loops, and one decaying sine of one speed shows neither minor loops nor other speeds."""
    monkeypatch.chdir(tmp_path)
    decaying().to_csv("decay.csv")
    words = ["fit", "decay.csv", "--model", "prandtl_ishlinskii"]
    done = invoked(words)
    text = interval_text(known(hy.Model.load("decay.prandtl_ishlinskii.model.toml"), hy.read("decay.csv")), "")
    assert "It holds for signals like those of the record. It is not known to hold for" in text
    assert "minor loops at several levels" in text
    assert "other speeds" in text
    assert text in done.stdout
    assert text.replace("'", "&#x27;") in Path("decay.prandtl_ishlinskii.html").read_text()
    told = json.loads(CliRunner().invoke(main, [*words, "--json"]).stdout)["interval"]
    assert all(name in text for name in told["not_for"])
    assert f"+-{told['half_width']:.4g} with" in text


def test_a_rich_record_whose_errors_are_noise_gives_an_interval_for_other_signals():
    data = measured().with_train(None)
    found = known(hy.fit(data, "prandtl_ishlinskii", N=40), data)
    assert found.noise_only
    assert "within the range and the speeds of the record as well" in interval_text(replace(found, not_for=()), "um")


def test_fit_and_predict_print_the_errors_of_every_part(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    data = measured("a")
    data.to_csv("a.csv")
    rows = f"{data.train.start}:{data.train.stop}"
    done = invoked(["fit", "a.csv", "--model", "prandtl_ishlinskii", "--train", rows])
    assert done.stdout.count("held-out rows  ") == 2
    assert "conformal over 40 blocks" in done.stdout
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "a.csv",
        *(f"a.prandtl_ishlinskii.{end}" for end in ("html", "model.toml")),
    ]
    model = "a.prandtl_ishlinskii.model.toml"
    done = CliRunner().invoke(main, ["predict", model, "a.csv", "-o", "p.csv"])
    assert "all rows" in done.stdout
    as_json = json.loads(CliRunner().invoke(main, ["predict", model, "a.csv", "-o", "p.csv", "--json"]).stdout)
    (found,) = as_json["errors"]
    assert found["rows"] == [0, len(data.t)]
    assert f"{found['rms_percent']:.4g}" in done.stdout
    (tmp_path / "u.csv").write_text("t,u\n" + "".join(f"{k * 1e-3!r},{v!r}\n" for k, v in enumerate(data.u.tolist())))
    without = invoked(["predict", model, "u.csv", "-o", "q.csv"])
    assert "no output" in without.stdout
    assert "all rows" not in without.stdout


# ---- interval --------------------------------------------------------------------------------------------------------
DRAWS = np.random.SeedSequence()  # drawn anew in every run; a failure prints it


def stationary(rng: np.random.Generator, n: int, memory: float) -> Array:
    """Errors that forget their past within about `memory` rows."""
    return np.asarray(lfilter([1.0], [1.0, -np.exp(-1 / memory)], rng.normal(size=n + 1000))[1000:])


def covered(given: Array, other: Array) -> float:
    """The share of other errors inside the interval that given ones make."""
    found = interval(given)
    assert found is not None
    return float(np.mean(np.abs(other) <= found.half_width))


def enough(shares: list[float]) -> None:
    """The mean of the shares is 95 % or more, within three standard errors of these draws."""
    mean, error = np.mean(shares), np.std(shares, ddof=1) / np.sqrt(len(shares))
    assert mean >= 0.95 - 3 * error, (mean, error, DRAWS.entropy)


def in_order(n: int, share: float) -> int:
    """The place of the least of n sizes that a share of n + 1 does not exceed: rows as if they were independent."""
    return int(np.ceil((n + 1) * share)) - 1


@pytest.mark.turn("held-out records")
@pytest.mark.parametrize("memory", [1, 10, 60])
def test_the_stated_share_of_another_record_is_inside(memory: int) -> None:
    rng = np.random.default_rng(DRAWS)
    pairs = [(stationary(rng, 1000, memory), stationary(rng, 1000, memory)) for _ in range(60)]
    enough([covered(given, other) for given, other in pairs])


@pytest.mark.turn("held-out records")
def test_rows_are_not_counted_as_independent() -> None:
    """A record of seven memories: the quantile of its rows covers too little, the interval over blocks does not."""
    rng = np.random.default_rng(5)
    pairs = [(stationary(rng, 700, 100), stationary(rng, 700, 100)) for _ in range(200)]
    enough([covered(given, other) for given, other in pairs])
    alone = [np.mean(np.abs(b) <= np.sort(np.abs(a))[in_order(len(a), 0.95)]) for a, b in pairs]
    assert np.mean(alone) < 0.93


def fitted_shares(seeds: int) -> list[float]:
    """Fit plays to a plant with noise in the middle half of a record; the errors of another record inside."""
    shares = []
    for seed in np.random.default_rng(DRAWS).integers(2**31, size=seeds).tolist():
        rng = np.random.default_rng(seed)
        records = [training(60, seed + k, 0.05) for k in (0, 1)]
        y = [plants.prandtl_ishlinskii(u) for u in records]
        noise = 2e-3 * np.ptp(y[0])
        y = [v + noise * stationary(rng, len(v), 5) for v in y]
        n = len(y[0])
        data = hy.Dataset(np.arange(n) * 1e-3, records[0], y[0], train=(0, n // 2))
        model = hy.fit(data, "prandtl_ishlinskii", N=20)
        errors = [v - model.predict(u, 1e-3) for u, v in zip(records, y, strict=True)]
        shares.append(covered(errors[0][n // 2 :], errors[1]))
    return shares


@pytest.mark.turn("held-out records")
def test_the_rows_of_another_record_of_a_fit_are_inside() -> None:
    enough(fitted_shares(6))


@pytest.mark.stress
def test_the_rows_of_another_record_of_many_fits_are_inside() -> None:
    enough(fitted_shares(100))


def test_the_interval_says_where_it_does_not_hold() -> None:
    e = np.random.default_rng(2).normal(size=4000)
    e[1000:1200] *= 10  # a block of its own
    found = interval(e)
    assert found is not None
    assert found.lowest < 50
    assert 95 < found.coverage < 99
    assert (found.rows, found.blocks) == (4000, 40)
    assert interval(e[:79]) is None


def test_the_width_counts_one_more_block_of_infinite_errors() -> None:
    """With 19 blocks all errors are inside; with 39, 97.4 % of them, a long block counting as much as a short one."""
    assert width([np.array([1.0, k]) for k in range(2, 21)]) == 20
    blocks = [np.arange(1.0, 41.0) for _ in range(38)]
    assert width([*blocks, np.full(1000, 0.5)]) == 39  # (38 * 39/40 + 1)/40 = 0.951 and with 38: 0.928
    assert width([*blocks, np.full(2, 99.0)]) == 40  # 38 * 40/40 / 40 = 0.95
