"""Fixtures of the searches behind G0(s): a record, and a search that finds the true dynamics."""

import numpy as np
import pytest
from behind_g0 import TRAIN, G, H

from hystfmu import Dataset
from hystfmu.identify.methods import weighted_sums


@pytest.fixture
def data():
    rng = np.random.default_rng(3)
    u = 20 + 4 * np.interp(np.arange(450), 15 * np.arange(31), rng.uniform(-1, 1, 31))
    u[420:] += 30  # behind the training rows
    y = G.filter((3 * u + np.tanh(u - 20))[:, None], H, "foh")[:, 0] + 0.01 * rng.normal(size=450)
    return Dataset(H * np.arange(450), u, y, train=TRAIN, unit_u="V", unit_y="um")


@pytest.fixture
def search(monkeypatch):
    """Replace the search of the dynamics; return what it was asked."""
    asked = []

    def found(residuals, data, options, progress, near=None):
        progress(0.5)
        asked.append((residuals, near))
        return G

    monkeypatch.setattr(weighted_sums, "search", found)
    return asked
