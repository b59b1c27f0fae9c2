"""Records of the package Data: the values of identified models of the repository."""

import re

from generator.shelf import Shelf
from hystfmu.model import Model
from hystfmu.modelica.record import is_ours, mark, record

_SOURCE = re.compile(r"// generated from (\S+)")


def records(shelf: Shelf) -> dict[str, str]:
    """Return the new text of each record of an identified model, by its name inside HystFMU.

    The first line of a record on disk states its model file, relative to the repository.

    Raises
    ------
    InputError
        A model file is missing or cannot be read.
    """
    found = {}
    for full, text in shelf.texts.items():
        package, _, name = full.rpartition(".")
        if package == "Data" and is_ours(text):
            source = _SOURCE.match(text).group(1)  # type: ignore[union-attr]
            model = Model.load(shelf.root.parents[1] / source)
            found[full] = f"{mark(source)}\n{record(model, name, 'HystFMU.Data', source)}"
    return found
