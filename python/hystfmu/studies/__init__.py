"""Parameter studies of a scenario, on local processes or a Dask cluster.  An interrupted study can be resumed."""

from hystfmu.studies.run import Outcome, study
from hystfmu.studies.spec import Study

__all__ = ["Outcome", "Study", "study"]
