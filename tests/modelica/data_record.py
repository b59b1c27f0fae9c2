"""Identified models as Modelica records: `python tests/modelica/data_record.py` writes modelica/HystFMU/Data."""

from __future__ import annotations

import library

from hystfmu.model import Model

REPOSITORY = library.ROOT.parents[1]
RECORDS = {"BacklashIdentified": "scenarios/models/backlash_identified.model.toml"}


def prandtl_ishlinskii_record(name: str, source: str) -> str:
    """A record with the values of a Prandtl-Ishlinskii operator and the scaling after it."""
    graph = Model.load(REPOSITORY / source).graph
    hysteresis, readout = graph.node("hysteresis"), graph.node("readout")

    def numbers(values: object) -> str:
        return ", ".join(repr(float(v)) for v in values)  # type: ignore[attr-defined]

    def number(node: object, key: str) -> str:
        return numbers(node.value(key))  # type: ignore[attr-defined]

    n = hysteresis.dims["n"]
    return f"""// generated from {source} - do not edit
within HystFMU.Data;
record {name} "Prandtl-Ishlinskii operator with a scaled output, identified from data"
  parameter Integer n = {n} "Number of play operators";
  parameter Real w0 = {number(hysteresis, "w0")} "Weight of the linear term";
  parameter Real r[n] = {{{number(hysteresis, "r")}}} "Thresholds (play half-widths), increasing";
  parameter Real w[n] = {{{number(hysteresis, "w")}}} "Weights of the plays";
  parameter Real u0 = {number(hysteresis, "u0")} "Initial memory: every play rests at this value";
  parameter Real gain = {number(readout, "gain")} "Factor of the output";
  parameter Real offset = {number(readout, "offset")} "Added to the output";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = offset + gain (w0 u + sum_i w_i p_{{r_i}}[u]).</p>
<p><b>Source:</b> {source}: fit, data and options stand there.</p>
<p><b>Limitation:</b> valid within the range of the identification data.</p>
</html>"));
end {name};
"""


if __name__ == "__main__":
    for name, source in RECORDS.items():
        (library.ROOT / "Data" / f"{name}.mo").write_text(prandtl_ishlinskii_record(name, source))
