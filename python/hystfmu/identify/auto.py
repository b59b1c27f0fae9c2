"""Automatic choice of the kind of model by cross-validation on blocks of the training rows.

Validation blocks. The blocks are cut between reversals and are spread over the whole record. A single block at the end
would test extrapolation if the record changes with time, such as a decaying sine or a staircase of minor loops. The
blocks form disjoint folds. Each candidate is fitted to the rows outside a fold and tested on this fold; the cheapest
candidate is fitted first. After each fold, candidates whose errors are clearly larger than the smallest error are
stopped. They are called losers. This method is called racing (Maron & Moore 1994; Birattari et al. 2002). If the errors
of the other candidates turn out to be uncertain, a loser continues with the next fold. `hystfmu.identify.race` defines
the errors and the losers.

Choice. Each model is also simulated with the input of the record and another initial memory. The output of some models
then leaves the range of the measured output by more than the span. Such a model is chosen only if all models without
this fault are losers. Among equally good kinds, a kind whose fit ended at no bound of a parameter is preferred, then a
kind with an exact inverse, and then the kind with the fewest parameters. If the smallest error, after the noise is
subtracted, exceeds `REFUSED` % of the span, an InputError is raised (`refusal`).

Cost. No kind is excluded because of its cost. If the fits to all rows would take too long, all kinds are compared on a
shorter part of the record (`hystfmu.identify.cuts`), or on the longest of several records. The chosen kind is then
fitted to all training rows. If its error on all rows is clearly larger than on the compared rows, the part does not
represent the record, for example because it ends before a fast sweep. The same holds if another kind follows the
compared rows much better, but its fits to them differ too much. The best kinds are then compared on all rows.

Exclusion. A kind is not compared if its memory contradicts the minor loops in the data. Rate-dependent kinds are not
compared if the input has only one speed. A kind is not fitted either if the fits so far show that it cannot be chosen
(`_needless`).
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from hystfmu.base import InputError, Progress, silent
from hystfmu.data import Dataset
from hystfmu.identify.catalogue import CLOSES, LAGS, LATE, OPENS, Candidate, candidates, method, too_large
from hystfmu.identify.cuts import shortened
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, Excitation, examine, several_speeds
from hystfmu.identify.excitation.rest import remembered, rest
from hystfmu.identify.one import fit_one
from hystfmu.identify.race import EXACT, HOPE, LOSER, Race, Trial
from hystfmu.model import Model, guards, rms

# the data show rate dependence if the error of the best other kind exceeds CLEARLY times the error of the best
# rate-dependent kind, and exceeds FINE % of the span
CLEARLY, FINE = 1.2, 0.1
REFUSED = 5.0  # largest accepted error of the best model, without noise (% of the span)
EXACT_INVERSE = "exact"
LARGE = 2.0  # gap of minor loops (% of the span) above which static return-point models are excluded
CLOSED = 0.05  # gap of minor loops (% of the span) up to which models with open loops are excluded
BUDGET = 24.0  # estimated time for all candidates (s); it is not measured, so that the load does not change the choice
EXPLAINED = 0.3  # error of a model, relative to the gap of minor loops, up to which it represents their gap
HOPEFUL = 0.2  # expected share of the full cost for kinds with a trial fit: most fail it, or need no fit at all
LEAST_ROWS, FEWER = 2000, 0.9  # minimum number of rows of the comparison, and factor by which the number is reduced
SHORT = 0.2  # cost of a short trial fit, relative to a full fit
MISLED = 1.5  # ratio of the errors on all rows and on the compared rows above which all rows are compared
CLOSER = 3.0  # or ratio of the errors of the chosen and of another candidate on the compared rows


class Inverses(Protocol):
    """Interface that tells `auto` whether a model has an inverse; `hystfmu.inverse` implements it."""

    def kind(self, model: Model) -> str:
        """Return the method that can invert a model, or the reason why no method can."""

    def fault(self, model: Model) -> str:
        """Return the reason why a model has no useful inverse, or an empty text if it has one."""


def choose(
    data: Dataset, seed: int, progress: Progress, inverses: Inverses | None = None, only_invertible: bool = False
) -> Model:
    """Compare all candidates that do not contradict the data, choose one, and fit it to all training rows.

    The arguments are those of `hystfmu.identify.fit`. With `only_invertible`, a model without a useful inverse is not
    chosen. The function raises an InputError if no candidate can be fitted, if no candidate represents the data, or if
    no suitable candidate has a useful inverse.

    Returns
    -------
    Model
        Fitted model of the chosen kind.

        `fit` also contains the memory class ``memory``, the number of minor loops ``loops``, the RMS gap of the minor
        loops ``gap_percent`` (% of the span of y), and the text ``rate``. The text is ``seen`` if the data show rate
        dependence, ``not seen`` if they do not, and ``one speed only`` if the input has one speed.

        `provenance` also contains

        - ``auto``: RMS error of each candidate on the validation blocks, in percent of the span of y, the candidate
          with the smallest error first;
        - ``auto_blocks``: RMS errors of each candidate on the single blocks, in percent of the span of y;
        - ``auto_choice``: name of the chosen candidate;
        - ``auto_parameters``: number of parameters of each candidate;
        - ``auto_inverse``: method that inverts each candidate;
        - ``auto_left_out``: excluded candidates, each with the reason;
        - ``auto_not_tried``: names of the candidates that were never fitted;
        - ``auto_rows``: number of training rows that were used for the choice, if not all were used.
    """
    started = time.perf_counter()
    where = data.path or data.name
    raced = data
    seen = replace(examine(data.longest()), several_speeds=several_speeds(data.u, data.records, data.train))
    entered, reasons = entrants(len(data.t), bool(data.covariates), seen)
    most = affordable([c for _, c in entered.values()], data.train.stop)
    if data.train.stop > most and len(data.starts) > 1:  # the only record of the race may have one speed
        raced = data.longest()
        seen = examine(raced)
        entered, reasons = entrants(len(data.t), bool(data.covariates), seen)
    raced = shortened(raced, most)
    report, untried = _Report(progress), list(reasons)

    def fitted(best: Trial) -> Model:
        if raced is data and best.complete is not None:
            return best.complete
        u0 = race.rest if raced is data else rest(data)
        return fit_one(data, best.key, seed, silent, {**remembered(best.key, u0, data), **best.candidate.options})

    while True:
        race = Race(raced, seed, poor=bool(seen.warnings) and seen.memory != NONE)
        race.reasons |= reasons
        untried += _run(race, entered, seen, only_invertible, report)
        if not race.trials:
            raise refusal(where, only_invertible, race, seen, {})
        rate = _rate(race, seen)
        best, model = _chosen(race, fitted, rate == "seen", inverses, only_invertible)
        if isinstance(best, dict):
            raise refusal(where, only_invertible, race, seen, best)
        assert model is not None
        if raced is data or not _misled(race, best, model):
            break
        entered, reasons = _again(race, entered, data.train.stop)
        raced = data
    ranked = sorted(race.trials.values(), key=race.excess)
    why: dict[str, Any] = {"auto": {t.name: 100 * rms(t.errors) / raced.span for t in ranked}}
    why["auto_blocks"] = {t.name: [100 * e / raced.span for e in t.by_block] for t in ranked}
    why["auto_parameters"] = {t.name: t.parameters for t in ranked}
    if inverses is not None:
        why["auto_inverse"] = {t.name: inverses.kind(t.model) for t in ranked}
    why["auto_left_out"] = {n: race.reasons[n] for n in [*untried, *(m for m in race.reasons if m not in untried)]}
    why["auto_not_tried"] = untried
    if raced is not data:
        why["auto_rows"] = raced.train.stop - raced.train.start
    told = {"memory": seen.memory, "loops": seen.loops, "gap_percent": seen.gap, "rate": rate}
    told["warnings"] = [*_warnings(best, seen), *model.fit.get("warnings", [])]
    told["seconds"] = round(time.perf_counter() - started, 4)
    return replace(model, fit={**model.fit, **told}, provenance={**model.provenance, **why, "auto_choice": best.name})


def entrants(rows: int, covariates: bool, seen: Excitation) -> tuple[dict[str, tuple[str, Candidate]], dict[str, str]]:
    """Return two dicts by name: the candidates to compare with their kinds, and the reason for each exclusion.

    The record has this number of rows. `covariates` is whether it has covariates, and `seen` is its excitation.
    """
    found = candidates()
    reasons = left_out({n: c for n, (_, c) in found.items()}, seen)
    if covariates:
        reasons |= {n: "it takes no covariates" for n, (key, _) in found.items() if not method(key).covariates}
    reasons |= {n: large for n, (key, c) in found.items() if (large := too_large(rows, key, c.options))}
    return {n: kc for n, kc in found.items() if n not in reasons}, reasons


def affordable(entered: Sequence[Candidate], rows: int) -> int:
    """Return the number of rows, from `LEAST_ROWS` to `rows`, to which all can be fitted in `BUDGET` seconds."""
    n = rows
    while n > LEAST_ROWS and sum(c.cost(n) * (HOPEFUL if c.tries(n) else 1.0) for c in entered) > BUDGET:
        n = max(LEAST_ROWS, int(FEWER * n))
    return n


def left_out(found: Mapping[str, Candidate], seen: Excitation) -> dict[str, str]:
    """Return the reason for each candidate of `found` that the minor loops and speeds of the record `seen` exclude."""
    reasons: dict[str, str] = {}
    for name, candidate in found.items():
        if candidate.memory in (OPENS, LATE) and seen.memory == NONE:
            reasons[name] = "the output is a function of the input"
        elif candidate.memory in (OPENS, LATE) and seen.closes and seen.gap <= CLOSED:
            reasons[name] = f"minor loops close (gap {seen.gap:.2g} % of the span of y)"
        elif candidate.memory == CLOSES and seen.memory == OPEN_LOOPS and seen.gap > LARGE:
            reasons[name] = f"minor loops stay open by {seen.gap:.2g} % of the span of y"
        elif candidate.memory == LAGS and not seen.several_speeds:
            reasons[name] = "the input has one speed only and is not informative about rate dependence"
    return reasons


def _run(
    race: Race, entered: Mapping[str, tuple[str, Candidate]], seen: Excitation, only_invertible: bool, report: "_Report"
) -> list[str]:
    """Fit the candidates `entered`, the cheapest first, until losers are known or the budget is spent.

    Return the names of the candidates that were not fitted.
    """
    untried = []
    costs = {n: c.cost(race.data.train.stop) for n, (_, c) in entered.items()}
    total = 2 * sum(costs.values())  # the further folds and the last fit are assumed to take as long as the first fold
    done = 0.0
    for name, (key, candidate) in sorted(entered.items(), key=lambda e: costs[e[0]]):
        if needless := race.repeated(key, candidate) or _needless(race, candidate, seen, only_invertible):
            race.reasons[name] = needless
            untried.append(name)
            continue
        race.first(name, key, candidate, partial(report, done / total, (done + costs[name]) / total))
        done += costs[name] * (1.0 if name in race.trials else SHORT)
    while race.trials and (late := race.late()) and not race.explained():
        spent = sum(costs[t.name] for t in late)
        if done + spent > BUDGET:
            break
        race.again(late)
        done += spent
        report(done / total)
    return untried


def _chosen(
    race: Race, fitted: Callable[[Trial], Model], rate: bool, inverses: Inverses | None, only_invertible: bool
) -> tuple[Trial | dict[str, str], Model | None]:
    """Return the best candidate and its fit to all training rows, or the faults of all candidates and None.

    The function `fitted` makes this fit; the other arguments are those of `_preferred`.
    """
    faults: dict[str, str] = {}
    while True:
        best = _preferred(race, rate, inverses, only_invertible, faults)
        if isinstance(best, dict):
            return best, None
        model = fitted(best)
        fault = inverses.fault(model) if only_invertible and inverses is not None else ""
        if not fault:
            return best, model
        faults[best.name] = fault  # the fit to all rows can have a fault that the fits to fewer rows do not have


def _misled(race: Race, best: Trial, model: Model) -> bool:
    """Return whether the rows of the comparison may not represent the record on which `model` was fitted.

    The error on all rows is then clearly larger than the error on the compared rows, as for a record whose last part is
    a fast sweep. Or another candidate follows the compared rows much better, but its fits to them differ too much.
    """
    error, least = float(model.fit["rms"]), FINE / 100 * race.data.span
    closer = min((t.whole for t in race.trials.values()), default=0.0)
    return error > least and (error > MISLED * best.square**0.5 or CLOSER * max(closer, least) < best.whole)


def _again(
    race: Race, entered: Mapping[str, tuple[str, Candidate]], rows: int
) -> tuple[dict[str, tuple[str, Candidate]], dict[str, str]]:
    """Return the candidates to compare on all `rows`, and the reasons why the others are not compared.

    They are those with an error of at most `HOPE` times the smallest one, on the blocks or on all rows that were
    compared, the cheapest first, within the budget.
    """
    reasons, spent = dict(race.reasons), 0.0
    found: dict[str, tuple[str, Candidate]] = {}
    for t in sorted(race.trials.values(), key=lambda t: t.candidate.cost(rows)):
        cost, error = t.candidate.cost(rows), min(race.risk(t), 100 * t.whole / race.data.span)
        if error <= HOPE * race.least() and (spent + cost <= BUDGET or not found):
            found[t.name] = entered[t.name]
            spent += cost
        else:
            reasons[t.name] = f"{race.risk(t):.2g} % of the span on {race.data.train.stop - race.data.train.start} rows"
    return found, reasons


class _Report:
    """Report of the progress of several fits in sequence; the reported fraction never decreases."""

    def __init__(self, progress: Progress) -> None:
        self.progress, self.told = progress, 0.0

    def __call__(self, first: float, last: float = 1.0, part: float = 0.0) -> None:
        self.told = max(self.told, min(first + (last - first) * part, last))
        self.progress(self.told)


def _preferred(
    race: Race,
    rate: bool,
    inverses: Inverses | None,
    only_invertible: bool,
    known: Mapping[str, str],
) -> Trial | dict[str, str]:
    """Return the best candidate; among equally good ones, prefer an exact inverse, then fewer parameters.

    If the record shows no rate dependence (`rate` is False), a static kind is chosen even if a rate-dependent kind has
    a smaller error. Candidates in `known` are not chosen: this dict contains the reasons why they have no useful
    inverse. If no candidate remains, the function returns all these reasons by candidate name.
    """
    follow = [t for t in race.trials.values() if race.follows(t, REFUSED) and t.name not in known]
    able = follow if rate else [t for t in follow if t.candidate.memory != LAGS] or follow
    faults = dict(known)
    while able:
        trial = _best(race, able, inverses)
        if not (only_invertible and inverses is not None and (fault := inverses.fault(trial.model))):
            return trial
        faults[trial.name] = fault
        able = [t for t in able if t is not trial] or [t for t in follow if t.name not in faults]
    return faults


def _best(race: Race, able: list[Trial], inverses: Inverses | None) -> Trial:
    least = LOSER * max(min(race.risk(t) for t in able), EXACT)
    near = [t for t in able if race.risk(t) <= least]
    near = [t for t in near if not t.leaves] or near
    best = min(near, key=race.risk)
    equal = [t for t in near if race.as_good(t, best)]
    equal = [t for t in equal if not guards.at_bounds(t.model.fit.get("warnings", ()))] or equal
    if inverses is not None:
        equal = [t for t in equal if inverses.kind(t.model) == EXACT_INVERSE] or equal
    return min(equal, key=lambda t: t.parameters)


def _needless(race: Race, candidate: Candidate, seen: Excitation, only_invertible: bool) -> str:
    """Return the reason why a candidate cannot be chosen after the fits so far, or an empty text."""
    if race.explained():
        return f"{race.best().name} has no error"
    others = [t for t in race.trials.values() if t.candidate.memory not in (LAGS, LATE)]
    if race.poor or only_invertible or not others:  # the best model so far may have no useful inverse
        return ""
    if candidate.tries(race.data.train.stop) and race.at_noise():
        return f"{race.best().name} has no error beside the noise"
    best = min(others, key=race.excess)
    if candidate.memory == LAGS and race.excess(best) <= FINE:
        return f"{best.name} has an error of at most {FINE:g} % of the span without its rate dependence"
    if candidate.memory in (OPENS, LATE) and seen.closes and race.excess(best) <= EXPLAINED * seen.gap:
        return f"{best.name} represents the gap of {seen.gap:.2g} % of the span of the minor loops"
    return ""


def _rate(race: Race, seen: Excitation) -> str:
    """Return ``seen`` if a rate-dependent kind is clearly the best, else ``not seen`` or ``one speed only``."""
    if not seen.several_speeds:
        return "one speed only"
    lags = [race.risk(t) for t in race.trials.values() if t.candidate.memory in (LAGS, LATE)]
    others = [race.risk(t) for t in race.trials.values() if t.candidate.memory not in (LAGS, LATE)]
    better = lags and min(others, default=np.inf) > max(CLEARLY * min(lags), FINE)
    return "seen" if better else "not seen"


def _warnings(best: Trial, seen: Excitation) -> list[str]:
    memory = best.candidate.memory
    if not ((memory == OPENS and seen.closes) or (memory == CLOSES and seen.memory == OPEN_LOOPS)):
        return []
    return [
        f"the best model on the validation blocks is {best.name}, but the minor loops in the data have a gap of "
        f"{seen.gap:.2g} % of the span of y ({seen.memory} memory): rate dependence, creep or drift opens the "
        "loops, or no candidate fits"
    ]


def refusal(where: str, only_invertible: bool, race: Race, seen: Excitation, faults: Mapping[str, str]) -> InputError:
    """Return an InputError for a record that no kind represents; its text lists the error of each candidate."""
    also = " and have a useful inverse" if only_invertible else ""
    rule = f"A kind of model must follow the data to {REFUSED:g} % of the span{also}"
    ranked = sorted(race.trials.values(), key=race.excess)
    behind = {name: f" ({fault.rstrip('.')})" for name, fault in faults.items()}
    errors = [f"{t.name} {race.excess(t):.3g} %{behind.get(t.name, '')}" for t in ranked]
    got = f"errors on validation blocks of {', '.join(errors)}" if errors else "no fit"
    by_reason: dict[str, list[str]] = {}
    for name, reason in race.reasons.items():
        by_reason.setdefault(reason.rstrip(".").removeprefix(f"{where}: "), []).append(name)
    others = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in by_reason.items())
    poor = f" The record is poor: {'; '.join(seen.warnings)}." if seen.warnings else ""
    remedy = "Measure a longer record"
    if errors:
        remedy = "The output depends on more than the past of this input, or no kind describes the device: measure its "
        remedy += "other inputs too"
    last = f" Discarded: {others}." if others else ""
    return InputError(f"{where}: {rule}. Got {got}.{poor} {remedy}, or name a kind to fit it anyway.{last}")
