"""The folder of the package; the build puts libraries, C source, licence and scenarios into it."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).parents[1]
