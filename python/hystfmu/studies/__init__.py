"""Studies: a scenario over many variations, on local processes or a Dask cluster, resumed after any interruption."""

from hystfmu.studies.run import Outcome, run_study
from hystfmu.studies.spec import Study

__all__ = ["Outcome", "Study", "run_study"]
