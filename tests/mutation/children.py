"""Child processes without confinement while a map is made: a confined one reaches none of the files of the map."""

from collections.abc import Callable
from typing import Any


def unconfine(confined: Callable[[], bool]) -> None:
    """Start the child processes of this process without a box, except while `confined` says so."""
    from hystfmu.base.child import Child  # not before coverage.py has started

    begin = Child.__init__

    def started(made: Child, *arguments: str, box: Any = None, **more: Any) -> None:
        begin(made, *arguments, box=box if confined() else None, **more)

    Child.__init__ = started  # type: ignore[method-assign]
