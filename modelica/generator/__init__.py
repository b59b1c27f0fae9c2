"""Generation of files of the Modelica library from the C tables: base classes, package.order, Validation models.

The first line of a generated file is a mark; all other files are written by hand. `make generate` writes the generated
files. `make check` fails if a generated file is stale.
"""

from generator.tree import generated, missing, stale, write

__all__ = ["generated", "missing", "stale", "write"]
