"""Where the package keeps what the build puts beside its Python files: libraries, C source, licence, scenarios."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).parents[1]
