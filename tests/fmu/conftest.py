"""Fixtures of the FMU tests: one unpacked FMU per version and graph, a fresh instance per test."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fmu_events import Events
from fmu_master import Master, single

from hystfmu.graph import Graph
from hystfmu.model import Model


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture
def without_fmutool(monkeypatch: pytest.MonkeyPatch) -> None:
    """`validate` as without fmutool, which reads the archive only and takes longer than the trials of the binary."""
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox", None)


@pytest.fixture(params=[False, pytest.param(True, marks=pytest.mark.stress)], ids=["alone", "with fmutool"])
def fmutool_or_not(request: pytest.FixtureRequest) -> None:
    """`validate` without fmutool; the long runs repeat the test with it."""
    if not request.param:
        request.getfixturevalue("without_fmutool")


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("unpacked")


@pytest.fixture(scope="session")
def fitted() -> dict[str, Model]:
    """Fitted models by key, shared by the tests of a session."""
    return {}


@pytest.fixture
def make(folder: Path, fmi: int) -> Iterator[Callable[[Graph], Master]]:
    """Make instances of a graph; they are freed at the end of the test."""
    made: list[Master] = []

    def new(graph: Graph | None = None, interface: str = "cs") -> Master:
        graph = graph or single("prandtl_ishlinskii")
        made.append((Master if interface == "cs" else Events)(graph, folder / graph.token, fmi, interface=interface))
        assert made[-1].c.value, made[-1].messages
        return made[-1]

    yield new
    for m in made:
        m.free()
