"""Rooms of the package: imports form no circle, and folders stay small."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest
from house.imported import MODULES, PACKAGE, circle, imports

ROOT = Path(__file__).parents[2]
MOST_AT_ROOT, MOST_IN_FOLDER = 22, 20
NOT_SOURCES = {"__pycache__", "_platforms", "_scenarios"}


def room(module: str) -> str:
    return ".".join(module.split(".")[:2])


@pytest.mark.turn("imports")
def test_modules_import_without_a_circle():
    edges = {m: set(imports(m)) for m in MODULES}
    assert not circle(edges), f"imports form a circle: {' -> '.join(circle(edges))}"


def test_rooms_import_without_a_circle():
    edges: dict[str, set[str]] = defaultdict(set)
    for m in MODULES:
        edges[room(m)] |= {room(other) for other in imports(m)} - {room(m)}
    assert not circle(edges), f"rooms form a circle: {' -> '.join(circle(edges))}"


@pytest.mark.parametrize("parent", ["fmu", "identify", "scenario"])
def test_rooms_within_a_room_import_without_a_circle(parent: str):
    """Its folders against each other; the modules beside them stand above."""
    edges: dict[str, set[str]] = defaultdict(set)
    folders = {f"hystfmu.{parent}.{d.name}" for d in (PACKAGE / parent).iterdir() if (d / "__init__.py").exists()}

    def folder(module: str) -> str:
        return ".".join(module.split(".")[:3])

    for m in MODULES:
        if folder(m) in folders:
            edges[folder(m)] |= {folder(other) for other in imports(m)} & folders - {folder(m)}
    assert len(edges) == len(folders) >= 3
    assert not circle(edges), f"folders of {parent} form a circle: {' -> '.join(circle(edges))}"


def test_a_circle_is_found():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) in (["b", "c", "b"], ["c", "b", "c"])
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def listed(folder: Path) -> list[str]:
    """Entries that belong to the source: no caches, no products of the build."""
    products = {".so", ".dll", ".dylib"}
    return [
        p.name
        for p in folder.iterdir()
        if p.name not in NOT_SOURCES | {"_sources.c", "LICENSE"} and p.suffix not in products
    ]


def test_the_root_holds_rooms_and_the_face_alone():
    names = listed(PACKAGE)
    assert len(names) <= MOST_AT_ROOT, sorted(names)
    loose = {n for n in names if not (PACKAGE / n).is_dir()}
    assert loose <= {"__init__.py", "py.typed", "unit.py"}, f"modules loose at the root: {sorted(loose)}"


@pytest.mark.parametrize("top", ["python", "fmu_build", "tests"])
def test_no_folder_is_a_heap(top: str):
    folders = [d for d in (ROOT / top).rglob("*") if d.is_dir() and "__pycache__" not in d.parts]
    for folder in [ROOT / top, *folders]:
        files = [n for n in listed(folder) if n.endswith((".py", ".pyi", ".c", ".h"))]
        assert len(files) <= MOST_IN_FOLDER, f"{folder.relative_to(ROOT)} has {len(files)} files: make rooms"


def test_scripts_of_scenarios_import_no_private_name():
    """What they write, a user can write: with the names that the package shows."""
    scripts = sorted((ROOT / "scenarios").rglob("*.py"))
    assert len(scripts) >= 4
    for path in scripts:
        for n in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in n.names] if isinstance(n, (ast.Import, ast.ImportFrom)) else []
            names += [n.module or ""] if isinstance(n, ast.ImportFrom) else []
            private = [
                part for name in names for part in name.split(".") if part.startswith("_") and part != "__future__"
            ]
            assert not private, f"{path.relative_to(ROOT)} imports {private}"
