"""Parameter studies of a scenario, in local processes or on a Dask cluster. An interrupted study can be resumed."""

from hystfmu.studies.run import Outcome, study
from hystfmu.studies.spec import Study

__all__ = ["Outcome", "Study", "study"]
