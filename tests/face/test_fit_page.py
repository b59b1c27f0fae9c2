"""Errors on every part of a record, and the page of a fit."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import plants
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.data.signals import decaying_sine, training
from hystfmu.face.interval import FOLDS, cross_errors, interval_text, known, parts
from hystfmu.face.page import densities
from hystfmu.identify.cuts import validation_rows
from hystfmu.identify.one import fit_one


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
    data = decaying()
    data.to_csv("decay.csv")
    words = ["fit", "decay.csv", "--model", "prandtl_ishlinskii"]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
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
    done = CliRunner().invoke(main, ["fit", "a.csv", "--model", "prandtl_ishlinskii", "--train", rows])
    assert done.exit_code == 0, done.output
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
    without = CliRunner().invoke(main, ["predict", model, "u.csv", "-o", "q.csv"])
    assert without.exit_code == 0, without.output
    assert "no output" in without.stdout
    assert "all rows" not in without.stdout
