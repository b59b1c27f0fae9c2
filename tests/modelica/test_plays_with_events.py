"""The realisation Events has an event at each reversal of its input and no other."""

import cost


def test_ten_plays_have_one_event_for_each_reversal() -> None:
    found = cost.measure("Events", repeats=1)
    assert found.reversals > 50
    assert found.events == found.reversals


def test_smooth_has_no_event() -> None:
    assert cost.measure("Smooth", repeats=1).events == 0
