"""Group of a parameter in dialogs and in `hystfmu blocks`, from its row in the C table."""

from __future__ import annotations

import re

from hystfmu.core.library import BlockType, Var

_REST = {
    "operators": "Operator",
    "inverses": "Operator",
    "networks": "Network",
    "dynamics": "Dynamics",
    "controllers": "Controller",
    "sources": "Signal",
}
_WORDS = (  # the first that fits the beginning of the text decides
    ("Limits", r".*\b(limit|bound of|longest (step|branch)|(least|largest) (value|voltage|current|size))\b"),
    ("Adaptation", r"(standard deviations?|error of prediction|time in which|least time|farthest)\b"),
    ("Offset", r"(offset|constant term|middle of|output for)\b"),
    ("Weights", r"(hidden|output|linear)? ?(weights?|bias(es)?|coefficients|(rising|falling) u: weights)\b"),
    ("Thresholds", r"(thresholds?|half-widths?|deflections|dead zone)\b"),
    ("Gains", r"(proportional |integral |derivative |static |switching |linear |learning |output )?gains?\b"),
    ("Filters", r"(bandwidth|time constants? of the (derivative )?filter)\b"),
    (
        "Dynamics",
        r"((slower |damping ratios?|natural frequenc|time constants?|time of|duration|frequenc)|.*\bdamping\b)",
    ),
)
_LIMIT = re.compile(r"_min\Z|_max\Z|\Alo\Z|\Ahi\Z")


def group(block: BlockType, v: Var) -> str:
    """Return the group of a parameter: Start, Memory, Limits, Weights, ..., or one for the family of its block.

    Parameters
    ----------
    block : BlockType
        The block that has the parameter.
    v : Var
        A row of its table, ``param`` or ``fixed``.

    Returns
    -------
    str
        One or two words that begin with a capital letter.
    """
    if v.kind == "fixed" and (v.name == "start" or v.text.startswith("initial") or "first input" in v.text):
        return "Start"
    if v.name == "memory":
        return "Memory"
    if _LIMIT.search(v.name):
        return "Limits"
    if block.family == "sources":
        return _REST[block.family]
    return next((name for name, words in _WORDS if re.match(words, v.text)), _REST[block.family])
