within HystFMU.Actuators;
model FlexureAmplifier "Lever or bridge of flexures that amplifies a stroke"
  extends Icons.Component;
  parameter Real ratio = 5 "Stroke of flange_b divided by the stroke of flange_a, without load" annotation (Dialog(group = "Parameters"));
  parameter Types.Stiffness k_in(min = 0) = 2e6 "Stiffness of the flexures against flange_a" annotation (Dialog(group = "Parameters"));
  parameter Types.Stiffness k_out(min = 0) = 1e6 "Stiffness of the lever at flange_b with flange_a fixed, greater than 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Damping c(min = 0) = 10 "Damping of the lever" annotation (Dialog(group = "Parameters"));
  Interfaces.Flange flange_a "Flange of the actuator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.Flange flange_b "Flange with the amplified stroke" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.Flange support "Frame, which carries the difference of the forces" annotation (Placement(transformation(extent = {{-10, -120}, {10, -100}})));
  Types.Position s_in(nominal = 1e-5) "Stroke of flange_a";
  Types.Position deflection(nominal = 1e-5) "Deflection of the lever";
  Types.Force F "Force of the lever on flange_b";
equation
  s_in = flange_a.s - support.s;
  deflection = ratio*s_in - (flange_b.s - support.s);
  F = k_out*deflection + c*der(deflection);
  flange_b.f = -F;
  flange_a.f = ratio*F + k_in*s_in;
  support.f = -(flange_a.f + flange_b.f);
  annotation (
    Icon(graphics = {Line(points = {{-60, -40}, {60, 40}}, color = {64, 64, 64}, thickness = 1), Ellipse(extent = {{-35, -30}, {-20, -15}}, lineColor = {64, 64, 64}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}),
    Documentation(info = "<html>
<p><b>Equation:</b> F = k_out (ratio s_a - s_b) + c (ratio s_a - s_b)', f_a = ratio F + k_in s_a, against the support.</p>
<p><b>Source:</b> Lobontiu, Compliant Mechanisms 2003, chapter 5: a lever with the compliance of its flexures.</p>
<p><b>Limitations:</b> small strokes; no mass; the torque on the frame is not modelled.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.AmplifiedStack\">Examples.AmplifiedStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end FlexureAmplifier;
