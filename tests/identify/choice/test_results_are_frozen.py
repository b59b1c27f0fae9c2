"""Results of fits and studies are immutable: their classes are frozen."""

import dataclasses
import importlib
import pkgutil

import pytest

import hystfmu.identify
import hystfmu.studies

GROW = {"Trial of race", "Race of race"}  # a race adds folds to its trials


def classes():
    for package in (hystfmu.identify, hystfmu.studies):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            module = importlib.import_module(found.name)
            for name, value in vars(module).items():
                if dataclasses.is_dataclass(value) and getattr(value, "__module__", "") == found.name:
                    yield pytest.param(value, id=f"{name} of {found.name.rpartition('.')[2]}")


@pytest.mark.parametrize("kind", [p for p in classes() if p.id not in GROW])
def test_a_result_is_frozen(kind):
    made = object.__new__(kind)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(made, dataclasses.fields(kind)[0].name, 1)
