"""Fixtures of the choice between candidates: a race without noise."""

import pytest
from trials import DATA

from hystfmu.identify import race as module
from hystfmu.identify.race import Race


@pytest.fixture
def race(monkeypatch):
    monkeypatch.setattr(module, "unseen", lambda data: 0.25)
    made = Race(DATA, 7)
    made.sigma = 0.0
    return made
