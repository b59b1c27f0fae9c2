within HystFMU.Actuators;
record DataSheet "Data sheet of a stack, and the parameters computed from it"
  extends Icons.Record;
  parameter Types.Voltage v_max(min = 0) = 120 "Range of voltage" annotation (Dialog(group = "Data sheet"));
  parameter Types.Position stroke(min = 0) = 38e-6 "Free stroke over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Force F_block(min = 0) = 900 "Blocking force over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Capacitance C_small(min = 0) = 3.1e-6 "Capacitance, small signal" annotation (Dialog(group = "Data sheet"));
  parameter Real C_ratio(min = 1) = 1.6 "Mean capacitance over the range, divided by the small-signal capacitance" annotation (Dialog(group = "Data sheet"));
  parameter Types.Frequency f_n(min = 0) = 20e3 "Resonance frequency without load, with one end fixed" annotation (Dialog(group = "Data sheet"));
  parameter Real zeta(min = 0) = 0.02 "Damping ratio of the resonance" annotation (Dialog(group = "Data sheet"));
  final parameter Types.Capacitance C = C_ratio*C_small "Capacitance without load, mean over the range";
  final parameter Types.Stiffness k_short = F_block/stroke "Stiffness in short circuit";
  final parameter Real coupling = stroke*F_block/(C*v_max^2) "Square of the coupling factor; must be less than 1";
  final parameter Real share = 0.9 + 0.1*coupling "Share of C that is due to the hysteresis";
  final parameter Types.Stiffness k = k_short/(1 - coupling/share) "Stiffness at constant polarisation";
  final parameter Types.Mass m = k_short/(6.283185307179586*f_n)^2 "Moving mass";
  final parameter Types.Damping c = 2*zeta*k_short/(6.283185307179586*f_n) "Damping";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k_short = F_block/stroke, coupling = stroke F_block/(C v_max<sup>2</sup>), k = k_short/(1 - coupling/share), m = k_short/(2 pi f_n)<sup>2</sup>, c = 2 zeta k_short/(2 pi f_n).</p>
<p><b>Source:</b> IEEE Std 176-1987; k33 of the soft ceramic PIC255: PI Ceramic, Piezo Material Data; the default values are of the size of a stack of 5 x 5 x 36 mm.</p>
<p><b>Limitations:</b> the small-signal capacitance is too small for the energy of the whole stroke. With a coupling of 1 or more, the stack would deliver more work than it receives. Most data sheets do not state C_ratio. With the default of C_ratio, the coupling is that of the ceramic, stroke F_block/(C_ratio C_small v_max<sup>2</sup>) = k33<sup>2</sup> = 0.69<sup>2</sup>.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.AmplifiedStack\">Examples.AmplifiedStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.DataSheetStack\">Actuators.DataSheetStack</a>.</p>
</html>"));
end DataSheet;
