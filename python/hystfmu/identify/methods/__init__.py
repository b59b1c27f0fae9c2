"""Kinds of model, one per module.

A module contains the description ``TEXT``, the options ``OPTIONS``, and the function ``build(data, options, seed,
progress)``, which fits a model.
"""
