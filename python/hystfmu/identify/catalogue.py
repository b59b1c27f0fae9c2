"""Kinds of model by key: the files of `methods`, and ``auto``.  A module loads on first use."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

from hystfmu.base.errors import InputError, MissingExtra, extras, meant
from hystfmu.identify import methods
from hystfmu.identify.candidate import Candidate
from hystfmu.identify.options import Option

AUTO = "auto"
METHODS: tuple[str, ...] = (*(module.name for module in pkgutil.iter_modules(methods.__path__)), AUTO)
REMOVED = {  # kinds of older versions: what takes their place
    "prandtl_ishlinskii_asym": "actuator or preisach",
    "prandtl_ishlinskii_rate": "actuator or preisach",
}


def method(key: str) -> ModuleType:
    """Import the module of a kind of model; it states ``TEXT`` and ``OPTIONS``.

    Raises
    ------
    InputError
        Unknown key.
    """
    if key in REMOVED:
        raise InputError(f"The model must be {REMOVED[key]}, which replace {key}. Got {key!r} instead.")
    if key not in METHODS:
        raise InputError(f"The model must be one of {', '.join(METHODS)}. Got {key!r} instead.{meant(key, METHODS)}")
    with extras(f"the model {key}"):
        module = importlib.import_module("hystfmu.identify.auto" if key == AUTO else f"{methods.__name__}.{key}")
        return module


def candidates() -> tuple[dict[str, tuple[str, Candidate]], dict[str, str]]:
    """Return the kinds that compete in ``auto``.

    Returns
    -------
    found : dict
        For each name, e.g. ``zhao_tan_mlp memory=last``, the key of the kind and its candidate.
    missing : dict
        For each kind whose packages are not installed the sentence that says so.
    """
    found, missing = {}, {}
    for key in (k for k in METHODS if k != AUTO):
        try:
            module = method(key)
        except MissingExtra as e:
            missing[key] = str(e)
            continue
        for candidate in getattr(module, "CANDIDATES", ()):
            found[candidate.named(key)] = (key, candidate)
    return found, missing


def takes_records(key: str) -> bool:
    """Return whether the method `key` fits several records, each from a fresh start; its module states ``RECORDS``."""
    return bool(getattr(method(key), "RECORDS", False))


def takes_covariates(key: str) -> bool:
    """Return whether the method `key` takes inputs beside u; its module states ``COVARIATES``."""
    return bool(getattr(method(key), "COVARIATES", False))


def description(key: str) -> str:
    """Return the line that describes the method `key`.

    Raises
    ------
    InputError
        Unknown key.
    """
    line: str = method(key).TEXT
    return line


def options(key: str) -> tuple[Option, ...]:
    """Return the options of the method `key`.

    Raises
    ------
    InputError
        Unknown key.
    """
    table: tuple[Option, ...] = method(key).OPTIONS
    return table
