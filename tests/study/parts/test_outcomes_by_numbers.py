"""The answer of a study by numbers: outcomes, ratios to limits, spreads, Sobol indices at their limits."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu.studies import figures, summary
from hystfmu.studies.summary import Spread, Summary


def row(variation=0, case="a", status="ok", index=0, **metrics):
    return {"variation": variation, "case": case, "status": status, "index": index, "metrics": metrics, "values": {}}


def system(name="a", **kinds):
    metrics = {k: SimpleNamespace(kind=kind) for k, kind in kinds.items()}
    return SimpleNamespace(case=SimpleNamespace(name=name, metrics=metrics))


def study(limits=None, method="random"):
    limits = limits or {}
    return SimpleNamespace(limits=lambda case: limits.get(case.name, {}), spec=SimpleNamespace(method=method))


# ---- ratios to limits -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("metrics", "limits", "ratio"),
    [
        ({"m": 3.0}, {"m": 2.0}, 1.5),
        ({"m": 3.0, "n": 8.0}, {"m": 2.0, "n": 2.0}, 4.0),
        ({"m": math.nan}, {"m": 2.0}, math.inf),
        ({"m": -1.0}, {"m": 0.0}, 1.0),
        ({"m": 0.0}, {"m": 0.0}, 1.0),
        ({"m": 1e-9}, {"m": 0.0}, math.inf),
        ({"m": -3.0}, {"m": -2.0}, 1.0),
        ({"m": -1.0}, {"m": -2.0}, math.inf),
        ({"m": 7.0, "n": 9.0}, {}, 7.0),
    ],
)
def test_the_largest_ratio_of_a_metric_to_its_limit(metrics, limits, ratio):
    assert summary.excess(row(**metrics), limits) == ratio
    assert summary.excess(row(status="timeout", **metrics), limits) == math.inf


def test_the_worst_rows_of_a_case_come_first():
    rows = [row(0, "a", index=3, m=1.0), row(1, "b", index=0, m=9.0), row(2, "a", index=1, m=2.0)]
    rows += [row(3, "a", "timeout", index=7), row(4, "a", index=0, m=1.0)]
    assert [r["variation"] for r in summary.worst_rows(rows, "a", {"m": 1.0})] == [3, 2, 4, 0]


@pytest.mark.parametrize(
    ("status", "metrics", "unstable"),
    [
        ("stopped", {}, True),
        ("timeout", {}, False),
        ("ok", {"r": 25.0, "x": 50.0, "radius": 0.999}, False),
        ("ok", {"r": 25.1}, True),
        ("ok", {"x": 50.1}, True),
        ("ok", {"r": math.nan}, True),
        ("ok", {"radius": 1.0}, True),
        ("ok", {"radius": math.nan}, True),
        ("ok", {"other": 99.0}, False),
        ("ok", {}, False),
    ],
)
def test_a_lost_reference_or_a_pole_outside_is_unstable(status, metrics, unstable):
    of = system(r="rms_percent", x="max_percent", other="peak")
    assert summary.is_unstable(of, row(status=status, **metrics)) is unstable


def test_the_outcome_of_a_variation_over_its_cases():
    systems = [system("a", m="peak"), system("b", m="peak")]
    rows = [
        *(row(0, c, m=1.0) for c in "ab"),
        *(row(1, c, m=v) for c, v in (("a", 1.0), ("b", 2.01))),
        row(2, "a", m=1.0), row(2, "b", "timeout"),
        row(3, "a", "timeout"), row(3, "b", "stopped"),
        row(4, "a", m=99.0), row(4, "b", m=2.0),
    ]  # fmt: skip
    found = summary.outcomes(study({"b": {"m": 2.0}}), systems, rows)
    assert found == {0: "inside", 1: "outside", 2: "failed", 3: "unstable", 4: "inside"}
    told = summary.summarise(study({"b": {"m": 2.0}}), systems, rows)
    assert told is not None
    assert (told.draws, told.inside, told.unstable, told.failed) == (5, 2, 1, 1)
    assert told.interval == summary.interval(2, 5)
    assert [w["variation"] for w in told.worst] == [3, 2]
    assert [(s.case, s.metric, s.limit) for s in told.spreads] == [("a", "m", None), ("b", "m", 2.0)]
    assert summary.summarise(study(method="grid"), systems, rows).interval is None
    assert summary.summarise(study(method="optuna"), systems, rows) is None


def test_the_spread_of_a_metric():
    rows = [row(k, "a", m=float(v)) for k, v in enumerate(np.random.default_rng(1).permutation(200))]
    rows += [row(500, "b", m=1e9)]
    (found,) = summary._spreads("a", {"m": 49.0}, rows)
    assert found == Spread("a", "m", (9.0, 99.0, 189.0, 197.0), 199.0, 49.0, 0.25)
    rows += [row(k, "a", m=math.nan) for k in range(200, 202)] + [row(300, "a", "timeout", n=1.0)] * 2
    m, n = summary._spreads("a", {}, rows)
    assert (m.worst, m.percentiles[3], m.limit, m.within) == (math.inf, math.inf, None, None)
    assert n.percentiles == (math.inf,) * 4


LIMITED = (Spread("a", "m", (1.0, 2.0, 3.0, 4.0), 5.0, 3.0, 0.6),)
FREE = (Spread("a", "m", (1.0, 2.0, 3.0, 4.0), 5.0, None, None),)


@pytest.mark.parametrize(
    ("told", "sentence"),
    [
        (Summary(8, 2, 0, 0, None, FREE, ()), "8 draws without limits; none is unstable."),
        (Summary(8, 2, 1, 3, None, FREE, ()), "8 draws without limits; 1 is unstable; 3 could not be run."),
        (
            Summary(8, 2, 2, 0, None, LIMITED, ()),
            "2 of 8 draws are inside the limits (25 %); 2 are unstable.",
        ),
        (
            Summary(8, 2, 0, 1, (0.0312, 0.651), LIMITED + FREE, ()),
            "2 of 8 draws are inside the limits (25 %; 95 % interval 3.12 to 65.1 %, Clopper-Pearson); none is "
            "unstable; 1 could not be run.",
        ),
    ],
)
def test_the_answer_in_one_sentence(told, sentence):
    assert told.sentence == sentence


def test_the_command_and_settings_of_a_row(tmp_path: Path):
    of = SimpleNamespace(
        file=tmp_path / "studies" / "s.toml",
        spec=SimpleNamespace(scenario="../scenarios/x"),
        settings=lambda values: {"pid.Kp": 2.5, "lag.b": "*0.5", "q": [1.0, 2.0], **values},
    )
    r = {**row(3, "fast"), "values": {"v": 1.0}}
    line = summary.command(of, r)
    given = "--set pid.Kp=2.5 --set 'lag.b=*0.5' --set 'q=[1.0, 2.0]' --set v=1.0"
    assert line == f"hystfmu run {tmp_path / 'scenarios' / 'x'} --case fast {given}"
    path = summary.save_settings(of, r, tmp_path)
    assert path == tmp_path / "worst" / "fast-3.json"
    assert json.loads(path.read_text()) == of.settings({"v": 1.0})
    assert path.read_text().startswith('{\n "pid.Kp": 2.5')


# ---- effects --------------------------------------------------------------------------------------------------------
def legendre(x):
    return np.sqrt(3) * (2 * x - 1)


def draws(n, p, seed=1):
    return np.random.default_rng(seed).random((n, p))


def test_indices_of_a_product_and_a_sum():
    x = draws(400, 3)
    y = np.column_stack([legendre(x[:, 0]) * legendre(x[:, 1]) + 2 * legendre(x[:, 0]), np.full(400, 3.0)])
    found = figures.effects(x, y)
    assert found.first == pytest.approx(np.array([[0.8, 0], [0, 0], [0, 0]]), abs=1e-9)
    assert found.total == pytest.approx(np.array([[1.0, 0], [0.2, 0], [0, 0]]), abs=1e-9)
    assert found.explained == pytest.approx([1.0, 0.0], abs=1e-9)


def test_what_is_explained_is_the_leave_one_out_error():
    x, rng = draws(60, 1), np.random.default_rng(2)
    y = (x + 0.3 * rng.normal(size=(60, 1)))[:, 0]
    best = 0.0
    for degree in range(1, 13):
        A = np.polynomial.legendre.legvander(2 * x[:, 0] - 1, degree)
        if 2 * (degree + 1) > 60:
            break
        errors = []
        for k in range(60):
            rest = np.delete(np.arange(60), k)
            errors.append(y[k] - A[k] @ np.linalg.lstsq(A[rest], y[rest], rcond=None)[0])
        best = max(best, 1 - np.mean(np.square(errors)) / y.var())
    assert figures.effects(x, y[:, None]).explained[0] == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize(("n", "explained"), [(3, 0.0), (4, 1.0), (5, 1.0)])
def test_two_runs_a_term_are_needed(n, explained):
    x = np.linspace(0, 1, n)[:, None]
    assert figures.effects(x, legendre(x)).explained[0] == pytest.approx(explained, abs=1e-6)


@pytest.mark.parametrize(("degree", "found"), [(12, 1.0), (13, 0.0)])
def test_degrees_up_to_twelve_and_three_hundred_terms(degree, found):
    x = draws(900, 1)
    y = np.polynomial.legendre.legval(2 * x - 1, np.eye(degree + 1)[degree])
    assert round(figures.effects(x, y).explained[0], 2) == pytest.approx(found, abs=0.1)
    many = draws(700, 23, 3)  # 300 terms of degree 2
    y = legendre(many[:, :1]) * legendre(many[:, 1:2])
    assert figures.effects(many, y).total[0, 0] == pytest.approx(1.0, abs=1e-6)
    more = draws(700, 24, 3)  # 325 terms
    y = legendre(more[:, :1]) * legendre(more[:, 1:2])
    assert figures.effects(more, y).explained[0] < 0.5


@pytest.mark.parametrize(("levels", "exact"), [(64, True), (65, False)])
def test_polynomials_of_up_to_64_levels_are_orthonormal_over_them(levels, exact):
    column = np.repeat(np.linspace(0, 1, levels) ** 2, 3)
    b = figures._orthonormal(column)
    assert b.shape == (3 * levels, 13)
    assert np.allclose(b.T @ b / len(b), np.eye(13), atol=1e-9) is exact
    two = figures._orthonormal(np.array([0.0, 1.0, 1.0, 0.0]))
    assert two.shape == (4, 2)
    assert two.T @ two / 4 == pytest.approx(np.eye(2))


def test_a_parameter_that_stays_needs_no_runs():
    x = np.column_stack([np.linspace(0, 1, 6), np.full(6, 0.5), np.full(6, 0.1)])
    found = figures.effects(x, legendre(x[:, :1]))
    assert found.total[:, 0] == pytest.approx([1.0, 0, 0], abs=1e-9)
