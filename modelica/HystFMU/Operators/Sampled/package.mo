within HystFMU.Operators;
package Sampled "Operators that act at the instants k Ts"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The blocks behave like HystFMU units with the step Ts. They need no derivative of the input. Extrema between samples have no effect.</p>
</html>"));
end Sampled;
