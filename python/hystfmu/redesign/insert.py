"""Insert a repetitive controller into the table of a scenario.

The command is the output of the controllers plus the correction w. The correction w is computed from the errors one
period ago. The output of the block `repetitive` is the sum of w and the reference, so the reference is subtracted. If
the command exceeds a limit between controller and plant, learning stops for some periods. Otherwise the corrections
would wind up.
"""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

from hystfmu.base import InputError
from hystfmu.design.repetitive import RepetitiveFilters
from hystfmu.redesign.corners import Limit, Roles

UNIT, SUM, WITHIN = "repetitive", "with_repetitive", "within"
# time constant (periods) for which a reached limit stops the learning; threshold, as a fraction of one step
MEMORY, SHARE = 2.0, 0.1
COUNTED = 1  # number of periods at the end of a run over which the metrics are computed


def _unit(n: int, taps: RepetitiveFilters, text: str, always: bool) -> dict[str, Any]:
    """Return the block `repetitive` with a period of n steps, as a unit of a scenario file.

    If `always` is True, the unit always learns. If it is False, the unit learns only while a connected signal permits
    it.
    """
    dims = {"n": n, "n_q": len(taps.q) - 1, "n_l": len(taps.l) // 2}
    values = {"q": taps.q.tolist(), "l": taps.l.tolist()}
    inputs = {"inputs": {"active": 1.0}} if always else {}
    return {"block": "repetitive", "dims": dims, "values": values, "text": text, **inputs}


def with_repetitive(table: Mapping[str, Any], of: Roles, n: int, taps: RepetitiveFilters, text: str) -> dict[str, Any]:
    """Return a copy of the scenario's table that has a block `repetitive` and a sum of its output and the command.

    `roles` names the signals of the loop. `taps` has the dimensions and parameters of the block, and `text` describes
    the block.

    An InputError is raised if a unit already has the name of the block or of the sum.
    """
    made = copy.deepcopy(dict(table))
    for name in (UNIT, SUM, WITHIN):
        if any(name in t.get("units", {}) for t in (made, *made.get("case", ()))):
            raise InputError(
                f"{made['name']}: units: The name {name} must be free for the repetitive part. Got a unit."
            )
    limits = of.limits
    made["units"][UNIT] = _unit(n, taps, text, not limits)
    made["units"][SUM] = {
        "block": "sum",
        "dims": {"n": 3},
        "values": {"k": [1.0, 1.0, -1.0]},
        "text": "command of the controllers plus correction of the repetitive part",
    }
    made["connections"] |= {
        f"{UNIT}.y_d": of.reference,
        f"{UNIT}.y": of.measured,
        f"{SUM}.u_2": f"{UNIT}.r",
        f"{SUM}.u_3": of.reference,
        f"{SUM}.u_1": of.driver,
        of.command: f"{SUM}.y",
    }
    if limits:
        made["units"][WITHIN] = _within(limits, n, float(made["step"]))
        made["connections"][f"{UNIT}.active"] = f"{WITHIN}.y"
        for k, limit in enumerate(limits, 1):
            made["connections"][f"{WITHIN}.u_{k}"] = limit.signal or f"{SUM}.y"
    reader = of.command.partition(".")[0]
    for t in (made, *made.get("case", ())):
        if "order" in t:
            at = t["order"].index(reader)
            t["order"] = [*t["order"][:at], *([WITHIN] if limits else []), UNIT, SUM, *t["order"][at:]]
        if limits and t is not made:
            t["set"] = t.get("set", {}) | _changed(limits, t.get("set", {}))
        if t is not made and of.command in t.get("connections", {}):
            t["connections"][f"{SUM}.u_1"] = t["connections"].pop(of.command)
    return made


def _within(limits: Sequence[Limit], n: int, h: float) -> dict[str, Any]:
    """Return a unit whose output is 1 if all limited signals stayed within `limits` during the last periods.

    A period has n steps of h (s).

    Trap: if learning ignores the error in only a part of each period, an integrator does not remove the mean error, and
    the corrections wind up. Therefore learning ignores the whole period if a limit is reached in it.
    """
    ends = [v.ends({}) for v in limits]
    values = {"lo": [low for low, _ in ends], "hi": [high for _, high in ends]}
    places = [f"range.u[{k + 1}]" if len(limits) > 1 else "range.u" for k in range(len(limits))]
    lag = {"b": [1.0], "a": [MEMORY * n * h, 1.0], "start": "steady"}
    graph = {
        "blocks": [
            *({"name": f"last_{k + 1}", "type": "delay", "dims": {"n": 1}} for k in range(len(limits))),
            {"name": "range", "type": "in_range", "dims": {"n": len(limits)}, "values": values},
            {"name": "lately", "type": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": lag},
            {"name": "calm", "type": "in_range", "values": {"lo": [1 - SHARE / (MEMORY * n)], "hi": [2.0]}},
        ],
        "wires": [
            *([f"last_{k + 1}.y", place] for k, place in enumerate(places)),
            ["range.y", "lately.u"],
            ["lately.y", "calm.u"],
        ],
        "inputs": [{"name": f"u_{k + 1}", "to": [f"last_{k + 1}.u"]} for k in range(len(limits))],
        "outputs": [{"name": "y", "source": "calm.y"}],
    }
    text = "1 if the commands of the last periods stayed within their limits; otherwise nothing is learnt"
    return {"graph": graph, "text": text}


def _changed(limits: Sequence[Limit], said: Mapping[str, Any]) -> dict[str, Any]:
    """Return the limits of the unit of `_within` for a case that sets other limits in its key `set`."""
    if not any(key in said for v in limits for key in v.keys):
        return {}
    ends = [v.ends(said) for v in limits]
    return {f"{WITHIN}.range_lo": [low for low, _ in ends], f"{WITHIN}.range_hi": [high for _, high in ends]}


def repeating(
    table: Mapping[str, Any], cases: Sequence[str], sources: Sequence[str], n: int, periods: int
) -> dict[str, Any]:
    """Return the table of a scenario with only the given cases, for a reference with a period of n steps.

    `sources` are the units that produce the reference. A run has `periods` periods. Metrics are computed over the last
    period.
    """
    made = copy.deepcopy(dict(table))
    h = float(made["step"])
    kept = [c for c in made.get("case", [{"name": "nominal"}]) if c["name"] in cases]
    for c in kept:
        c["stop"] = float(f"{periods * n * h:.12g}")
        c["after"] = float(f"{(periods - COUNTED) * n * h:.12g}")
        c["set"] = c.get("set", {}) | {f"{unit}.frequency": 1 / (n * h) for unit in sources}
    made["case"] = kept
    if "margins" in made:
        made["margins"] = _limits(made["margins"], cases)
    return made


def _limits(margins: dict[str, Any], cases: Sequence[str]) -> dict[str, Any]:
    """Return the table `[margins]` for the remaining cases."""
    return {k: v for k, v in margins.items() if k != "case" or v in cases}
