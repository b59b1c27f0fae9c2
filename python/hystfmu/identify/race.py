"""Comparison of candidates for ``auto`` on folds of validation blocks; candidates with large errors are stopped early.

The validation blocks of one record are similar. Therefore the errors on the blocks do not show how large the errors are
for other states of the memory. Differences between fits to different rows show this. Each fold gives one fit, and the
fits form a delete-group jackknife (Shao & Wu, Annals of Statistics 17 (1989) 1176-1197). The jackknife gives the
standard error of the output for an input with another memory. The error by which candidates are compared is the root of
the sum of two squares: the error on the blocks without noise, and this standard error. A candidate whose error is
clearly larger than the smallest one is called a loser.

The fits to a poor record, such as one oscillation, all contain the same few states of the memory. A candidate of a
wrong structure may then follow all blocks, and its fits agree with each other, although they are wrong for other
inputs. Differences between candidates show this. The outputs of the candidates for an input with another memory are
combined, row by row, to a median with weights inverse to their errors. The median is a better forecast than most of the
combined ones, and single wrong ones hardly move it (Stock & Watson, Journal of Forecasting 23 (2004) 405-430).
Therefore the distance from the median replaces the standard error.

The fits of some kinds choose their components, for example creep, on validation blocks of their own. Without a fold, a
record with few loops can lead to other components than the whole record, and the errors would then be those of another
model than the one that is chosen. Therefore such a candidate is first fitted to all rows, and all its other fits have
the components of this fit. In one oscillation, creep can also imitate a part of the hysteresis on all blocks. Then the
model without creep is a candidate of its own.
"""

from dataclasses import dataclass, field

import numpy as np

from hystfmu.base import Array, Indices, InputError, Mask, Progress, silent
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.identify.catalogue import STRUCTURE, Candidate, Options
from hystfmu.identify.cuts import beginning, validation_rows, without_outermost
from hystfmu.identify.excitation.rest import remembered, rest
from hystfmu.identify.features.other_memory import other_memory, unseen
from hystfmu.identify.one import fit_one
from hystfmu.model import Model, guards, rms, run_along, with_starts


@dataclass
class Trial:
    """A candidate and the results of its fits so far.

    `model` is the fit without the first fold. `errors` (m,) contains the errors on the rows of all folds so far, and
    `by_block` contains the RMS error on each block. `others` contains one output (n,) for each fit, for an input with
    another memory. `leaves` is whether the first of these outputs leaves the range of the record by more than the span.
    `first` is the mean square error on the first fold. `outside` is the share of the states of other signals that have
    no near training row. `whole` is the RMS error of `model` over all training rows. It is used because a large error
    on fitted rows is also an error of the candidate, for example in a sweep at the end of a record, which no block
    contains. `complete` is the fit to all rows of a candidate that chooses its components, otherwise None.
    """

    name: str
    key: str
    candidate: Candidate
    model: Model
    errors: Array
    outside: float
    others: list[Array]
    leaves: bool = False
    folds: int = 1
    by_block: list[float] = field(default_factory=list)
    whole: float = 0.0
    complete: Model | None = None
    first: float = field(init=False)

    def __post_init__(self) -> None:
        self.first = self.square

    @property
    def options(self) -> Options:
        """Options of the fits to the rows outside a fold; they keep the components of `complete`."""
        fixed = {} if self.complete is None else self.complete.fit[STRUCTURE]
        return {**self.candidate.options, **fixed}

    @property
    def square(self) -> float:
        """Mean square error on the rows of all folds so far, or on all training rows if this value is larger."""
        return max(float(np.mean(self.errors**2)), self.whole**2)

    @property
    def parameters(self) -> int:
        """Number of fitted parameters."""
        return int(self.model.fit["parameters"])

    @property
    def spread(self) -> float:
        """RMS of the standard error of the output for an input with another memory; 0 if there is only one fit."""
        n = len(self.others)
        if n < 2:
            return 0.0
        with np.errstate(over="ignore", invalid="ignore"):
            found = (n - 1) ** 0.5 * rms(np.array(self.others) - np.mean(self.others, axis=0))
        return found if np.isfinite(found) else np.inf


BLOCKS = 8  # maximum number of blocks; if a record repeats its loops, the neighbours of short blocks contain them
SPREAD = 2  # number of folds that gives a standard error
FOLDS = (1, 3, 2)  # number of the held-out block of every four blocks; never block 0, which begins at rest
AS_GOOD = 1.2  # candidates with errors up to 20 % above the smallest error count as equally good
PART = 0.25  # share of the rows for the trial fit of an expensive kind without quick options
SHOWN = 0.5  # a part of the rows must cover this share of the range of the input; otherwise all rows are used
LOSER, HOPE = 1.5, 4.0  # ratio to the smallest error above which a candidate is stopped: after a fold, after a trial
EXACT = 0.002  # error (% of the span) below which all errors count as equal
GAIN = 0.3  # error beside white noise, relative to the noise, below which no expensive candidate is fitted
SURE = 2.0  # number of standard errors of a difference that noise can explain
UNCERTAIN = 4.0  # n times the relative variance of error minus noise on n rows; error and noise contribute 2 each
OUTSIDE = 3.0  # assumed error (% of the span) of a network or of local parameters in states outside the training rows


class Race:
    """Comparison of candidates on one data set: the folds, the fitted candidates, and the reasons for exclusions.

    A record is `poor` if its reversals are not informative, as in a single oscillation.
    """

    def __init__(self, data: Dataset, seed: int, poor: bool = False) -> None:
        self.data, self.seed, self.poor = data, seed, poor
        self.trials: dict[str, Trial] = {}
        self.reasons: dict[str, str] = {}
        self._held: dict[int, tuple[Dataset, Indices, Indices]] = {}
        self.sigma, self.unseen, self.rest = noise(data.y[data.train]), unseen(data), rest(data)
        u = self.data.longest().u
        self.other: Array = other_memory(u[self.data.longest().train], float(self.data.u[0]))
        kept = [self.data.u[self.held(fold)[0].counted] for fold in FOLDS]
        lo, hi = max(v.min() for v in kept), min(v.max() for v in kept)
        # outside the range of the rows of a fold, a fit extrapolates, but the fit to all rows does not
        self.inside: Mask = (self.other >= lo) & (self.other <= hi)
        self._median: tuple[dict[str, float], Array] = {}, np.zeros(1)  # of the candidates with these weights

    def held(self, fold: int) -> tuple[Dataset, Indices, Indices]:
        """Return the data without the blocks of a fold, the rows of these blocks, and the block number of each row.

        Rows of the blocks whose input is outside the range of the remaining rows are omitted.
        """
        if fold in self._held:
            return self._held[fold]
        data, rows = self.data, self.data.train
        held = np.zeros(len(data.u), dtype=bool)
        held[rows] = without_outermost(data.u[rows], validation_rows(data.u[rows], fold, BLOCKS))
        part = data.with_held(held)
        kept = data.u[part.counted]
        counted = np.flatnonzero(held & (data.u >= kept.min()) & (data.u <= kept.max()))
        self._held[fold] = part, counted, np.cumsum(np.diff(held, prepend=False))[counted]
        return self._held[fold]

    def fitted(
        self, fold: int, key: str, options: Options, progress: Progress, share: float = 1.0
    ) -> tuple[Model, Array, list[float], float]:
        """Fit a model to the rows outside a fold, or to the first part of these rows if `share` is below 1.

        Return the model, its errors on the rows of the fold, the RMS error on each block, and the RMS error over all
        training rows.
        """
        part, rows, block = self.held(fold)
        if share < 1:
            short = beginning(part, int(share * (part.train.stop - part.train.start)))
            u, whole = short.u[short.counted], part.u[part.counted]
            # a staircase may begin with a constant input, to which no kind can be fitted
            part = short if len(u) and np.ptp(u) >= SHOWN * np.ptp(whole) else part
        model = fit_one(part, key, self.seed, progress, {**remembered(key, self.rest, part), **options})
        every = run_along(model.graph, self.data) - self.data.y
        errors = every[rows]
        # no model knows the velocity at the first row of a record
        later = np.setdiff1d(np.arange(len(every))[self.data.counted], self.data.starts)
        return model, errors, [rms(errors[block == k]) for k in np.unique(block)], rms(every[later])

    def trial(
        self, name: str, key: str, candidate: Candidate, options: Options, progress: Progress, share: float = 1.0
    ) -> Trial:
        """Fit a candidate to the rows outside the first fold, or to a share of them, and return the result."""
        model, errors, blocks, whole = self.fitted(FOLDS[0], key, options, progress, share)
        network = 1 - float(model.fit.get("coverage_percent", 100.0)) / 100
        outside = self.unseen if candidate.local else network
        other = self._other(model)
        leaves = guards.leaves(model.graph, other, self.data.y[self.data.counted], self.data.span)
        others = [other[self.inside]]
        return Trial(name, key, candidate, model, errors, outside, others, leaves, by_block=blocks, whole=whole)

    def excess(self, trial: Trial) -> float:
        """Return the RMS error of a candidate on the validation rows without the noise, in % of the span.

        An assumed error for states that have no near training row is added.
        """
        return self._beside_noise(trial, trial.square)

    def _beside_noise(self, trial: Trial, square: float) -> float:
        left = max(square - self.floor(), 0.0)
        return 100 * float(np.sqrt(left / self.data.span**2 + (OUTSIDE / 100 * trial.outside) ** 2))

    def risk(self, trial: Trial) -> float:
        """Return the expected error on other signals in % of the span, from `excess` and `uncertainty`."""
        return float(np.hypot(self.excess(trial), 100 * self.uncertainty(trial) / self.data.span))

    def uncertainty(self, trial: Trial) -> float:
        """Return the expected error of the output for an input with another memory, see the module docstring."""
        return self._distance(trial) if self.poor else trial.spread

    def _distance(self, trial: Trial) -> float:
        """Return the RMS distance of the output for an input with another memory from the median of the candidates.

        Candidates whose output leaves the range of the record, or whose error is more than `HOPE` times the smallest
        one, are not part of the median. If one candidate has half of the weights, the function returns the standard
        error.
        """
        least = EXACT / 100 * self.data.span
        sizes = {name: max(t.square**0.5, least) for name, t in self.trials.items() if not t.leaves}
        if not sizes:
            return trial.spread
        weights = {name: 1 / size for name, size in sizes.items() if size <= HOPE * min(sizes.values())}
        if 2 * max(weights.values()) >= sum(weights.values()):
            return trial.spread  # the median would be the candidate with half of the weights, and say nothing about it
        if self._median[0] != weights:
            outputs = np.array([self.trials[name].others[0] for name in weights])
            self._median = weights, _weighted_median(outputs, np.array(list(weights.values())))
        with np.errstate(over="ignore", invalid="ignore"):
            found = rms(trial.others[0] - self._median[1])
        return found if np.isfinite(found) else np.inf

    def best(self) -> Trial:
        """Return the candidate with the smallest expected error."""
        return min(self.trials.values(), key=self.risk)

    def floor(self) -> float:
        """Return the variance of the noise of the output, which is part of the error of every model.

        If the mean square error of a model is clearly smaller than the estimated variance, the estimate is wrong, and
        the result is 0. This happens with a low sampling rate, at which the signal looks like noise.
        """
        least = self.sigma**2
        for t in self.trials.values():
            square = float(np.mean(t.errors**2))
            if square < self.sigma**2 * (1 - doubt(len(t.errors))):
                return 0.0
            least = min(least, square)
        return least

    def least(self) -> float:
        """Return the smallest expected error of all candidates so far, in % of the span."""
        return max(min((self.risk(t) for t in self.trials.values()), default=np.inf), EXACT)

    def follows(self, trial: Trial, percent: float) -> bool:
        """Return whether the error on all folds so far, or on the first fold alone, is at most `percent` % of the span.

        A small error on the first fold is sufficient, because a later fold can contain a loop of another kind.
        """
        return min(self.excess(trial), self._beside_noise(trial, trial.first)) <= percent

    def explained(self) -> bool:
        """Return whether a candidate has only rounding errors on the validation rows."""
        return any(100 * rms(t.errors) <= EXACT * self.data.span for t in self.trials.values())

    def at_noise(self) -> bool:
        """Return whether the errors of a candidate on the validation rows are white noise, but for a small part.

        The products of neighbouring errors show the part of the errors that another candidate could remove. This part
        must be less than `GAIN` times the noise.
        """
        best = min(self.trials.values(), key=self.excess)
        e, square = best.errors, best.square
        part = float(np.mean(e[1:] * e[:-1])) + SURE * square / len(e) ** 0.5
        return not best.outside and part <= (GAIN * self.sigma) ** 2 and square <= (1 + GAIN**2) * self.sigma**2

    def first(self, name: str, key: str, candidate: Candidate, progress: Progress) -> None:
        """Fit a candidate to the rows outside the first fold; add it to the compared or to the excluded candidates.

        An expensive candidate is fitted only if the error of a short trial fit is not too large. A candidate that
        chooses its components is first fitted to all rows.
        """
        try:
            if candidate.tries(self.data.train.stop) and self.trials:
                share = 1.0 if candidate.quick else PART
                # the trial fit reports no progress, because the progress of the full fit begins at 0
                options = {**candidate.options, **candidate.quick}
                short = self.excess(self.trial(name, key, candidate, options, silent, share))
                if not short <= HOPE * max(min(map(self.excess, self.trials.values())), EXACT):
                    self.reasons[name] = f"{short:.2g} % of the span after a short trial fit"
                    return
            options, complete = dict(candidate.options), None
            if candidate.structured:
                given = {**remembered(key, self.rest, self.data), **options}
                complete = fit_one(self.data, key, self.seed, progress, given)
                options, progress = options | complete.fit[STRUCTURE], silent
            trial = self.trial(name, key, candidate, options, progress)
            trial.complete = complete
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

    def repeated(self, key: str, candidate: Candidate) -> str:
        """Return why a candidate asks for no other components than those that a fit of its kind chose, or "".

        Only on a poor record are components compared that the validation blocks inside the fit did not choose.
        """
        for t in self.trials.values():
            if t.key == key and t.complete is not None:
                if not self.poor:
                    return f"{t.name} has the components that the data support"
                if candidate.options.items() <= t.options.items():
                    return f"{t.name} has the same components"
        return ""

    def contenders(self) -> list[Trial]:
        """Return the candidates except losers, in the order in which they were added."""
        most = LOSER * self.least()
        return [t for t in self.trials.values() if self.risk(t) <= most]

    def late(self) -> list[Trial]:
        """Return the candidates to fit next: the candidates, except losers, with the smallest number of fits so far.

        If only one candidate remains and its standard error is known, the result is empty.
        """
        contenders = self.contenders()
        if len(contenders) == 1 and contenders[0].folds >= SPREAD:
            return []
        left = [t for t in contenders if t.folds < len(FOLDS)]
        return [t for t in left if t.folds == min(other.folds for other in left)]

    def again(self, trials: list[Trial]) -> None:
        """Fit each candidate of `trials` to the rows outside its next fold, and add the results to it."""
        for t in trials:
            try:
                model, more, blocks, _ = self.fitted(FOLDS[t.folds], t.key, t.options, silent)
                t.others.append(self._other(model)[self.inside])
            except InputError:
                more, blocks = np.full(1, np.inf), []
            t.errors = np.concatenate([t.errors, more])
            t.by_block += blocks
            t.folds += 1

    def _other(self, model: Model) -> Array:
        """Return the output of a model for an input with another memory; covariates have their start values."""
        return np.asarray(model.graph.run(with_starts(model.graph, self.other), self.data.h)).reshape(-1)

    def as_good(self, trial: Trial, best: Trial) -> bool:
        """Return whether a candidate is as good as `best`, or noise can explain the difference between their errors.

        On a poor record, a clearly larger error on the blocks is never as good: the distance from the median is no
        standard error, and a wrong candidate near the other wrong ones can have the smaller distance.
        """
        similar = self.risk(trial) <= AS_GOOD * max(self.risk(best), EXACT)
        if similar and not (self.poor and self.excess(trial) > LOSER * max(self.excess(best), EXACT)):
            return True
        if trial.outside > best.outside or len(trial.errors) != len(best.errors):
            return False
        worse = trial.square - best.square
        if not self.poor:
            worse += self.uncertainty(trial) ** 2 - self.uncertainty(best) ** 2
        by_noise = 2 * self.sigma * float(np.sqrt(np.mean((trial.errors - best.errors) ** 2) / len(best.errors)))
        return worse <= SURE * by_noise


def _weighted_median(values: Array, weights: Array) -> Array:
    """Return the median (n,) of each column of `values` (m, n), whose rows have the given weights (m,)."""
    order = np.argsort(values, axis=0)
    reached = np.cumsum(weights[order], axis=0)
    middle = np.argmax(reached >= reached[-1] / 2, axis=0)[None]
    return np.asarray(np.take_along_axis(values, np.take_along_axis(order, middle, 0), 0)[0])


def doubt(rows: int) -> float:
    """Return the largest relative difference by chance between a noise variance and its estimate from `rows` rows."""
    return SURE * float(np.sqrt(UNCERTAIN / rows))
