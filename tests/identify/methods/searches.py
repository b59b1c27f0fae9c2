"""A stand-in for `scipy.optimize.least_squares` that notes what it is asked and answers as told."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult


@dataclass
class Call:
    """One call: function, start, bounds, other words, and the cost answered."""

    fun: Callable[[Any], Any]
    x0: Any
    bounds: Any
    words: dict[str, Any]


@dataclass
class Spy:
    """Answers the start moved by `step` and the next cost."""

    costs: Iterator[float]
    step: float = 0.0
    calls: list[Call] = field(default_factory=list)

    def __call__(self, fun, x0, jac="2-point", bounds=(-np.inf, np.inf), **words):
        x0 = np.array(x0, dtype=float)
        self.calls.append(Call(fun, x0, bounds, {**words, "jac": jac}))
        x = x0 + self.step
        r = np.asarray(fun(x))
        n = len(x)
        return OptimizeResult(x=x, cost=next(self.costs), fun=r, jac=np.ones((len(r), n)) * np.arange(1, n + 1))
