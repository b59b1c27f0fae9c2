"""Model selection: test the data for return-point memory, fit the candidates, choose by the validation split.

A sum of plays returns to its path after a minor loop, a Bouc-Wen operator does not, and neither follows the other to
better than a few percent.  So model classes whose memory contradicts the minor loops are discarded, and those for rate
dependence if the input has one speed; each discard states its reason.  The other candidates are fitted to the first
70 % of the training rows, cheapest first, and scored on the validation split, the last 30 %.  The split only selects:
its error does not predict the error on another kind of signal.  If the excitation is not informative enough to identify
memory, the model carries warnings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.identify.catalogue import takes_covariates, takes_records
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, Excitation, examine
from hystfmu.identify.one import fit_one
from hystfmu.identify.options import Option
from hystfmu.model.accuracy import errors
from hystfmu.model.inputs import run_along

TEXT = "selection by minor loops, rate dependence and the validation split, the last 30 % of the training rows"
OPTIONS: tuple[Option, ...] = ()
SHARE = 0.7  # of the training rows: fitted; the rest is the validation split
AS_GOOD = 1.05  # of the candidates within 5 % of the best, the one with the fewest parameters is chosen
EXACT = 0.01  # % of the span: errors below it count as equal
NOISE = 1.25  # an error of so many sigma of the output's noise leaves nothing to explain
CLEARLY, FINE = 1.2, 0.1  # error ratio and error in % of the span: static models must exceed both to show a rate
LARGE = 2.0  # % of the span: if minor loops stay open by more, no static return-point model can represent the data
BUDGET = 60.0  # s for all candidates; estimated, not timed, because the choice must not depend on the load
CLOSES, OPENS, LAGS = "return-point", "open", "rate"


@dataclass(frozen=True)
class Candidate:
    """A candidate of the selection.

    Parameters
    ----------
    method : str
        Kind of model.
    memory : str
        ``return-point``: static, minor loops close; ``open``: static, minor loops stay open; ``rate``: rate-dependent;
        empty: creep or lags may open a loop.
    seconds, per_1000 : float
        Estimated cost (s): fixed, and per 1000 rows up to the last training row.
    options : dict
        Options of the method that differ from its defaults.
    """

    method: str
    memory: str
    seconds: float
    per_1000: float
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Method with its options, e.g. ``zhao_tan_mlp memory=last``."""
        return " ".join([self.method, *(f"{k}={v}" for k, v in self.options.items())])

    def cost(self, rows: int) -> float:
        """Return the estimated cost (s) for this number of rows."""
        return self.seconds + self.per_1000 * rows / 1000


_LISTED = (  # cheapest first
    Candidate("prandtl_ishlinskii_asym", "", 0.02, 0.01),
    Candidate("prandtl_ishlinskii", CLOSES, 0.02, 0.05),
    Candidate("krasnoselskii_pokrovskii", CLOSES, 0.02, 0.03),
    Candidate("prandtl_ishlinskii_rate", LAGS, 0.05, 0.05),
    Candidate("polynomial_narx", "", 0.05, 0.02),
    Candidate("actuator", "", 1.0, 0.4),
    Candidate("constraint_factor_mlp", CLOSES, 0.3, 0.2),
    Candidate("preisach", CLOSES, 0.1, 0.25),
    Candidate("bouc_wen", OPENS, 0.2, 1.5),  # before duhem, which follows it with more parameters
    Candidate("duhem", OPENS, 0.2, 0.5),
    Candidate("fitted_operator_mlp", CLOSES, 2.0, 0.1),
    Candidate("rate_mlp", LAGS, 4.0, 0.1),
    Candidate("g0_prandtl_ishlinskii", LAGS, 1.0, 1.0),
    Candidate("play_bank_mlp", CLOSES, 6.0, 0.1),
    Candidate("zhao_tan_mlp", CLOSES, 7.0, 0.1),
    Candidate("zhao_tan_mlp", OPENS, 7.0, 0.1, {"memory": "last"}),
)
CANDIDATES: dict[str, Candidate] = {c.name: c for c in _LISTED}


@dataclass(frozen=True)
class Choice:
    """Result of the selection.

    Parameters
    ----------
    method, options : str, dict
        Method and options to fit to all training rows.
    fit : dict
        Entries of `Model.fit`: ``memory`` (class of the minor loops), ``gap_percent``, ``loops``, ``rate`` (``seen``,
        ``not seen``, which discards rate-dependent methods, or ``one speed only``), ``warnings`` (list of str).
    provenance : dict
        Entries of `Model.provenance`: ``auto``, the RMS error of every candidate on the validation split in percent of
        the span of y; ``auto_parameters``, their numbers of parameters; ``auto_left_out``, the reasons for discards.
    """

    method: str
    options: dict[str, Any]
    fit: dict[str, Any]
    provenance: dict[str, Any]


def choose(data: Dataset, seed: int, progress: Callable[[float], None]) -> Choice:
    """Fit the candidates that suit the data and choose the best on the validation split.

    Parameters
    ----------
    data : Dataset
        Measured data.
    seed : int
        Seed of random starts.
    progress : function
        Called with the fraction done, 0..1.

    Raises
    ------
    InputError
        No candidate can be fitted.
    """
    first, end = data.train.start, data.train.stop
    middle = first + round(SHARE * (end - first))
    part = data.with_train((first, middle))
    seen = examine(data.longest())
    reasons = left_out(seen, middle)
    if len(data.starts) > 1:
        reasons |= {c.name: "it takes one record only" for c in CANDIDATES.values() if not takes_records(c.method)}
    if data.covariates:
        reasons |= {c.name: "it takes no covariates" for c in CANDIDATES.values() if not takes_covariates(c.method)}
    fitted = [name for name in CANDIDATES if name not in reasons]
    costs = np.array([CANDIDATES[name].cost(middle) for name in fitted])
    done = np.concatenate([[0.0], np.cumsum(costs)]) / (costs.sum() + costs.max())  # the winner is fitted once more
    # a dearer candidate cannot do better than the noise
    floor = max(EXACT, NOISE * 100 * noise(data.y[data.train]) / data.span)
    scores: dict[str, float] = {}
    parameters: dict[str, int] = {}
    for k, name in enumerate(fitted):
        candidate = CANDIDATES[name]
        if min(scores.values(), default=np.inf) <= floor:
            reasons[name] = f"{min(scores, key=lambda n: scores[n])} leaves nothing but noise"
            continue

        def share(fraction: float, k: int = k) -> None:
            progress(float(done[k] + fraction * (done[k + 1] - done[k])))

        try:
            model = fit_one(part, candidate.method, seed, share, candidate.options)
        except InputError as e:
            reasons[name] = str(e)
            continue
        free = run_along(model.graph, data)
        score = errors(free[middle:end], data.y[middle:end], data.span)["rms_percent"]
        if model.fit["parameters"] > middle - first:
            reasons[name] = f"{model.fit['parameters']} parameters for {middle - first} rows"
        elif not np.isfinite(score):
            reasons[name] = "unstable in a free run"
        else:
            scores[name], parameters[name] = score, model.fit["parameters"]
    if not scores:
        raise InputError(f"{data.path or data.name}: The data must suit a candidate. Got none that fits: {reasons}")
    rate = _rate(scores, seen)
    able = {n: e for n, e in scores.items() if rate == "seen" or CANDIDATES[n].memory != LAGS} or scores
    least = max(min(able.values()), EXACT)
    name = min((n for n in able if able[n] <= AS_GOOD * least), key=lambda n: parameters[n])
    told = {
        "memory": seen.memory,
        "loops": seen.loops,
        "gap_percent": seen.gap,
        "rate": rate,
        "warnings": [*_warnings(name, seen)],
    }
    why = {"auto": scores, "auto_parameters": parameters, "auto_left_out": reasons}
    return Choice(CANDIDATES[name].method, CANDIDATES[name].options, told, why)


def left_out(seen: Excitation, rows: int) -> dict[str, str]:
    """Return the candidates that contradict the data or exceed the budget, with the reasons."""
    reasons: dict[str, str] = {}
    spent = 0.0
    for name, candidate in CANDIDATES.items():
        if candidate.memory == OPENS and seen.memory == NONE:
            reasons[name] = "the output is a function of the input"
        elif candidate.memory == OPENS and seen.memory == RETURN_POINT:
            reasons[name] = f"minor loops close (gap {seen.gap:.2g} % of the span of y)"
        elif candidate.memory == CLOSES and seen.memory == OPEN_LOOPS and seen.gap > LARGE:
            reasons[name] = f"minor loops stay open by {seen.gap:.2g} % of the span of y"
        elif candidate.memory == LAGS and not seen.several_speeds:
            reasons[name] = "the input has one speed only and is not informative about rate dependence"
        elif spent + candidate.cost(rows) > BUDGET:
            reasons[name] = f"about {candidate.cost(rows):.0f} s for {rows} rows; fit it by name"
        else:
            spent += candidate.cost(rows)
    return reasons


def _rate(scores: dict[str, float], seen: Excitation) -> str:
    """Decide whether a rate-dependent method has a clearly smaller validation error than all others."""
    if not seen.several_speeds:
        return "one speed only"
    lags = [e for n, e in scores.items() if CANDIDATES[n].memory == LAGS]
    others = [e for n, e in scores.items() if CANDIDATES[n].memory != LAGS]
    better = lags and min(others, default=np.inf) > max(CLEARLY * min(lags), FINE)
    return "seen" if better else "not seen"


def _warnings(name: str, seen: Excitation) -> tuple[str, ...]:
    memory = CANDIDATES[name].memory
    if (memory, seen.memory) in ((OPENS, RETURN_POINT), (CLOSES, OPEN_LOOPS)):
        other = (
            f"the best model on the validation split is {name}, but the minor loops in the data have a gap of "
            f"{seen.gap:.2g} % of the span of y ({seen.memory} memory): rate dependence, creep or drift opens them, "
            "or no candidate fits"
        )
        return (*seen.warnings, other)
    return seen.warnings
