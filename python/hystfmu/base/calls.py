"""One-line errors for wrong calls of public functions.

If a function with the decorator `checked` raises an exception, the arguments are compared with the type annotations of
the function. An argument of a wrong type raises InputError instead of the exception.

If all arguments have correct types, the exception is raised again unchanged. The arguments of a successful call are not
checked.
"""

import collections.abc as abc
import ctypes
import functools
import importlib
import inspect
import os
import types
import typing
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, TypeVar, cast

import numpy as np

from hystfmu.base.errors import InputError, meant

T = TypeVar("T", bound=Callable[..., Any])
_RAW = (TypeError, ValueError, AttributeError, KeyError, IndexError, OverflowError, ctypes.ArgumentError)
_HOMES = (  # modules that define the type names of the annotations
    "hystfmu",
    "hystfmu.graph.blocks",
    "hystfmu.identify.kinds",
    "hystfmu.identify.estimate.free",
    "hystfmu.data.reader.arrays",
    "numpy.typing",
    "collections.abc",
    "typing",
)
_LOOK = 100  # number of elements of a sequence whose type is checked
_REMEDIES = {
    "Dataset": "hy.read(path) and hy.Dataset(t, u, y) make one",
    "Model": "hy.fit and hy.Model.load make one",
    "Graph": "the graph of a model is model.graph",
}


def checked(thing: T) -> T:
    """Decorate a function, or a class with its public methods.

    The wrapper raises InputError in two cases: the call does not fit the signature, or the call fails and an argument
    has a wrong type.
    """
    if inspect.isclass(thing):
        for name, member in list(vars(thing).items()):
            if name.startswith("_") and name not in ("__init__", "__call__"):
                continue
            if inspect.isfunction(member):
                setattr(thing, name, checked(member))
            elif isinstance(member, classmethod):
                setattr(thing, name, classmethod(checked(member.__func__)))
        return thing

    @functools.wraps(thing)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return thing(*arguments, **named)
        except _RAW as e:
            if isinstance(e, InputError):
                raise
            fault = _fault(thing, arguments, named)
            if fault is None:
                raise
            raise InputError(fault) from None

    return cast(T, call)


def _fault(function: Callable[..., Any], arguments: tuple[Any, ...], named: Mapping[str, Any]) -> str | None:
    """Return an error message about the first wrong argument of a call; None if all types are correct."""
    parts = [p for p in function.__qualname__.split(".") if p not in ("<locals>", "__init__")]
    title, signature = f"{'.'.join(parts)}()", inspect.signature(function)
    bound_to = [p for p in signature.parameters if p in ("self", "cls")]
    known = [p for p in signature.parameters if p not in bound_to]
    try:
        bound = signature.bind(*arguments, **named)
    except TypeError as e:
        unknown = next((n for n in named if n not in known), None)
        hint = "" if unknown is None else meant(unknown, known)
        return f"The arguments of {title} must be {', '.join(known) or 'none'}. Got: {e}.{hint}"
    for name, value in bound.arguments.items():
        parameter = signature.parameters[name]
        if name in bound_to or parameter.kind is parameter.VAR_KEYWORD:
            continue
        hint = _resolved(function, parameter.annotation)
        values = value if parameter.kind is parameter.VAR_POSITIONAL else [value]
        for v in values:
            if not _fits(v, hint):
                return (
                    f"The {name!r} argument of {title} must be {_rule(hint)}. Got {_shown(v)} instead.{_remedy(hint)}"
                )
    return None


class _Names(dict[str, Any]):
    """Dictionary that finds types by name, for types that a module imports only for the type checker."""

    def __missing__(self, name: str) -> Any:
        for home in _HOMES:
            with suppress(AttributeError):
                return getattr(importlib.import_module(home), name)
        raise KeyError(name)


def _resolved(function: Callable[..., Any], annotation: Any) -> Any:
    """Return the type that the text of an annotation describes; Any if the type cannot be found."""
    if annotation is inspect.Parameter.empty:
        return Any
    if not isinstance(annotation, str):
        return annotation
    space = getattr(function, "__globals__", {})
    try:
        return eval(annotation, dict(space), _Names(space))  # safe: the text comes from the source of this package
    except (NameError, TypeError):
        return Any


def _fits(value: Any, hint: Any) -> bool:
    """Return whether the value agrees with the annotated type; True if this cannot be decided."""
    origin, inside = typing.get_origin(hint), typing.get_args(hint)
    if hint is Any:
        return True
    if hint is None or hint is types.NoneType:
        return value is None
    if origin is np.ndarray:
        return _is_numbers(value)
    if origin in (typing.Union, types.UnionType):
        numeric, others = _parts(inside)
        return (numeric and _is_numbers(value)) or any(_fits(value, h) for h in others)
    if origin is typing.Literal:
        return isinstance(value, (str, int, type(None))) and value in inside
    if hint in (float, int, bool):
        kinds = {float: (float, int, np.floating, np.integer), int: (int, np.integer), bool: (bool, np.bool_)}
        return isinstance(value, kinds[hint]) and (hint is bool or not isinstance(value, bool))
    if origin is abc.Callable:
        return callable(value)
    if origin is tuple:
        every = inside[-1:] == (Ellipsis,)
        if not isinstance(value, (tuple, list)) or not (every or len(value) == len(inside)):
            return False
        return every or all(map(_fits, value, inside))
    if origin in (abc.Sequence, list):
        listed = isinstance(value, (abc.Sequence, np.ndarray)) and not isinstance(value, (str, bytes))
        return listed and all(_fits(v, inside[0]) for v in list(value)[:_LOOK])
    if origin in (abc.Mapping, dict):
        return isinstance(value, abc.Mapping) and all(_fits(v, inside[1]) for v in list(value.values())[:_LOOK])
    if inspect.isclass(hint) and issubclass(hint, os.PathLike):
        return isinstance(value, os.PathLike)
    if getattr(hint, "_is_protocol", False):
        names = [n for n in vars(hint) if not n.startswith("_") or n == "__getitem__"]
        return not isinstance(value, (str, bytes)) and all(hasattr(value, name) for name in names)
    return isinstance(value, hint) if inspect.isclass(hint) else True


def _parts(inside: tuple[Any, ...]) -> tuple[bool, list[Any]]:
    """Return whether a union type contains the types of numpy's ArrayLike, and the other types of the union."""
    if not any("_SupportsArray" in str(typing.get_origin(h)) for h in inside):
        return False, list(inside)
    like = (bool, int, float, complex, str, bytes)
    return True, [h for h in inside if h not in like and not getattr(h, "__module__", "").startswith("numpy.")]


def _is_numbers(value: Any) -> bool:
    try:
        return np.asarray(value, dtype=np.float64).ndim > 0
    except (TypeError, ValueError):
        return False


def _rule(hint: Any) -> str:
    """Return the description of a type for an error message, e.g. "an array of numbers"."""
    if hint is None or hint is types.NoneType:
        return "None"
    origin, inside = typing.get_origin(hint), typing.get_args(hint)
    if origin is np.ndarray:
        return "an array of numbers"
    if origin in (typing.Union, types.UnionType):
        numeric, others = _parts(inside)
        return " or ".join(dict.fromkeys([*(["an array of numbers"] if numeric else []), *map(_rule, others)]))
    if origin is typing.Literal:
        return f"one of {', '.join(map(repr, inside))}"
    if origin is abc.Callable:
        return "a function"
    if origin in (abc.Mapping, dict):
        return f"a dict of {_rule(inside[1]).removeprefix('a ').removeprefix('an ')}"
    if origin in (abc.Sequence, list):
        return f"a list of {_rule(inside[0]).removeprefix('a ').removeprefix('an ')}"
    if origin is tuple:
        return "a tuple" if Ellipsis in inside else f"a tuple of {' and '.join(map(_rule, inside))}"
    words = {float: "a float", int: "an int", bool: "True or False", str: "a str"}
    if hint in words:
        return words[hint]
    if inspect.isclass(hint) and issubclass(hint, os.PathLike):
        return "a path"
    name = getattr(hint, "__name__", str(hint))
    return f"{'an' if name[:1] in 'AEIO' else 'a'} {name}"


def _shown(value: Any) -> str:
    if isinstance(value, (str, int, float, type(None), bool)):
        return repr(value)[:60]
    name = type(value).__name__
    return f"{'an' if name[:1] in 'aeioAEIO' else 'a'} {name}"


def _remedy(hint: Any) -> str:
    hints = typing.get_args(hint) or (hint,)
    found = [_REMEDIES[h.__name__] for h in hints if getattr(h, "__name__", "") in _REMEDIES]
    return f" {found[0][:1].upper()}{found[0][1:]}." if found else ""
