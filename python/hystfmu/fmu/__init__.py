"""FMUs: `export_fmu` writes one, `check_fmu` checks one of any origin."""

from __future__ import annotations

from hystfmu.fmu.check.check import check_fmu
from hystfmu.fmu.write.export import export_fmu

__all__ = ["check_fmu", "export_fmu"]
