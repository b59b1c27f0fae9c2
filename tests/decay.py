"""A scenario of a first-order lag whose response is known in closed form."""

from typing import Any

LAG: dict[str, Any] = {
    "name": "decay",
    "step": 1e-2,
    "stop": 1.0,
    "order": ["lag", "command"],
    "units": {
        "lag": {
            "block": "transfer_function",
            "dims": {"na": 1, "nb": 0},
            "values": {"b": [1.0], "a": [0.5, 1.0], "hold": "zoh"},
        },
        "command": {"block": "disturbance", "values": {"step": 2.0, "amplitude": 0.0}},
    },
    "connections": {"lag.u": "command.d"},
    "metrics": {"last": {"kind": "final", "signal": "lag.y"}, "peak": {"kind": "peak", "signal": "command.d"}},
    "case": [{"name": "one"}, {"name": "half", "stop": 0.5}],
}
