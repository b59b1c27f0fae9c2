"""A record and trials of candidates whose errors are given as numbers."""

from types import SimpleNamespace

import numpy as np

from hystfmu import Dataset
from hystfmu.identify.catalogue import ANY, Candidate
from hystfmu.identify.race import Trial

U = np.interp(np.arange(400), 10 * np.arange(41), np.random.default_rng(2).uniform(-1, 1, 41))
DATA = Dataset.from_signal(U, 10 * U, 1e-3)
SPAN = float(np.ptp(DATA.y))
E4 = 1e-2 * SPAN  # 1 % of the span


def trial(name="x", error=E4, n=100, memory=ANY, parameters=3, outside=0.0, others=(), leaves=False, folds=1, **more):
    model = SimpleNamespace(fit={"parameters": parameters}, graph=name)
    candidate = Candidate(memory, 1.0, 0.1, **more)
    return Trial(name, f"key of {name}", candidate, model, np.full(n, error), outside, list(others), leaves, folds)
