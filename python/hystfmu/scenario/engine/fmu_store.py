"""Graphs as unpacked FMUs on disk, each exported once, for as long as a run or a study needs them."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from hystfmu.graph import Graph


class FmuStore:
    """Exported and unpacked FMUs in a temporary folder that is removed at the end of the `with`.

    Parameters
    ----------
    within : path, optional
        Where that folder is made; by default the temporary folder (TMPDIR is honoured).
    """

    def __init__(self, within: str | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="hystfmu_run_", dir=within))
        self._known: dict[tuple[str, int], tuple[Path, Any]] = {}

    def __enter__(self) -> FmuStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Remove everything."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def get(self, graph: Graph, fmi: Literal[2, 3]) -> tuple[Path, Any]:
        """Folder and model description of the graph as an FMU; exported on first use.

        The FMU has no sample time, because the scenario controls its steps and divides them at discontinuities.
        """
        graph = graph.with_step(0.0)
        key = (graph.token, fmi)
        if key not in self._known:
            import fmpy

            from hystfmu.fmu.write.export import export_fmu

            archive = self.folder / f"unit_{len(self._known)}.fmu"
            export_fmu(graph, archive, fmi=fmi)
            folder = self.folder / archive.stem
            fmpy.extract(str(archive), str(folder))
            archive.unlink()
            self._known[key] = (folder, fmpy.read_model_description(str(folder), validate=False))
        return self._known[key]
