"""Descriptions of the blocks from the C tables: text, JSON, documentation tables, and the type stub `blocks.pyi`."""

import json
import re
from typing import Any

from hystfmu.core.library import BlockType, Var, block_types
from hystfmu.graph.node import block_type
from hystfmu.report.terminal import table

FAMILIES = {  # families of blocks, and the group of parameters that belong to no other group
    "operators": "Operator",
    "inverses": "Operator",
    "networks": "Network",
    "dynamics": "Dynamics",
    "controllers": "Controller",
    "sources": "Signal",
}
_WORDS = (  # group and pattern; the first pattern that matches the description of a parameter selects the group
    ("Limits", r".*\b(limit|bound of|longest (step|branch)|(highest|lowest) voltage|largest current|smallest)\b"),
    ("Adaptation", r"(standard deviations?|prediction error|time in which|shortest time|largest deviation)\b"),
    ("Offset", r"(offset|constant term|mean of)\b"),
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
    """Return the name of the group to which a parameter belongs, such as Start, Memory, Limits or Weights.

    The name of the group has one or two words with a capital first letter.
    """
    if v.kind == "fixed" and (v.name == "start" or v.text.startswith("initial") or "first input" in v.text):
        return "Start"
    if v.name == "memory":
        return "Memory"
    if _LIMIT.search(v.name):
        return "Limits"
    if block.family == "sources":
        return FAMILIES[block.family]
    return next((name for name, words in _WORDS if re.match(words, v.text)), FAMILIES[block.family])


def _ports(t: BlockType) -> tuple[str, str]:
    def names(kind: str) -> str:
        return ", ".join(v.name if v.size == "1" else f"{v.name}[{v.size}]" for v in t.of(kind))

    return names("input"), names("output")


def overview() -> str:
    """Return a list of all blocks as text, with one line for each block."""
    rows = [[t.name, *_ports(t), t.text] for t in block_types().values()]
    return table(["block", "inputs", "outputs", "what it is"], rows)


def details(name: str) -> str:
    """Return the description of one block as text: equation, source, sizes, ports and parameters."""
    t = block_type(name)
    lines = [f"{t.name} ({t.class_name}): {t.text}", "", f"  {t.equation}", f"  source: {t.source}"]
    lines += [f"  family: {t.family}; rate: {t.rate}"]
    if t.inverse:
        lines += [f"  exact inverse: {t.inverse}, if {t.inverse_condition}"]
    if t.dims:
        rows = [[d.name, d.start, f"{d.lo}..{d.hi}", d.text] for d in t.dims]
        lines += ["", table(["size", "default", "range", "meaning"], rows)]
    heads = ["size", "unit of measure", "default", "range", "meaning"]
    for title in ("input", "output"):
        if t.of(title):
            lines += ["", table([title, *heads], [_row(v) for v in t.of(title)])]
    if t.parameters:
        rows = [[v.name, group(t, v), *_row(v)[1:]] for v in t.parameters]
        lines += ["", table(["parameter", "group", *heads], rows)]
    return "\n".join(lines)


def _row(v: Var) -> list[Any]:
    start = v.choices[int(v.start)] if v.choices else f"{v.start:g}"
    return [v.name, v.size, v.unit, start, v.interval, v.text]


def as_json(name: str | None = None) -> str:
    """Return the description of one block, or of all blocks, as JSON."""
    types = [block_type(name)] if name else list(block_types().values())
    return json.dumps([_data(t) for t in types], indent=1)


def _data(t: BlockType) -> dict[str, Any]:
    rows = [
        {
            k: (repr(x) if isinstance(x, float) and abs(x) == float("inf") else x)
            for k, x in vars(v).items()
            if k != "raw"
        }
        | ({"group": group(t, v)} if v.kind in ("param", "fixed") else {})
        for v in t.of("param", "fixed", "input", "output")
    ]
    dims = [vars(d) for d in t.dims]
    facts = ("name", "text", "equation", "source", "family", "rate", "inverts", "inverse", "inverse_condition")
    return {**{k: getattr(t, k) for k in facts}, "dims": dims, "variables": rows}


def markdown(heading: str = "###") -> str:
    """Return tables of all blocks in Markdown, one table for each family."""
    sections = []
    for family in FAMILIES:
        lines = [
            f"{heading} {family.capitalize()}",
            "",
            "| block | inputs | outputs | what it is |",
            "|---|---|---|---|",
        ]
        for t in block_types().values():
            if t.family == family:
                inputs, outputs = _ports(t)
                lines.append(f"| `{t.name}` | {inputs} | {outputs} | {t.text} |")
        sections.append("\n".join(lines))
    return "\n\n".join(sections)


WIDTH = 120  # maximum length of a line, as in the code formatter
_HEAD = '''# generated from the C tables by `make generate` - do not edit
"""Block classes made from the C tables."""

from collections.abc import Sequence
from typing import Any, ClassVar, Literal

from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.core.library import BlockType
from hystfmu.graph.graph import Graph
from hystfmu.graph.node import Node

class Block:
    """A single block; calling it runs it over input rows from a fresh start."""

    type: ClassVar[BlockType]
    node: Node
    graph: Graph
    def __init__(self, **values: Any) -> None: ...
    def __call__(self, u: ArrayLike, h: float = 1.0) -> Array: ...
'''


def stub() -> str:
    """Return the content of the type stub `blocks.pyi`."""
    return "\n".join([_HEAD, *map(_class, sorted(block_types().values(), key=lambda t: t.class_name))])


def _class(t: BlockType) -> str:
    rows = [f"{d.name}: int = ..." for d in t.dims] + [_parameter(v) for v in t.parameters]
    lines = [f"class {t.class_name}(Block):", f'    """{t.text}."""', ""]
    one = f"    def __init__({', '.join(['self', *(['*'] if rows else []), *rows])}) -> None: ..."
    if len(one) > WIDTH:
        one = "\n".join(["    def __init__(", *(f"        {r}," for r in ("self", "*", *rows)), "    ) -> None: ..."])
    return "\n".join([*lines, one, ""])


def _parameter(v: Var) -> str:
    if v.size != "1":
        return f"{v.name}: float | Sequence[float] | Array = {_number(v.start)}"
    if v.choices:
        words = ", ".join(f'"{c}"' for c in v.choices)
        return f'{v.name}: Literal[{words}] = "{v.choices[int(v.start)]}"'
    if v.type == "real":
        return f"{v.name}: float = {_number(v.start)}"
    return f"{v.name}: {'bool' if v.type == 'bool' else 'int'} = {bool(v.start) if v.type == 'bool' else int(v.start)}"


def _number(x: float) -> str:
    """Return a number as text, in the form of the code formatter."""
    return repr(x).replace("e+", "e")
