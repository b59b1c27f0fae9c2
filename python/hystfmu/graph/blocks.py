"""One Python class for each block, generated from the C tables; `dir(hystfmu.blocks)` lists the classes.

>>> import hystfmu as hy
>>> plays = hy.blocks.PrandtlIshlinskii(w0=1.0, r=[0.1, 0.3], w=[0.5, 0.2])
>>> plays([0.0, 1.0, 0.5]).round(12).tolist()
[0.0, 1.59, 0.94]
"""

from typing import Any

from numpy.typing import ArrayLike

from hystfmu.base import Array, checked
from hystfmu.core.library import BlockType, block_types
from hystfmu.graph.graph import Graph
from hystfmu.graph.node import Node, shown


@checked
class Block:
    """A single block with given sizes and parameters. A call computes its outputs for input rows, from rest."""

    type: BlockType

    def __init__(self, **values: Any) -> None:
        dims = {d.name: values.pop(d.name) for d in self.type.dims if d.name in values}
        self.node = Node(self.type.name, self.type.name, dims, values)
        self.graph = Graph.single(self.node)

    def __call__(self, u: ArrayLike, h: float = 1.0) -> Array:
        """Return the outputs, (n,) or (n, n_outputs), for input rows, (n,) or (n, n_inputs), with the step `h` (s)."""
        return self.graph.run(u, h)

    def __repr__(self) -> str:
        usual = {d.name: d.start for d in self.type.dims}
        given = {k: v for k, v in self.node.dims.items() if v != usual[k]}
        return f"{self.type.class_name}({', '.join(shown({**given, **self.node.values}))})"


def _docstring(t: BlockType) -> str:
    lines = [t.text + ".", "", f"{t.equation}", "", "Parameters", "----------"]
    lines += [f"{d.name} : int, default {d.start}\n    Size in [{d.lo}, {d.hi}]: {d.text}." for d in t.dims]
    for v in t.parameters:
        shape = "" if v.size == "1" else f", shape ({v.size})"
        unit = "" if v.unit in ("", "1") else f" Unit {v.unit}."
        lines.append(f"{v.name} : {v.interval}{shape}, default {v.start:g}\n    {v.text}.{unit}")
    for title, kind in (("Inputs", "input"), ("Outputs", "output")):
        if t.of(kind):
            lines += ["", title, "-" * len(title)]
            lines += [f"{v.name} : shape ({v.size}), {v.unit}\n    {v.text}." for v in t.of(kind)]
    return "\n".join([*lines, "", "References", "----------", t.source + "."])


_classes: dict[str, type[Block]] = {}


def __getattr__(name: str) -> type[Block]:
    if not _classes and not name.startswith("__"):
        for t in block_types().values():
            known = {"__doc__": _docstring(t), "type": t, "__module__": __name__}
            _classes[t.class_name] = type(t.class_name, (Block,), known)
    if name in _classes:
        return _classes[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(t.class_name for t in block_types().values())
