"""`blocks.pyi`: the signatures of the block classes for editors and type checkers, from the C tables."""

from __future__ import annotations

from hystfmu.core.library import BlockType, Var, block_types

WIDTH = 120  # of a line, as the formatter has it
_HEAD = '''# generated from the C tables by `make generate` - do not edit
"""Block classes made from the C tables."""

from collections.abc import Sequence
from typing import Any, ClassVar, Literal

from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.core.library import BlockType
from hystfmu.graph.graph import Graph, Node

class Block:
    """A single block; calling it runs it over input rows from a fresh start."""

    type: ClassVar[BlockType]
    node: Node
    graph: Graph
    def __init__(self, **values: Any) -> None: ...
    def __call__(self, u: ArrayLike, h: float = 1.0) -> Array: ...
'''


def stub() -> str:
    """Write the text of `blocks.pyi`."""
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
    """Write a number as the formatter does."""
    return repr(x).replace("e+", "e")
