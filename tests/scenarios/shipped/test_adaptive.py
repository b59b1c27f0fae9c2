"""The adaptive inverse against a model that is identified anew on the changed plant, and beside a feedback."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.data import Dataset
from hystfmu.data.signals import training
from hystfmu.identify import fit
from hystfmu.inverse import inverse

ROOT = Path(__file__).parents[3] / "scenarios"
FACTOR = 1.2  # error after a change, of that with a model identified anew
OF_DRAWS = 1.5  # the same for drawn changes: noise makes some models identified anew better than others
CASES = ("load_10", "load_100", "load_random")


def tracking(scenario: str, case: str, **settings: Any) -> float:
    """RMS error in percent of the stroke in the window of the case."""
    given = {name.replace("__", "."): value for name, value in settings.items()}
    (result,) = hy.run(ROOT / scenario, engine="native", case=case, set=given)
    return next(v.value for v in result.verdicts if v.metric == "tracking")


def identified_anew(gain: float, weights: float, seed: int) -> dict[str, Any]:
    """Settings of an inverse that does not learn, from a record of the changed plant with 1 % noise."""
    u = 1.3 * training(100, seed)
    r = np.linspace(0.05, 0.5, 10)
    z, y = np.zeros(10), np.empty(len(u))
    for k, now in enumerate(u):
        z = np.maximum(now - r, np.minimum(now + r, z))
        y[k] = gain * (0.3 * now + weights * 0.1 * z.sum())
    y += 0.01 * np.abs(y).max() * np.random.default_rng(seed).normal(size=len(y))
    model = fit(Dataset.from_signal(u, y, 0.01, "changed"), "prandtl_ishlinskii", N=20)
    block = inverse(model, "adaptive")
    made = block.graph.node("adaptive")
    offset = block.graph.node("ports").value("offset").tolist()
    values = {f"inverse__adaptive_{k}": made.value(k).tolist() for k in ("r", "w")}
    return {
        **values,
        "inverse__adaptive_w0": float(made.value("w0")[0]),
        "inverse__adaptive_w0_min": 1e-3,
        "inverse__adaptive_sd": [0.0] * 21,
        "inverse__ports_offset": offset,
        "gain__t_step": 0.0,
        "weights__t_step": 0.0,
    }


def changed(gain: float, weights: float) -> dict[str, float]:
    return {"gain__step": gain - 1, "weights__step": weights - 1}


def test_after_a_load_change_it_is_as_good_as_a_model_identified_anew() -> None:
    """Gain and weights +20 %: third period at 10 and 100 Hz; random reversals from 0.2 s after the change."""
    anew = identified_anew(1.2, 1.2, 3)
    for case in CASES:
        learned, offline = (tracking("adaptive", case, **changed(1.2, 1.2), **s) for s in ({}, anew))
        print(f"{case}: {learned:.4f} % of the stroke, identified anew {offline:.4f}, factor {learned / offline:.2f}")
        assert learned <= FACTOR * offline


@pytest.mark.stress
def test_after_any_change_it_meets_the_requirement() -> None:
    """Gain and weights drawn from 0.8 to 1.2.

    The third period at 100 Hz, 30 ms after the change, may be behind a model made anew.  There a change of gain and
    weights that nearly cancel stays below `change` and is learned as a drift: one in twenty is 0.06 to 0.106.
    """
    seed = int(np.random.default_rng().integers(1 << 31))
    print(f"seed {seed}")
    rng, limits = np.random.default_rng(seed), dict(zip(CASES, (0.05, 0.12, 0.05), strict=True))
    for gain, weights in [(1.2, 1.0), (1.0, 1.2), (0.8, 1.0), (1.0, 0.8), *rng.uniform(0.8, 1.2, (8, 2))]:
        anew = identified_anew(gain, weights, int(rng.integers(1 << 31)))
        for case in CASES:
            learned, offline = (tracking("adaptive", case, **changed(gain, weights), **s) for s in ({}, anew))
            print(f"gain {gain:.2f} weights {weights:.2f} {case}: {learned:.4f}, factor {learned / offline:.2f}")
            assert learned <= limits[case]
            assert case == "load_100" or learned <= OF_DRAWS * offline


def test_beside_a_feedback_nothing_is_lost() -> None:
    """With a reference that was drawn at run time; the same loop with an inverse that does not learn."""
    seed = int(np.random.default_rng().integers(1, 1 << 31))
    settings: dict[str, Any] = {"reference__seed": seed}
    learns, fixed = (tracking("adaptive_pid", f"nominal_random{end}", **settings) for end in ("", "_fixed"))
    print(f"seed {seed}: {learns:.5f} % of the stroke, does not learn {fixed:.5f}")
    assert learns <= 1.02 * fixed


def test_without_feedback_and_change_it_is_better_than_the_model_it_began_with() -> None:
    still = {"inverse__adaptive_sd": [0.0] * 21}
    assert tracking("adaptive", "nominal_10") <= 0.7 * tracking("adaptive", "nominal_10", **still)


@pytest.mark.parametrize("f_n", [400.0, 600.0])
def test_dynamics_that_are_20_percent_off_do_less_harm_than_without_learning(f_n: float) -> None:
    omega, still = 2 * np.pi * f_n, {"inverse__adaptive_sd": [0.0] * 21, **changed(1.0, 1.0)}
    plant = {"plant__g0_b": [omega**2], "plant__g0_a": [1.0, 1.4 * omega, omega**2]}
    for case in ("nominal_10", "load_100"):
        assert tracking("adaptive", case, **plant) <= 0.5 * tracking("adaptive", case, **plant, **still)
