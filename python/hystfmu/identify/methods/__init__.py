"""Kinds of model. A module defines one kind by ``TEXT``, ``OPTIONS`` and ``build(data, options, seed, progress)``."""
