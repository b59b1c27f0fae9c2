// generated from scenarios/models/backlash_identified.model.toml by hystfmu export --modelica - do not edit
within HystFMU.Data;
record BacklashIdentified "Weighted plays, non-negative least squares; exact inverse"
  extends HystFMU.Data.IdentifiedModel(key = "prandtl_ishlinskii", Ts = 0.01, rms_percent = 0.4996661634433966, max_percent = 2.050866964158745);
  parameter Integer hysteresis_n = 20 "Number of play operators" annotation (Dialog(group = "hysteresis"));
  parameter Integer hysteresis_depth = 16 "Maximum number of stored extrema" annotation (Dialog(group = "hysteresis"));
  parameter Real hysteresis_w0 = 0.30819778733967973 "Weight of the linear term" annotation (Dialog(group = "hysteresis"));
  parameter Real hysteresis_r[20] = {0.06162793740736379, 0.12325587481472758, 0.18488381222209135, 0.24651174962945516, 0.30813968703681893, 0.3697676244441827, 0.4313955618515465, 0.4930234992589103, 0.5546514366662741, 0.6162793740736379, 0.6779073114810016, 0.7395352488883654, 0.8011631862957292, 0.862791123703093, 0.9244190611104568, 0.9860469985178206, 1.0476749359251845, 1.1093028733325483, 1.170930810739912, 1.2325587481472757} "Thresholds (play half-widths), not decreasing" annotation (Dialog(group = "hysteresis"));
  parameter Real hysteresis_w[20] = {0.1261186511181098, 0.1260360570391184, 0.11517921885007545, 0.1432341097275496, 0.10192242384421044, 0.1400404509518253, 0.0994848563342483, 0.13859677095414413, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.004354615766985927, 0.0, 0.0, 0.020649547854403982} "Weights of the plays" annotation (Dialog(group = "hysteresis"));
  parameter Real hysteresis_u0 = 0.0 "Initial memory: every play rests at this value of u" annotation (Dialog(group = "hysteresis"));
  parameter Integer readout_n = 1 "Number of signals" annotation (Dialog(group = "readout"));
  parameter Real readout_gain[1] = {1.0} "Gain" annotation (Dialog(group = "readout"));
  parameter Real readout_offset[1] = {6.17729359170248e-05} "Offset, added after the gain" annotation (Dialog(group = "readout"));
  parameter Real readout_lo[1] = {-1e+300} "Lower limit of the input (-1e300: none)" annotation (Dialog(group = "readout"));
  parameter Real readout_hi[1] = {1e+300} "Upper limit of the input (1e300: none)" annotation (Dialog(group = "readout"));
  annotation (Documentation(info = "<html><p>Values of a model of kind <em>prandtl_ishlinskii</em>: weighted plays, non-negative least squares; exact inverse. A name is that of the block and that of its parameter, as in the FMU.</p><p><b>Source:</b> scenarios/models/backlash_identified.model.toml.</p><p><b>Limitations:</b> valid within the range of the identification data.</p></html>"));
end BacklashIdentified;
