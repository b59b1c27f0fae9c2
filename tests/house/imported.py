"""Which modules of the package import which, as their files say."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "python" / "hystfmu"


def module_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(p): p for p in sorted(PACKAGE.rglob("*.py"))}


@cache
def imports(module: str) -> frozenset[str]:
    """Modules of the package that a file names in an import statement: lazy ones and those for types alone too."""
    found: set[str] = set()
    for n in ast.walk(ast.parse(MODULES[module].read_text())):
        if isinstance(n, ast.Import):
            found |= {a.name for a in n.names if a.name in MODULES}
        elif isinstance(n, ast.ImportFrom) and n.module in MODULES:
            found |= {f"{n.module}.{a.name}" if f"{n.module}.{a.name}" in MODULES else n.module for a in n.names}
    return frozenset(found - {module})


def circle(edges: dict[str, set[str]]) -> list[str]:
    """Names along a circle; empty if there is none."""
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as e:
        return list(e.args[1])
    return []
