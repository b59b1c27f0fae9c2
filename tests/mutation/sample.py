"""Which mutants are tried: a seeded sample of each room, in proportion to the mutants of its files."""

import random
from collections.abc import Mapping

from mutation import c_operators, python_operators
from mutation.mutant import Mutant

ROOMS = {
    "core": ["fmu_build/core", "fmu_build/master"],
    "fmi": ["fmu_build/fmi"],
    "container": ["fmu_build/container"],
    **{room: [f"python/hystfmu/{room}"] for room in ("scenario", "studies", "identify", "inverse", "design", "start")},
    "base": ["python/hystfmu/base"],
    "reader": ["python/hystfmu/data/reader"],
}


def files(texts: Mapping[str, str], room: str) -> list[str]:
    """Return the source files of a room."""
    inside = tuple(f"{folder}/" for folder in ROOMS[room])
    return sorted(n for n in texts if n.startswith(inside) and n.endswith((".c", ".h", ".py")))


def mutants(file: str, text: str) -> list[Mutant]:
    """Return all mutants of a file."""
    operators = python_operators if file.endswith(".py") else c_operators
    return operators.mutants(file, text)


def sequence(texts: Mapping[str, str], room: str, seed: int) -> list[Mutant]:
    """Return all mutants of a room in random order; the files have their share in every beginning of the list."""
    ranked = []
    for file in files(texts, room):
        draw = random.Random(f"{seed} {file}")
        some = mutants(file, texts[file])
        draw.shuffle(some)
        start = draw.random()
        ranked += [((k + start) / len(some), m) for k, m in enumerate(some)]
    return [m for _, m in sorted(ranked, key=lambda r: r[0])]
