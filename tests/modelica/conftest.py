"""Fixtures of the Modelica tests."""

from collections.abc import Iterator

import pytest
import simulate


@pytest.fixture(scope="session", autouse=True)
def compiler() -> Iterator[None]:
    """The process of the compiler ends with the tests."""
    yield
    simulate.COMPILER.end()
