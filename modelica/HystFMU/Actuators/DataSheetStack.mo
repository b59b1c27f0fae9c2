within HystFMU.Actuators;
model DataSheetStack "Piezo stack from the values of a data sheet"
  parameter DataSheet data "Data sheet" annotation (Dialog(group = "Data sheet"), Placement(transformation(extent = {{-80, 60}, {-60, 80}})));
  extends BaseClasses.Piezo(final v_max = data.v_max, final stroke = data.stroke, final C = data.C, final k = data.k, m = data.m, final c = data.c, final share = data.share);
equation
  assert(data.coupling < 1, "The data sheet must have F_block*stroke < C*v_max^2, C the mean capacitance over the range: else the stack gives more work than it takes");
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> that of Actuators.BaseClasses.Piezo with the values of Actuators.DataSheet.</p>
<p><b>Heat:</b> as in Actuators.BaseClasses.Piezo; at least 0 at every instant with the default hysteresis.</p>
<p><b>Source:</b> as for the base class.</p>
<p><b>Limitations:</b> as for the base class. The default hysteresis is not that of a particular stack; replace it by an identified hysteresis.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.AmplifiedStack\">Examples.AmplifiedStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.DataSheet\">Actuators.DataSheet</a>, <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end DataSheetStack;
