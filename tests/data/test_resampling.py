"""Uneven sampling: refused with one line, resampled on request, turning points kept, gaps never bridged."""

import numpy as np
import plants
import pytest
from click.testing import CliRunner
from invoked import invoked

from hystfmu import InputError, Model, read
from hystfmu.cli import main
from hystfmu.data.reversals import resample


def uneven(n=2000, h=1e-3, jitter=0.4, seed=0):
    """Times of a logger that is late by up to 40 % of a step, and a loop of several amplitudes."""
    t = h * (np.arange(n) + jitter * np.random.default_rng(seed).uniform(-1, 1, n))
    return t, np.sin(2 * np.pi * 7 * t) * np.cos(2 * np.pi * 0.8 * t)


def write(path, t, u, y):
    rows = zip(*map(np.ndarray.tolist, (t, u, y)), strict=True)
    path.write_text("t,u,y\n" + "".join(f"{a!r},{b!r},{c!r}\n" for a, b, c in rows))
    return path


def test_straight_lines_between_rows():
    t = np.array([0.0, 1.0, 2.5, 3.5, 4.0, 5.0])
    new, u, y, _ = resample(t, 2 * t, -t, 1.0, "x")
    np.testing.assert_allclose(new, [0, 1, 2, 3, 4, 5])
    np.testing.assert_allclose(u, 2 * new)
    np.testing.assert_allclose(y, -new)


def test_turning_points_keep_their_values():
    t = np.array([0.0, 1.0, 2.4, 3.0, 4.0, 5.3, 6.0, 7.0])
    u = np.array([0.0, 1.0, 2.0, 1.0, 0.0, -2.0, -1.0, 0.0])
    _, new, y, _ = resample(t, u, 10 * u, 1.0, "x")
    assert (new.max(), new.min()) == (2.0, -2.0)
    assert new[2] == 2.0  # measured at 2.4; a straight line at 2 gives less
    np.testing.assert_array_equal(y, 10 * new)


def test_memory_survives():
    """A sum of plays over the new rows is the measured output; over plain straight lines the extrema are cut."""
    t, u = uneven(600, 1 / 200)
    y = plants.prandtl_ishlinskii(u)
    new, kept, wanted, _ = resample(t, u, y, 150.0, "x")
    cut = np.interp(new, t, u)
    error = np.sqrt(np.mean((plants.prandtl_ishlinskii(kept) - wanted) ** 2))
    plain = np.sqrt(np.mean((plants.prandtl_ishlinskii(cut) - np.interp(new, t, y)) ** 2))
    assert error < 0.8 * plain
    assert error < 0.01 * np.ptp(y)


def test_the_steps_are_even_and_the_rate_is_the_median():
    t, u = uneven()
    new, *_ = resample(t, u, u, None, "x")
    assert np.ptp(np.diff(new)) < 1e-12
    assert abs(np.diff(new).mean() / np.median(np.diff(t)) - 1) < 1e-12
    assert new[0] == t[0]
    assert t[-1] - np.diff(new)[0] < new[-1] <= t[-1] * (1 + 1e-12)


def test_one_lost_sample_is_bridged_and_a_gap_is_not(tmp_path):
    t = np.arange(50) / 10
    u = np.sin(t)
    lost = np.arange(50) != 20
    new, v, *_ = resample(t[lost], u[lost], u[lost], 10.0, "x")
    np.testing.assert_allclose(new, t)
    np.testing.assert_allclose(v[20], (u[19] + u[21]) / 2)
    gap = (np.arange(50) < 20) | (np.arange(50) > 23)
    path = write(tmp_path / "g.csv", t[gap], u[gap], u[gap])
    words = r"g.csv: line 22: The gap .* must be at most 4.5 median steps of 0.1 s .* Got 0.5 s instead"
    with pytest.raises(InputError, match=words):
        read(path, resample="median")


@pytest.mark.parametrize("rate", [0.0, -1.0, 2100.0, np.nan, np.inf])
def test_rates_out_of_reach(rate):
    t, u = uneven()
    with pytest.raises(InputError, match=r"rate to resample to must be above 0 .* Got .* instead"):
        resample(t, u, u, rate, "x")


def test_the_train_rows_cover_the_same_time(tmp_path):
    t, u = uneven()
    path = write(tmp_path / "t.csv", t, u, u)
    d = read(path, train="500:1500", resample=500.0)
    assert t[500] <= d.t[d.train][0] < t[500] + d.h
    assert t[1499] - d.h < d.t[d.train][-1] <= t[1499]
    again = d.resampled(250.0)
    assert again.h == 2 * d.h
    assert abs(again.t[again.train][0] - d.t[d.train][0]) <= again.h


def test_on_the_command_line(tmp_path):
    t, u = uneven()
    path = write(tmp_path / "u.csv", t, u, plants.prandtl_ishlinskii(u))
    out, predicted = str(tmp_path / "m.model.toml"), tmp_path / "p.csv"
    command = ["fit", str(path), "--model", "prandtl_ishlinskii", "-o", out]
    refused = invoked(command, status=2)
    assert refused.stderr.count("\n") == 1
    for words in ("line ", "equal steps", "a step of", "--resample"):
        assert words in refused.stderr
    assert CliRunner().invoke(main, [*command, "--resample"]).exit_code == 0
    assert Model.load(out).fit["rms_percent"] < 0.3
    invoked(["predict", out, str(path), "--resample", "1000", "-o", str(predicted)])
    assert read(predicted).h == pytest.approx(1e-3)
    wrong = invoked([*command, "--resample", "fast"], status=2)
    assert "--resample" in wrong.stderr
    assert "'fast'" in wrong.stderr
