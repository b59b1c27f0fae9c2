"""Two studies of first-order lags on one page: shares, percentiles and changed draws by the closed form."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from decay import LAG

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.studies.compare import _sign_test, compare_studies
from hystfmu.studies.summary import read_study

Made = Callable[..., Path]
RANGES = {"command.step": {"range": [1.0, 4.0]}, "lag.b": {"scale": [0.5, 2.0]}}


@pytest.fixture
def made(write: Any, tmp_path: Path) -> Made:
    """A study of a lag with a time constant, in its folder."""

    def make(name: str, a: float = 0.5, seed: int = 5, limit: float = 3.0, method: str = "random") -> Path:
        lag = {**LAG["units"]["lag"], "values": {"b": [1.0], "a": [a, 1.0], "hold": "zoh"}}
        drawn = {"method": method, "parameters": RANGES, "limits": {"one": {"last": limit}}}
        more = {"n": 40, "seed": seed} if method == "random" else {}
        if method == "grid":
            drawn["parameters"] = {k: {**v, "steps": 3} for k, v in RANGES.items()}
        study = write(of_scenario={"units": {**LAG["units"], "lag": lag}}, **drawn, **more)
        hy.study(study, tmp_path / name, workers=1)
        return tmp_path / name

    return make


def last(folder: Path, a: float) -> np.ndarray:
    """The response of the lag to a step after 1 s, from the parameters in the table."""
    values = read_study(folder).values
    return np.asarray(values[:, 0] * values[:, 1] * (1 - np.exp(-1 / a)))


def test_shares_percentiles_and_changed_draws_are_those_of_the_closed_form(made: Made, tmp_path: Path) -> None:
    seed = int(np.random.default_rng().integers(2**31))
    old, new = made("old", 0.5, seed), made("new", 0.4, seed)
    before, after = last(old, 0.5), last(new, 0.4)
    found = {(c.title, c.what): (c.old, c.new) for c in compare_studies(old, new, tmp_path / "out.html")}
    for what, value in (("last, 50 % of the draws", 50), ("last, 99 % of the draws", 99)):
        expected = [float(np.quantile(v, value / 100, method="inverted_cdf")) for v in (before, after)]
        assert found["decay/one", what] == pytest.approx(expected, rel=1e-9)
    good = [v <= 3.0 for v in (before, after)]
    shares = [100 * float(g.mean()) for g in good]
    assert found.get(("all cases", "inside the limits, %"), (shares[0],) * 2) == pytest.approx(shares)
    text = (tmp_path / "out.html").read_text()
    moved = int(np.sum(good[0] != good[1]))
    assert f"{good[0].sum()} of 40 draws" in text
    assert (f"{moved} draws changed their verdict, 0 to inside and {moved} to outside" in text) == (moved > 0)
    assert compare_studies(old, old, tmp_path / "same.html") == []
    assert "No draw changed its verdict." in (tmp_path / "same.html").read_text()


def test_other_draws_have_no_pairs_and_grid_points_no_interval(made: Made, tmp_path: Path) -> None:
    compare_studies(made("a", seed=1), made("b", seed=2), tmp_path / "out.html")
    assert "no draw has two verdicts" in (tmp_path / "out.html").read_text()
    compare_studies(made("g", method="grid"), made("h", 0.3, method="grid"), tmp_path / "grid.html")
    text = (tmp_path / "grid.html").read_text()
    assert " of 9 draws (" in text
    assert "95 % interval" not in text


@pytest.mark.parametrize(("gained", "lost", "p"), [(9, 1, 22 / 1024), (0, 5, 2 / 32), (3, 3, 1.0), (1, 0, 1.0)])
def test_the_probability_of_a_one_sided_change(gained: int, lost: int, p: float) -> None:
    """Coins counted by hand: 9 of 10 or more one-sided are 22 of 1024 ways."""
    assert _sign_test(gained, lost) == pytest.approx(p, rel=1e-12)
    assert _sign_test(lost, gained) == pytest.approx(p, rel=1e-12)


def test_bad_input_is_told_in_one_line(made: Made, tmp_path: Path) -> None:
    good, bad, run = made("good"), tmp_path / "bad", tmp_path / "run"
    shutil.copytree(good, bad)
    told = json.loads((good / "report.json").read_text())
    for change, why in (
        ({"outcomes": "x"}, "outcomes: "),
        ({"outcomes": "i"}, "not the table of the study"),
        ({"interval": [0.1, 2.0]}, "interval.1: "),
        ({"limits": {"one": {"gone": 1.0}}}, "not the table of the study"),
    ):
        (bad / "report.json").write_text(json.dumps({"study": told["study"] | change}))
        with pytest.raises(InputError, match=why):
            compare_studies(good, bad, tmp_path / "out.html")
    (bad / "report.json").write_text(json.dumps(told))
    (bad / "results.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"results\.parquet: not a table of 'hystfmu study'$"):
        compare_studies(good, bad, tmp_path / "out.html")
    run.mkdir()
    (run / "report.json").write_text(json.dumps({"version": "1", "results": []}))
    said = CliRunner().invoke(main, ["compare", str(run), str(good), "-o", str(tmp_path / "out.html")])
    assert said.exit_code == 2
    assert "not a report of 'hystfmu study'" in said.output
    assert not (tmp_path / "out.html").exists()
