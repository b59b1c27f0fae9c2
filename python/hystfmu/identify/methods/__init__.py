"""Kinds of model, one per file: a line ``TEXT``, a table ``OPTIONS``, ``build(data, options, seed, progress)``."""
