"""What the options of every kind promise: a model file names only what was given, so a default must not move unseen.

`kinds.toml` has the options, the candidates of `auto`, and what data a kind takes, written by hand.
"""

import tomllib
from dataclasses import astuple
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest

from hystfmu import InputError
from hystfmu.identify import catalogue, methods
from hystfmu.identify.catalogue import Candidate, Option
from hystfmu.identify.features.plays import u0_option
from hystfmu.identify.network.readout import network_options

WRITTEN = tomllib.loads(Path(__file__).with_name("kinds.toml").read_text())
FROM_DATA = "from the data"


def row(option: Option) -> list[object]:
    """The default, then the words, or the least and the largest value."""
    default = FROM_DATA if option.default is None else option.default
    return [default, *(option.choices or (option.lo, option.hi))]


def test_every_kind_is_written():
    rows = {
        k: row
        for m in iter_modules(methods.__path__)
        for k, row in import_module(f"{methods.__name__}.{m.name}").KINDS.items()
    }
    assert (*sorted(rows), "auto") == catalogue.METHODS
    assert sorted(WRITTEN["options"]) == sorted(rows)
    assert [k for k in sorted(rows) if catalogue.method(k).records] == WRITTEN["several_records"]
    assert [k for k in sorted(rows) if catalogue.method(k).covariates] == WRITTEN["covariates"]


@pytest.mark.parametrize("key", catalogue.METHODS)
def test_the_options_of_a_kind_have_their_default_and_range(key):
    found = {o.name: repr(row(o)) for o in catalogue.options(key)}  # 1 is not 1.0: the default decides on the type
    assert found == {name: repr(values) for name, values in WRITTEN["options"].get(key, {}).items()}


@pytest.mark.parametrize("key", catalogue.METHODS)
def test_both_ends_of_a_range_belong_to_it(key):
    for option in (o for o in catalogue.options(key) if not o.choices):
        for end, outwards in ((option.lo, -1), (option.hi, 1)):
            assert option.check(end) == end
            beyond = end + outwards if isinstance(option.default, int) else np.nextafter(end, outwards * np.inf)
            with pytest.raises(InputError, match=rf"'{option.name}' must be an? (int|float) in \["):
                option.check(beyond)


@pytest.mark.parametrize(
    ("default", "words"),
    [(None, FROM_DATA), (0.05, "0.05"), (1e-4, "0.0001"), (True, "true"), (False, "false"), (40, "40"), ("foh", "foh")],
)
def test_a_default_in_words(default, words):
    assert Option("x", default).shown_default == words


def test_options_that_kinds_share_say_what_a_kind_gives_them():
    assert "at least 1e-08" in next(o.text for o in network_options(7, 4, 90, 1e-8) if o.name == "decay")
    assert u0_option("it rests").text == "initial memory: it rests at this input; default the first input"


def test_who_competes_and_at_what_cost():
    found = catalogue.candidates()
    assert {name: astuple(c) for name, (_, c) in found.items()} == {
        name: astuple(Candidate(**values)) for name, values in WRITTEN["candidates"].items()
    }
    assert all(name.split()[0] == key for name, (key, _) in found.items())
