"""What fits the annotation of an argument, and what a message says of a value that does not."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from hystfmu.base.calls import checked
from hystfmu.base.errors import InputError


class Named(Protocol):
    """Two names, one of which begins with underscores."""

    @property
    def names(self) -> Any: ...

    def __getitem__(self, key: Any, /) -> Any: ...


class Half:
    """One of the two."""

    names = ()


class Whole(Half):
    """Both."""

    def __getitem__(self, key: Any, /) -> Any:
        return key


MANY = [0] * 99  # a hundred elements are looked at
NUMBERS = "an array of numbers"
HINTS: list[tuple[Any, list[Any], list[Any], str]] = [  # annotation, what fits, what does not, the rule
    (int, [1, np.int64(1)], ["a", 1.5, None, True], "an int"),
    (float, [1, 1.5, np.float64(1)], ["x" * 99, ()], "a float"),
    (bool, [True], ["x"], "True or False"),
    (str, ["a"], [1, b"a"], "a str"),
    (None, [None], [0], "None"),
    (int | None, [1, None], ["x"], "an int or None"),
    (Literal["a", "b"], ["a", "b"], ["c", []], "one of 'a', 'b'"),
    (Callable[[], int], [len, int], [3], "a function"),
    (Sequence[int], [[1], (1,), np.array([1]), [*MANY, 0, "x"]], ["ab", b"", 5, [*MANY, "x"]], "a list of int"),
    (Mapping[str, int], [{}, {"a": 1}], [5, {"a": 1, "b": "x"}], "a dict of int"),
    (tuple[int, str], [(1, "a"), [1, "a"]], [(1,), (1, 2), ("a", "b"), 5], "a tuple of an int and a str"),
    (tuple[int, ...], [(), (1, 2)], [5, "ab"], "a tuple"),
    (str | Path | os.PathLike, ["a", Path("a")], [5], "a str or a path"),
    (Named, [Whole()], [Half(), "ab", 5], "a Named"),
    (Half, [Half()], [np.int8(5)], "a Half"),
    (NDArray[np.float64], [[1.0], np.ones((2, 2))], ["x", 5.0, ["a"]], NUMBERS),
    (ArrayLike, [[1, 2], np.ones(3)], ["x", 5.0], NUMBERS),
    (ArrayLike | None, [[1, 2], None], ["x"], f"{NUMBERS} or None"),
    (Any, ["x", 5], [], ""),
]
SHOWN = {
    "list": "a list", "tuple": "a tuple", "dict": "a dict", "bytes": "a bytes", "Half": "a Half", "int8": "an int8",
}  # fmt: skip


@pytest.mark.parametrize(("hint", "fits", "wrong", "rule"), HINTS, ids=lambda v: str(v)[:30])
def test_a_call_that_fails_names_the_argument_that_does_not_fit(
    hint: Any, fits: list[Any], wrong: list[Any], rule: str
) -> None:
    def faulty(x: Any) -> None:
        raise KeyError("of the program")

    faulty.__annotations__["x"] = hint
    faulty.__qualname__ = "faulty"
    for value in fits:
        with pytest.raises(KeyError):
            checked(faulty)(value)
    for value in wrong:
        with pytest.raises(InputError) as e:
            checked(faulty)(value)
        shown = SHOWN.get(type(value).__name__) or repr(value)[:60]
        assert str(e.value) == f"The 'x' argument of faulty() must be {rule}. Got {shown} instead."


@checked
class Thing:
    """A class whose methods fail."""

    def __init__(self, a: int = 0) -> None:
        raise KeyError("of the program")

    @classmethod
    def of(cls, *many: int, b: str = "", **rest: Any) -> None:
        raise KeyError("of the program")


def test_every_argument_but_the_object_itself_is_looked_at() -> None:
    calls: dict[str, Callable[[], Any]] = {
        "The 'a' argument of Thing() must be an int. Got None instead.": lambda: Thing(None),  # type: ignore[arg-type]
        "The 'many' argument of Thing.of() must be an int. Got 2.5 instead.": lambda: Thing.of(1, 2.5),  # type: ignore[arg-type]
        "The 'b' argument of Thing.of() must be a str. Got 1 instead.": lambda: Thing.of(b=1),  # type: ignore[arg-type]
        "The arguments of Thing() must be a. Got: got an unexpected keyword argument 'ab'. Did you mean 'a'?": (
            lambda: Thing(ab=1)  # type: ignore[call-arg]
        ),
    }
    for said, call in calls.items():
        with pytest.raises(InputError) as e:
            call()
        assert str(e.value) == said
    for call in (lambda: Thing(1), lambda: Thing.of(1, b="x", c=object())):
        with pytest.raises(KeyError):
            call()
