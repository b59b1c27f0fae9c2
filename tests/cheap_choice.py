"""A choice between cheap kinds alone, for tests of what comes after it."""

import pytest

from hystfmu.identify import auto
from hystfmu.identify.catalogue import candidates


def among_cheap(patch: pytest.MonkeyPatch, seconds: float) -> None:
    """Let only candidates compete that fit 1000 rows in this time (s)."""
    kept = {name: of for name, of in candidates().items() if of[1].cost(1000) <= seconds}
    patch.setattr(auto, "candidates", lambda: kept)
