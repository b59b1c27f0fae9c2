within HystFMU.Inverse.Sampled;
block ImplicitInverse "Implicit inverse: the input at which a static model has the wanted output, sampled"
  extends BaseClasses.ImplicitInverse(u(start = 0, fixed = true));
  extends Interfaces.Sampled;
  replaceable package Model = Models.BacklashSum constrainedby BaseClasses.StaticModel "Model to invert" annotation (choicesAllMatching = true);
  parameter Real values[:] = {1} "Parameters of the model, in the order of its documentation" annotation (Dialog(group = "Parameters"));
  parameter Real state0[:] = {0} "Output and memory of the model before the first input" annotation (Dialog(group = "Parameters"));
protected
  discrete Real state[size(state0, 1)](start = state0, each fixed = true) "Output and memory of the model";
equation
  assert(lo < hi, "lo must be less than hi");
  when sample(t0, Ts) then
    u = Model.root(y, lo, hi, pre(u), pre(state), values);
    state = Model.step(u, pre(state), values);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the unit inverts any graph between its ports u and h. Here the model is a package of functions,
and there is no port h. The model must be static. A step needs 3 to 30 evaluations of the model. If [lo, hi] contains no
root, u is the bound with the smaller deviation.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.ImplicitInverse\">Inverse.BaseClasses.ImplicitInverse</a>: equation, source, example.</p>
</html>"));
end ImplicitInverse;
