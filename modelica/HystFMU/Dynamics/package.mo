within HystFMU;
package Dynamics "Linear dynamics"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Continuous transfer functions; the units use the exact discretisation for the step instead.</p>
</html>"));
end Dynamics;
