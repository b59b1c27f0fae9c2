// generated from the table of fmu_build/core/blocks/inverses/implicit_inverse.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block ImplicitInverse "Implicit inverse: the input at which a static model has the wanted output: parameters and ports"
  extends Icons.Inverse;
  parameter Real lo(min = -1e300, max = 1e300) = -1 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real hi(min = -1e300, max = 1e300) = 1 "Upper limit of u" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput y "Wanted output" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput u "Model input" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u in [lo, hi] such that h(u) = y, h the output of the model between u and h.</p>
<p><b>Source:</b> bracketed root finding: Chandrupatla 1997.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.ImplicitInverse\">Examples.ImplicitInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ImplicitInverse\">Validation.Sampled.ImplicitInverse</a>.</p>
</html>"));
end ImplicitInverse;
