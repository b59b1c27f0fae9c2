"""Names of blocks stand in Python only where a method needs that block; lists of blocks come from the C tables."""

import ast
import functools
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import hystfmu
from hystfmu.core.library import block_types

PACKAGE = Path(hystfmu.__file__).parent
EVERY = "*"
ALLOWED: dict[str, dict[str, str]] = tomllib.loads(Path(__file__).with_name("block_names.toml").read_text())


def literals(tree: ast.Module) -> Iterator[str]:
    """String literals of a module without its docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(n.body[0].value)
        for n in ast.walk(tree)
        if isinstance(n, documented) and n.body and isinstance(n.body[0], ast.Expr)
    }
    for n in ast.walk(tree):
        if isinstance(n, ast.Constant) and isinstance(n.value, str) and id(n) not in docstrings:
            yield n.value


@functools.cache
def found() -> dict[str, set[str]]:
    """Names of blocks in every file of the package, by its path."""
    names = set(block_types())
    quoted = re.compile(rf"[\"'}}]({'|'.join(names)})[\"'{{]")  # parsing takes longer
    texts = {path.relative_to(PACKAGE).as_posix(): path.read_text() for path in PACKAGE.rglob("*.py")}
    return {f: names & set(literals(ast.parse(t))) if quoted.search(t) else set() for f, t in texts.items()}


def allowed(file: str) -> dict[str, str]:
    """Names allowed in a file, by the file itself or by its folder."""
    return {**ALLOWED.get(file.rpartition("/")[0], {}), **ALLOWED.get(file, {})}


def test_a_block_name_in_python_has_a_reason():
    for file, names in found().items():
        extra = set() if EVERY in allowed(file) else names - set(allowed(file))
        assert not extra, (
            f"python/hystfmu/{file}: derive {sorted(extra)} from the C tables, or give the reason in block_names.toml"
        )


def test_no_reason_has_outlived_its_name():
    seen = found()
    for place, reasons in ALLOWED.items():
        here = set().union(*(names for file, names in seen.items() if file == place or file.startswith(f"{place}/")))
        assert here, f"{place} names no block"
        unused = set(reasons) - here - {EVERY}
        assert not unused, f"{place} does not name {sorted(unused)}: remove it in block_names.toml"


def test_a_name_in_code_is_found_and_one_in_a_docstring_is_not():
    tree = ast.parse('"""pid"""\ndef f():\n    """sum"""\n    return ["delay", f"mlp{1}"]\n')
    assert set(literals(tree)) & set(block_types()) == {"delay", "mlp"}
