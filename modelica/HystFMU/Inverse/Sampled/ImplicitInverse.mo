within HystFMU.Inverse.Sampled;
block ImplicitInverse "Implicit inverse: the input at which a static model has the wanted output, sampled"
  extends Icons.Inverse;
  extends Interfaces.Sampled;
  replaceable package Model = Models.BacklashSum constrainedby BaseClasses.StaticModel "The model" annotation (choicesAllMatching = true);
  parameter Real lo(min = -1e300, max = 1e300) = -1 "Lower limit of u";
  parameter Real hi(min = -1e300, max = 1e300) = 1 "Upper limit of u";
  parameter Real values[:] = {1} "Parameters of the model, in the order that it says";
  parameter Real state0[:] = {0} "Output and memory of the model before the first input";
  Interfaces.RealInput y "Wanted output of the model" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Input of the model that gives y" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real state[size(state0, 1)](start = state0, each fixed = true) "Output and memory of the model";
equation
  assert(lo < hi, "lo must be less than hi");
  when sample(0, Ts) then
    u = Model.root(y, lo, hi, pre(u), pre(state), values);
    state = Model.step(u, pre(state), values);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u in [lo, hi] such that h(u) = y, h the output of the model.</p>
<p><b>Source:</b> bracketed root finding: Chandrupatla 1997; the nearest root as in the unit of the same name.</p>
<p><b>Limitations:</b> the unit hangs on any graph between its ports u and h; here the model is a package of functions, and there is no port h.
The model must be static. A step takes 3 to 30 evaluations of the model; where no root is in [lo, hi], u is the bound that comes closer.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.ImplicitInverse\">Examples.ImplicitInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Models\">Inverse.Models</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ImplicitInverse\">Validation.Sampled.ImplicitInverse</a>.</p>
</html>"));
end ImplicitInverse;
