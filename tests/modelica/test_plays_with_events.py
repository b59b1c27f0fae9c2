"""The realisation Events has an event at each reversal of its input and no other."""

from __future__ import annotations

from pathlib import Path

import cost


def test_ten_plays_have_one_event_for_each_reversal(tmp_path: Path) -> None:
    found = cost.measure("Events", tmp_path, repeats=1)
    assert found.reversals > 50
    assert found.events == found.reversals


def test_smooth_has_no_event(tmp_path: Path) -> None:
    assert cost.measure("Smooth", tmp_path, repeats=1).events == 0
