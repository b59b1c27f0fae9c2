"""Racing of candidates over folds of validation blocks: errors without noise, plus errors in states outside the record.

Validation blocks of one record are similar, so they do not show errors of extrapolation to other states of the memory.
Differences between fits to different rows show these errors. The folds are a delete-group jackknife (Shao & Wu, Annals
of Statistics 17 (1989) 1176-1197). The standard error of the output for an input with another memory is added to the
error (root of the sum of squares).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.identify.catalogue import Candidate, Options
from hystfmu.identify.cuts import beginning, validation_rows, without_outermost
from hystfmu.identify.excitation.rest import remembered, rest
from hystfmu.identify.features.other_memory import other_memory, unseen
from hystfmu.identify.one import fit_one
from hystfmu.model import Model, guards, run_along, with_starts
from hystfmu.model.accuracy import rms

BLOCKS = 8  # long ones: where a record repeats its loops, short blocks have been seen by their neighbours
SPREAD = 2  # folds that tell a spread
FOLDS = (1, 3, 2)  # of every four blocks, the one that is held out; never the first, which alone starts from rest
AS_GOOD = 1.2  # candidates with errors up to 20 % above the least count as equally good
PART = 0.25  # of the rows: trial fit of an expensive kind without quick options
SHOWN = 0.5  # of the range of the input: else a part says nothing of the whole
LOSER, HOPE = 1.5, 4.0  # error ratios at which a candidate is dropped: after a fold, after its trial fit
EXACT = 0.002  # % of the span: errors below it count as equal
SURE = 2.0  # standard errors by which a difference must exceed what the noise of the output explains
UNCERTAIN = 4.0  # n times the relative variance of the error and of the noise on n rows: 2 for the error, and as much
OUTSIDE = 3.0  # % of the span: error of a network or of local parameters in states that no row has seen


@dataclass
class Trial:
    """A candidate in the race: an entry of the table of its kind, and its fit without the blocks of the first fold.

    `outside` is the share of the states of other signals that the training rows do not cover. `errors` (m,) contains
    the errors on the validation rows so far; `by_block` contains their RMS in each block. `others` contains, for each
    fold from the second on, the output (n,) for the input with another memory. `first` is the mean square of the errors
    after the first fold. `whole` is the RMS error over the whole training part. On fitted rows a model usually has a
    smaller error than on other rows. So a large error on fitted rows is real, also in parts without held-out blocks
    such as a sweep at the end.
    """

    name: str
    key: str
    candidate: Candidate
    model: Model
    errors: Array
    outside: float
    others: list[Array] = field(default_factory=list)
    folds: int = 1
    by_block: list[float] = field(default_factory=list)
    whole: float = 0.0
    first: float = field(init=False)

    def __post_init__(self) -> None:
        self.first = self.square

    @property
    def square(self) -> float:
        """Mean square of the errors on the validation rows so far, or on the whole record if that is larger."""
        return max(float(np.mean(self.errors**2)), self.whole**2)

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return int(self.model.fit["parameters"])

    @property
    def spread(self) -> float:
        """Standard error of the output in states outside the record (RMS); 0 after one fold only."""
        n = len(self.others)
        if n < 2:
            return 0.0
        with np.errstate(over="ignore", invalid="ignore"):
            found = (n - 1) ** 0.5 * rms(np.array(self.others) - np.mean(self.others, axis=0))
        return found if np.isfinite(found) else np.inf


class Race:
    """Folds, remaining candidates, and the reasons why others were excluded.

    A record is `poor` if it has few different reversals, such as one oscillation. Its blocks resemble the fitted rows,
    so only losers differ clearly from other candidates.
    """

    def __init__(self, data: Dataset, seed: int, poor: bool = False) -> None:
        self.data, self.seed, self.poor = data, seed, poor
        self.trials: dict[str, Trial] = {}
        self.reasons: dict[str, str] = {}
        self.sigma, self.unseen, self.rest = noise(data.y[data.train]), unseen(data), rest(data)
        u = self.data.longest().u
        self.other: Array = other_memory(u[self.data.longest().train], float(self.data.u[0]))
        kept = [self.data.u[self.held(fold)[0].counted] for fold in FOLDS]
        lo, hi = max(v.min() for v in kept), min(v.max() for v in kept)
        # beyond the range of the rows of any fold fits differ by what they extrapolate, as no fit to all rows does
        self.inside: NDArray[np.bool_] = (self.other >= lo) & (self.other <= hi)

    def held(self, fold: int) -> tuple[Dataset, NDArray[np.intp], NDArray[np.intp]]:
        """Return the data without the blocks of a fold, the counted rows of these blocks, and the block of each row."""
        data, rows = self.data, self.data.train
        held = np.zeros(len(data.u), dtype=bool)
        held[rows] = without_outermost(data.u[rows], validation_rows(data.u[rows], fold, BLOCKS))
        part = data.with_held(held)
        kept = data.u[part.counted]
        counted = np.flatnonzero(held & (data.u >= kept.min()) & (data.u <= kept.max()))
        return part, counted, np.cumsum(np.diff(held, prepend=False))[counted]

    def fitted(
        self, fold: int, key: str, options: Options, progress: Progress, share: float = 1.0
    ) -> tuple[Model, Array, list[float], float]:
        """Fit to a share of the rows outside a fold; return model, errors in the fold, RMS of blocks, RMS of all."""
        part, rows, block = self.held(fold)
        if share < 1:
            short = beginning(part, int(share * (part.train.stop - part.train.start)))
            u, whole = short.u[short.counted], part.u[part.counted]
            # a staircase may begin with a level that no kind can be fitted to
            part = short if len(u) and np.ptp(u) >= SHOWN * np.ptp(whole) else part
        model = fit_one(part, key, self.seed, progress, {**remembered(key, self.rest, part), **options})
        every = run_along(model.graph, self.data) - self.data.y
        errors = every[rows]
        return model, errors, [rms(errors[block == k]) for k in np.unique(block)], rms(every[self.data.counted])

    def trial(
        self, name: str, key: str, candidate: Candidate, options: Options, progress: Progress, share: float = 1.0
    ) -> Trial:
        """Fit a candidate without the first fold."""
        model, errors, blocks, whole = self.fitted(FOLDS[0], key, options, progress, share)
        network = 1 - float(model.fit.get("coverage_percent", 100.0)) / 100
        outside = self.unseen if candidate.local else network
        return Trial(name, key, candidate, model, errors, outside, by_block=blocks, whole=whole)

    def excess(self, trial: Trial) -> float:
        """Return the error without noise, in % of the span; it includes the error in uncovered states."""
        return self._beside_noise(trial, trial.square)

    def _beside_noise(self, trial: Trial, square: float) -> float:
        left = max(square - self.floor(), 0.0)
        return 100 * float(np.sqrt(left / self.data.span**2 + (OUTSIDE / 100 * trial.outside) ** 2))

    def risk(self, trial: Trial) -> float:
        """Return the expected error on other signals, in % of the span, from `excess` and the spread between folds."""
        return float(np.hypot(self.excess(trial), 100 * trial.spread / self.data.span))

    def best(self) -> Trial:
        """Return the candidate with the least error."""
        return min(self.trials.values(), key=self.risk)

    def floor(self) -> float:
        """Return the variance of the noise, which no model can explain.

        The result is 0 if the error of a model is clearly smaller than the estimate. Then the estimate is wrong,
        because coarse rows look like noise.
        """
        least = self.sigma**2
        for t in self.trials.values():
            square = float(np.mean(t.errors**2))
            if square < self.sigma**2 * (1 - doubt(len(t.errors))):
                return 0.0
            least = min(least, square)
        return least

    def least(self) -> float:
        """Return the least expected error so far, in % of the span."""
        return max(min((self.risk(t) for t in self.trials.values()), default=np.inf), EXACT)

    def follows(self, trial: Trial, percent: float) -> bool:
        """Return whether the error is at most `percent` of the span; a later fold may contain a different loop."""
        return min(self.excess(trial), self._beside_noise(trial, trial.first)) <= percent

    def leaves(self, trial: Trial) -> bool:
        """Return whether a model with another initial memory leaves the range of the output."""
        return guards.leaves(trial.model.graph, self.other, self.data)

    def explained(self) -> bool:
        """Return whether a model has no error; with noise always False, because the noise estimate is uncertain."""
        return any(100 * rms(t.errors) <= EXACT * self.data.span for t in self.trials.values())

    def first(self, name: str, key: str, candidate: Candidate, progress: Progress) -> None:
        """Add a candidate: a short trial fit if it has one, then a fit without the first fold."""
        try:
            if candidate.tries(self.data.train.stop) and self.trials:
                share = 1.0 if candidate.quick else PART
                # a short fit is not reported: the progress of the full one starts from 0
                options = {**candidate.options, **candidate.quick}
                short = self.excess(self.trial(name, key, candidate, options, silent, share))
                if not short <= HOPE * self.least():
                    self.reasons[name] = f"{short:.2g} % of the span after a short trial fit"
                    return
            trial = self.trial(name, key, candidate, candidate.options, progress)
        except InputError as e:
            self.reasons[name] = str(e)
            return
        rows = len(self.data.y[self.held(FOLDS[0])[0].counted])
        if trial.parameters > rows:
            self.reasons[name] = f"{trial.parameters} parameters for {rows} rows"
        elif not np.isfinite(trial.errors).all():
            self.reasons[name] = "unstable in a free run"
        else:
            self.trials[name] = trial

    def contenders(self) -> list[Trial]:
        """Return the candidates except losers, cheapest first."""
        return [t for t in self.trials.values() if self.risk(t) <= LOSER * self.least()]

    def late(self) -> list[Trial]:
        """Return the candidates to run next: candidates that are not losers and have run on the fewest folds.

        If only one candidate remains and its spread is known, no further fold is needed.
        """
        contenders = self.contenders()
        if len(contenders) == 1 and contenders[0].folds >= SPREAD:
            return []
        left = [t for t in contenders if t.folds < len(FOLDS)]
        return [t for t in left if t.folds == min(other.folds for other in left)]

    def again(self, trials: list[Trial]) -> None:
        """Let candidates run on their next fold."""
        for t in trials:
            try:
                model, more, blocks, _ = self.fitted(FOLDS[t.folds], t.key, t.candidate.options, silent)
                t.others += [self._other(m) for m in ([model] if t.others else [t.model, model])]
            except InputError:
                more, blocks = np.full(1, np.inf), []
            t.errors = np.concatenate([t.errors, more])
            t.by_block += blocks
            t.folds += 1

    def _other(self, model: Model) -> Array:
        """Return the output of a model for the input with another memory; covariates stay at their first values."""
        y = model.graph.run(with_starts(model.graph, self.other), self.data.h)
        return np.asarray(y).reshape(-1)[self.inside]

    def as_good(self, trial: Trial, best: Trial) -> bool:
        """Return whether a candidate is as good as the best one, or noise explains the difference."""
        if self.risk(trial) <= (LOSER if self.poor else AS_GOOD) * max(self.risk(best), EXACT):
            return True
        if trial.outside > best.outside or len(trial.errors) != len(best.errors):
            return False
        worse = trial.square - best.square + trial.spread**2 - best.spread**2
        by_noise = 2 * self.sigma * float(np.sqrt(np.mean((trial.errors - best.errors) ** 2) / len(best.errors)))
        return worse <= SURE * by_noise


def doubt(rows: int) -> float:
    """Return the relative difference of the variances of errors and noise that can occur by chance on few rows."""
    return SURE * float(np.sqrt(UNCERTAIN / rows))
