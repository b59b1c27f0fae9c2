"""What a message says of a file with wrong keys."""

import pytest
from pydantic import BaseModel

from hystfmu.base.errors import InputError
from hystfmu.base.files import check


class Inner(BaseModel, extra="forbid"):
    gain: float


class Outer(BaseModel, extra="forbid"):
    name: str
    inner: Inner


def said(table):
    with pytest.raises(InputError) as caught:
        check(table, Outer, "a.toml")
    return str(caught.value)


@pytest.mark.parametrize(("wrong", "end"), [(20, "There is no such key."), (21, "Further wrong keys: 1.")])
def test_twenty_wrong_keys_are_listed_and_the_others_counted(wrong, end):
    told = said({"name": "a", "inner": {"gain": 1.0}} | {f"key_{k}": k for k in range(wrong)})
    assert told.count("There is no such key.") == 20
    assert told.endswith(end)


def test_a_key_is_meant_that_is_missing_in_the_same_table():
    told = said({"inner": {"gian": 1.0, "nmae": 2.0}})
    assert "inner.gian: There is no such key. Did you mean 'gain'?" in told
    assert "inner.nmae: There is no such key. name: The key is required." in told
