"""Numbers on a page: three digits, and a floor for errors in percent."""

from __future__ import annotations

FLOOR = 0.001  # percent


def percent(value: float) -> str:
    """Return an error in percent."""
    return f"< {FLOOR}" if abs(value) < FLOOR else f"{value:.3g}"


def figure_of(value: float, kind: str) -> str:
    """Return the value of a metric of this kind."""
    return percent(value) if kind.endswith("_percent") else f"{value:.3g}"
