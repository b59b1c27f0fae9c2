"""Which mutants are tried: a seeded sample of each room, in proportion to the mutants of its files."""

from __future__ import annotations

import random
from pathlib import Path

from mutation import c_operators, python_operators
from mutation.mutant import Mutant

ROOMS = {
    "core": ["fmu_build/core", "fmu_build/master"],
    "fmi": ["fmu_build/fmi"],
    "scenario": ["python/hystfmu/scenario"],
    "studies": ["python/hystfmu/studies"],
    "identify": ["python/hystfmu/identify"],
}


def files(root: Path, room: str) -> list[str]:
    """Return the source files of a room, relative to the repository."""
    found = [p for folder in ROOMS[room] for p in (root / folder).rglob("*") if p.suffix in (".c", ".h", ".py")]
    return sorted(str(p.relative_to(root)) for p in found)


def mutants(root: Path, file: str) -> list[Mutant]:
    """Return all mutants of a file."""
    operators = python_operators if file.endswith(".py") else c_operators
    return operators.mutants(file, (root / file).read_text())


def sequence(root: Path, room: str, seed: int) -> list[Mutant]:
    """Return all mutants of a room in random order; the files have their share in every beginning of the list."""
    ranked = []
    for file in files(root, room):
        draw = random.Random(f"{seed} {file}")
        some = mutants(root, file)
        draw.shuffle(some)
        start = draw.random()
        ranked += [((k + start) / len(some), m) for k, m in enumerate(some)]
    return [m for _, m in sorted(ranked, key=lambda r: r[0])]
