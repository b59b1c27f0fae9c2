"""Keys and values of scenario files and baselines older than format 1, and their present names."""

from __future__ import annotations

from typing import Any

from hystfmu.base.toml_keys import Path

FINAL_STATES, MAX_SWEEPS = {"memory": "final_states"}, {"most_sweeps": "max_sweeps"}
EVENTS = {"hit": "located"}


def renamed_in_scenario(path: Path, value: Any) -> tuple[str, Any] | None:
    """Return the present key and value for those of a scenario file older than format 1, or None."""
    *above, key = path
    if not above and key in FINAL_STATES:
        return FINAL_STATES[key], value
    if above in (["coupling"], ["case", "coupling"]):
        if key in MAX_SWEEPS:
            return MAX_SWEEPS[key], value
        if key == "events" and isinstance(value, str) and value in EVENTS:
            return key, EVENTS[value]
    return None


def renamed_in_baseline(path: Path, value: Any) -> tuple[str, Any] | None:
    """Return the present key and value for those of a baseline older than format 1, or None."""
    return (FINAL_STATES[path[2]], value) if len(path) == 3 and path[0] == "case" and path[2] in FINAL_STATES else None
