"""Count what there is to read, by room: files, code lines, the same without imports, median, longest, share of imports.

Code lines hold neither comment nor docstring alone. `make lines`; another checkout is counted by its path.
"""

import ast
import io
import statistics
import sys
import tokenize
from collections.abc import Iterable
from pathlib import Path

SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def counted(path: Path) -> tuple[int, int]:
    """Code lines of a Python file, and those of its imports."""
    text = path.read_text(encoding="utf-8")
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    code = {k for t in tokens if t.type not in SILENT for k in range(t.start[0], t.end[0] + 1)}
    imported: set[int] = set()
    for n in ast.walk(ast.parse(text)):
        if isinstance(n, DOCUMENTED) and n.body and isinstance(n.body[0], ast.Expr):
            if isinstance(getattr(n.body[0].value, "value", None), str):
                code -= set(range(n.body[0].lineno, (n.body[0].end_lineno or 0) + 1))
        elif isinstance(n, (ast.Import, ast.ImportFrom)):
            imported |= set(range(n.lineno, (n.end_lineno or 0) + 1))
    return len(code), len(code & imported)


def row(name: str, files: Iterable[Path]) -> str:
    """One line of the table."""
    counts = [counted(f) for f in files]
    code = [n for n, _ in counts] or [0]
    bare = sum(code) - sum(n for _, n in counts)
    share = 100 * (1 - bare / max(sum(code), 1))
    return f"{name:22}{len(counts):6}{sum(code):8}{bare:8}{statistics.median(code):8g}{max(code):9}{share:9.1f}"


def main(root: Path) -> None:
    package, built = root / "python/hystfmu", root / "fmu_build"
    rooms = sorted({f.parent for f in package.glob("*/*.py")})
    print(f"{'room':22}{'files':>6}{'code':>8}{'bare':>8}{'median':>8}{'longest':>9}{'import %':>9}")
    for room in rooms:
        print(row(room.name, room.rglob("*.py")))
    print(row("package", package.rglob("*.py")))
    left = [root / "scenarios/papers", root / "modelica/generator"]  # parts of the package once
    for folder in left:
        print(row(str(folder.relative_to(root)), folder.rglob("*.py")))
    print(row("package and these", [f for folder in (package, *left) for f in folder.rglob("*.py")]))
    print(row("tests", (root / "tests").rglob("*.py")))
    folders = {f.relative_to(built).parts[0] for f in built.rglob("*.[ch]")}
    for name, files in (("fmu_build, C", built.rglob("*.[ch]")), ("scenarios, TOML", root.glob("scenarios/**/*.toml"))):
        print(f"{name:28}{sum(len(f.read_text().splitlines()) for f in files):8}")
    print(f"rooms: {len(rooms)} of the package, {len(folders)} folders of fmu_build")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1])
