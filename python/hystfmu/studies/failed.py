"""Failed runs of a study to repeat: runs that failed at a limit which is now higher, or all on request."""

from __future__ import annotations

from typing import Any

from hystfmu.studies.spec import StudySpec

_LIMIT_OF = {"timeout": "timeout", "memory": "memory", "killed": "memory"}  # native code without memory crashes


def with_limits(row: dict[str, Any], spec: StudySpec) -> dict[str, Any]:
    """Return a row for storage: a failed row also states the limits under which it failed."""
    return row if row["status"] == "ok" else row | {"limits": {"timeout": spec.timeout, "memory": spec.memory}}


def is_final(row: dict[str, Any], spec: StudySpec, retry: bool) -> bool:
    """Return whether a stored row is valid for the present limits; with `retry` failed rows are not."""
    if row["status"] == "ok":
        return True
    limit = _LIMIT_OF.get(row["status"], "")
    raised = limit in row.get("limits", {}) and getattr(spec, limit) > row["limits"][limit]
    return not (retry or raised)
