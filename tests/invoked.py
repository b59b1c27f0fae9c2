"""Commands that a test runs in its own process."""

from collections.abc import Sequence
from typing import Any

from click.testing import CliRunner, Result

from hystfmu.cli import main


def invoked(words: str | Sequence[str], status: int = 0, **options: Any) -> Result:
    """Run a command, which must end with this exit status; `options` are those of click."""
    result = CliRunner().invoke(main, words, **options)
    assert result.exit_code == status, f"{result.output}{result.exception!r}"
    return result
