"""Conditions that no call of the public functions can show to decide, each with the reason: (file, what, words of the
line) -> why.  test_mcdc.py fails at an uncovered condition that is not here, and at a line here that is covered."""

UNREACHABLE: dict[tuple[str, str, str], str] = {}
