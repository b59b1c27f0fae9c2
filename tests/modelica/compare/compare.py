"""Any model of the library that is simulated and compared: which comparison is its own."""

from collections.abc import Callable

import compare_block
import compare_implicit
import compare_operator
import library
from outcome import Outcome

COMPARISONS: tuple[tuple[Callable[[str], bool], Callable[[str], Outcome]], ...] = (
    (compare_implicit.is_implicit, compare_implicit.compare),
    (compare_operator.is_operator, compare_operator.compare),
    (compare_block.is_block, compare_block.compare),
    (compare_block.is_example, compare_block.compare_example),
)


def models() -> list[str]:
    """Every model that is compared with something."""
    return sorted(n for n in library.classes() if any(belongs(n) for belongs, _ in COMPARISONS))


def compare(name: str) -> Outcome:
    """Simulate the model `name` and compare it."""
    return next(comparison for belongs, comparison in COMPARISONS if belongs(name))(name)
