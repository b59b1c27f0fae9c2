// generated from scenarios/models/ipmc_compensator_operator.model.toml by hystfmu export --modelica - do not edit
within HystFMU.Data;
record IpmcCompensatorOperator "Operator of polynomial of the lagged input and Zhao-Tan operator, least squares"
  extends HystFMU.Data.IdentifiedModel(key = "operator", Ts = 0.001);
  parameter Integer input_n = 1 "Number of signals" annotation (Dialog(group = "input"));
  parameter Real input_gain[1] = {2.007773704680817} "Gain" annotation (Dialog(group = "input"));
  parameter Real input_offset[1] = {-0.06998192373509382} "Offset, added after the gain" annotation (Dialog(group = "input"));
  parameter Real input_lo[1] = {-1.0608855327167077} "Lower limit of the input (-1e300: none)" annotation (Dialog(group = "input"));
  parameter Real input_hi[1] = {1.13059650021463} "Upper limit of the input (1e300: none)" annotation (Dialog(group = "input"));
  parameter Integer operator_depth = 16 "Maximum number of stored extrema" annotation (Dialog(group = "operator"));
  parameter Real operator_x0 = -0.0697294859032988 "Initial memory: the operator rests at x = x0, h = 0" annotation (Dialog(group = "operator"));
  annotation (Documentation(info = "<html><p>Values of a model of kind <em>operator</em>: operator of polynomial of the lagged input and Zhao-Tan operator, least squares. A name is that of the block and that of its parameter, as in the FMU.</p><p><b>Source:</b> scenarios/models/ipmc_compensator_operator.model.toml.</p><p><b>Limitations:</b> valid within the range of the identification data.</p></html>"));
end IpmcCompensatorOperator;
