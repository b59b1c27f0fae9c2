"""The kinds of model, one a file: a table ``OPTIONS`` and a function ``build(data, options, seed, progress)``."""
