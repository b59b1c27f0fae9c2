"""The files of the Modelica library that follow from the C tables: base classes, package.order, Validation models.

A generated file is marked in its first line; all others are written by hand. `make generate` writes them, `make check`
fails when one is stale.
"""

from hystfmu.modelica.library.tree import generated, missing, stale, write

__all__ = ["generated", "missing", "stale", "write"]
