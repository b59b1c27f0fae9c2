"""Identified models as records: `python tests/modelica/export/data_record.py` writes modelica/HystFMU/Data."""

import sys
from pathlib import Path

sys.path += [str(p) for p in Path(__file__).parents[1:3]]  # as pytest has them

import library

from hystfmu.model import Model
from hystfmu.modelica.record import mark, record

REPOSITORY = library.ROOT.parents[1]
SOURCES = {
    "BacklashIdentified": "scenarios/models/backlash_identified.model.toml",
    "BacklashZhaoTanInverse": "scenarios/models/backlash_zhao_tan_inverse.model.toml",
    "BoucWenIdentified": "scenarios/models/bouc_wen_identified.model.toml",
    "IpmcCompensatorNetwork": "scenarios/models/ipmc_compensator_network.model.toml",
    "IpmcCompensatorOperator": "scenarios/models/ipmc_compensator_operator.model.toml",
}


def records() -> dict[str, str]:
    """Text of each record by its name."""
    return {n: f"{mark(s)}\n{record(Model.load(REPOSITORY / s), n, 'HystFMU.Data', s)}" for n, s in SOURCES.items()}


if __name__ == "__main__":
    for name, text in records().items():
        (library.ROOT / "Data" / f"{name}.mo").write_text(text)
