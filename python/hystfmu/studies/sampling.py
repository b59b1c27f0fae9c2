"""Which variations a study runs: a grid, Sobol points, a Latin hypercube, or what Optuna asks for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from hystfmu.base.errors import InputError
from hystfmu.studies.spec import MOST_ROWS, Study


class Sampler(Protocol):
    """Proposes variations in batches; some want to know how the last batch went."""

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """Variations `{"unit.parameter": value}`; the next batch is asked for when all of the last one are done."""

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """The rows (one per case) of every variation of the last batch, in its order."""

    @property
    def n(self) -> int:
        """Number of variations in all."""


class Fixed:
    """All variations are known at once."""

    def __init__(self, variations: list[dict[str, float]]) -> None:
        self._variations = variations

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """One batch."""
        yield self._variations

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """Nothing to learn."""

    @property
    def n(self) -> int:
        """Number of variations."""
        return len(self._variations)


class Asked:
    """Optuna's sampler (TPE), seeded.  Batches have a fixed size, so that the number of workers changes nothing.

    A resumed study asks the same questions and finds the answers in the table: the way is the same as without the
    interruption.
    """

    BATCH = 8

    def __init__(self, study: Study) -> None:
        try:
            import optuna
        except ImportError:
            raise InputError("method 'optuna' needs the extra 'study': pip install 'hystfmu[study]'") from None
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._study, self._optuna, self._trials = study, optuna, []  # type: ignore[var-annotated]
        objective = study.spec.objective
        assert objective is not None
        self._objective = objective
        sampler = optuna.samplers.TPESampler(seed=study.spec.seed)
        self._asker = optuna.create_study(direction="minimize", sampler=sampler)

    @property
    def n(self) -> int:
        """Number of variations."""
        return self._study.spec.n

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """Batches of at most BATCH."""
        left = self.n
        while left:
            self._trials = [self._asker.ask() for _ in range(min(self.BATCH, left))]
            left -= len(self._trials)
            yield [self._ask(t) for t in self._trials]

    def _ask(self, trial: Any) -> dict[str, float]:
        values = {}
        for name, p in self._study.parameters.items():
            if p.values is not None:
                values[name] = float(trial.suggest_categorical(name, p.values))
            else:
                values[name] = float(trial.suggest_float(name, *p.bounds, log=p.log))
        return values

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """A variation with a failed case is a failed trial; limits that are exceeded make it infeasible."""
        for trial, cases in zip(self._trials, rows, strict=True):
            for m, limit in self._objective.limits.items():
                trial.set_constraint(m, max(row["metrics"].get(m, math.inf) - limit for row in cases))
            value = self._objective.score(cases)
            if math.isfinite(value):
                self._asker.tell(trial, value)
            else:
                self._asker.tell(trial, state=self._optuna.trial.TrialState.FAIL)


def sampler(study: Study) -> Sampler:
    """The sampler that a study asks for.

    Raises
    ------
    InputError
        More rows than a table may have; Optuna is not installed.
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
        if math.prod(len(a) for a in axes) > MOST_ROWS:
            raise InputError(f"{study.file}: the grid has more than {MOST_ROWS} points")
        return Fixed([dict(zip(names, point, strict=True)) for point in itertools.product(*axes)])
    from scipy.stats import qmc

    if spec.method == "sobol":
        engine: Any = qmc.Sobol(len(names), seed=spec.seed)
        points = engine.random_base2(math.ceil(math.log2(spec.n)))[: spec.n]
    else:
        points = qmc.LatinHypercube(len(names), seed=spec.seed).random(spec.n)
    return Fixed([{k: p.at(float(f)) for k, p, f in zip(names, parameters, point, strict=True)} for point in points])
