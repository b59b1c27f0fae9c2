"""The verdict of `hystfmu start`, for terminal, page, verdict.json and exit status."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hystfmu.base.files import write_text
from hystfmu.report import page
from hystfmu.start.closed_loop import ClosedLoop

SCHEMA: dict[str, Any] = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "title": "verdict.json of hystfmu start",
    "type": "object",
    "required": ["approved", "feedback", "controller", "step", "reasons", "references"],
    "additionalProperties": False,
    "properties": {
        "approved": {"type": "boolean", "description": "true if and only if the exit status is 0"},
        "feedback": {"enum": ["full", "slow", "none"], "description": "slow: an integrator far below the band"},
        "controller": {"type": "string", "description": "structure of the controller; none: feed-forward alone"},
        "step": {"type": ["number", "null"], "description": "step of the loop (s); null: no loop"},
        "reasons": {"type": "array", "items": {"type": "string"}},
        "references": {
            "type": "array",
            "items": {
                "type": "object",
                "required": [
                    "name", "shape", "frequency", "amplitude", "offset", "rms_percent", "bound_percent",
                    "model_percent", "reason",
                ],
                "additionalProperties": False,
                "properties": {
                    "name": {"type": "string"},
                    "shape": {"enum": ["sine", "nested", "triangle", "step", "staircase", "file"]},
                    "frequency": {"type": "number", "description": "Hz; of steps the rate of the levels"},
                    "amplitude": {"type": "number", "description": "half of peak to peak, in the unit of measure of y"},
                    "offset": {"type": "number", "description": "middle, in the unit of measure of y"},
                    "rms_percent": {
                        "type": ["number", "null"],
                        "description": "RMS error expected on the device, percent of peak to peak; null: not known",
                    },
                    "bound_percent": {"type": ["number", "null"], "description": "bound of the error; null: not known"},
                    "model_percent": {
                        "type": ["number", "null"],
                        "description": "RMS error with the fitted model as the device, including misfit and noise",
                    },
                    "reason": {"type": "string", "description": "why the error on the device is not known"},
                },
            },
        },
    },
}  # fmt: skip


def verdict(loop: ClosedLoop | str) -> dict[str, Any]:
    """Return the verdict as described by `SCHEMA`.

    Parameters
    ----------
    loop : ClosedLoop or str
        The loop, or the reason why there is none.
    """
    if isinstance(loop, str):
        return {
            "approved": False,
            "feedback": "none",
            "controller": "none",
            "step": None,
            "reasons": [f"no loop: {loop}"],
            "references": [],
        }
    failed = [line for r in loop.results for line in r.failures()]
    return {
        "approved": loop.approved,
        "feedback": loop.feedback,
        "controller": loop.tuned.structure.name if loop.tuned else "none",
        "step": loop.device.h,
        "reasons": [*loop.misfitted, *failed, *loop.margins.broken(), *loop.reasons],
        "references": [
            {
                "name": p.name,
                "shape": p.shape,
                "frequency": p.frequency,
                "amplitude": p.amplitude,
                "offset": p.offset,
                "rms_percent": p.rms_percent,
                "bound_percent": p.bound_percent,
                "model_percent": p.model_percent if p.model_percent < float("inf") else None,
                "reason": p.why,
            }
            for p in loop.promises
        ],
    }


def sentence(told: dict[str, Any]) -> str:
    """State the verdict in one line."""
    word = "approved" if told["approved"] else "not approved"
    with_ = {"full": "feedback", "slow": "slow feedback", "none": "no feedback"}[told["feedback"]]
    why = f": {told['reasons'][0]}" if not told["approved"] and told["reasons"] else ""
    return f"verdict: {word}, {with_}{why}"


def percent(value: float | None) -> str:
    """Return an error in percent with three digits as text; for None the text "not known"."""
    return "not known" if value is None else page.percent(value)


def write_verdict(folder: Path, told: dict[str, Any]) -> Path:
    """Write verdict.json; return its path."""
    path = folder / "verdict.json"
    write_text(path, json.dumps(told, indent=1) + "\n")
    return path
