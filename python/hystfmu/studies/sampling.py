"""Choose the variations of a study: grid, random values, Sobol points, Latin hypercube, or Optuna."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import extras
from hystfmu.studies.spec import Study
from hystfmu.studies.task import LoopLimits


class Fixed:
    """A fixed list of `n` variations, which are proposed in one batch. Another sampler overrides the methods."""

    def __init__(self, variations: list[dict[str, float]], n: int | None = None) -> None:
        self._variations, self.n = variations, len(variations) if n is None else n

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """Yield batches of variations `{"unit.parameter": value}`. The runs of a batch end before the next batch."""
        yield self._variations

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """Receive the rows of the last batch, in the order of its variations, with one row per case."""

    def outside(self, k: int) -> str:
        """Return the limits that variation k of the last batch exceeds, as far as they are known without a simulation.

        The limits are returned as text. The variation is simulated only if this text is empty.
        """
        return ""


class Asked(Fixed):
    """Optuna's TPE sampler with a fixed seed and batch size. The number of workers does not change the variations.

    A resumed study proposes the same variations, and finds their rows in the table. Therefore an interruption does not
    change the result.
    """

    BATCH = 8

    def __init__(self, study: Study) -> None:
        with extras("the method 'optuna'"):
            import optuna
        super().__init__([], study.spec.n)
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._study, self._optuna, self._trials = study, optuna, []  # type: ignore[var-annotated]
        objective = study.spec.objective
        assert objective is not None
        self._objective = objective
        self._loop = LoopLimits(study, objective.loop) if objective.loop else None
        self._excess: list[dict[str, float]] = []
        sampler = optuna.samplers.TPESampler(seed=study.seed)
        self._asker = optuna.create_study(direction="minimize", sampler=sampler)
        if study.spec.start:
            self._asker.enqueue_trial(dict(study.spec.start))

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """Yield batches of at most `BATCH` variations."""
        left = self.n
        while left:
            self._trials = [self._asker.ask() for _ in range(min(self.BATCH, left))]
            left -= len(self._trials)
            batch = [self._ask(t) for t in self._trials]
            self._excess = [self._loop.excess(self._study.settings(v)) if self._loop else {} for v in batch]
            yield batch

    def outside(self, k: int) -> str:
        """Return the limits of the linearised loop that variation k exceeds. No simulation is needed to know them."""
        return ", ".join(name for name, excess in self._excess[k].items() if excess > 0)

    def _ask(self, trial: Any) -> dict[str, float]:
        values = {}
        for name, p in self._study.parameters.items():
            if p.values is not None:
                values[name] = float(trial.suggest_categorical(name, p.values))
            else:
                values[name] = float(trial.suggest_float(name, *p.bounds, log=p.log))
        return values

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """Report the results to Optuna.

        A variation with a failed run is a failed trial. A variation that exceeds a limit is an infeasible trial.
        """
        for trial, cases, excess in zip(self._trials, rows, self._excess, strict=True):
            for name, value in excess.items():
                trial.set_constraint(name, value)
            if any(value > 0 for value in excess.values()):
                self._asker.tell(trial, state=self._optuna.trial.TrialState.PRUNED)
                continue
            for m, limit in self._objective.limits.items():
                trial.set_constraint(m, max(row["metrics"].get(m, math.inf) - limit for row in cases))
            value = self._objective.score(cases)
            if math.isfinite(value):
                self._asker.tell(trial, value)
            else:
                self._asker.tell(trial, state=self._optuna.trial.TrialState.FAIL)


def sampler(study: Study) -> Fixed:
    """Create the sampler of a study.

    A MissingExtra is raised if the method needs Optuna and Optuna is not installed.
    """
    spec = study.spec
    if spec.method == "optuna":
        return Asked(study)
    names, parameters = list(study.parameters), list(study.parameters.values())
    if spec.method == "grid":
        axes = [
            p.values if p.values is not None else [p.at(k / max(p.steps - 1, 1)) for k in range(p.steps)]
            for p in parameters
        ]
        return Fixed([dict(zip(names, point, strict=True)) for point in itertools.product(*axes)])
    if spec.method == "random":
        return _at(study, np.random.default_rng(study.seed).random((spec.n, len(names))))
    from scipy.stats import qmc

    if spec.method == "sobol":
        engine: Any = qmc.Sobol(len(names), seed=study.seed)
        points = engine.random_base2(math.ceil(math.log2(spec.n)))[: spec.n]
    else:
        points = qmc.LatinHypercube(len(names), seed=study.seed).random(spec.n)
    return _at(study, points)


def _at(study: Study, points: Array) -> Fixed:
    """Return the variations for points in the unit cube, shape (n, parameters)."""
    parameters = study.parameters.items()
    return Fixed([{k: p.at(float(f)) for (k, p), f in zip(parameters, point, strict=True)} for point in points])
