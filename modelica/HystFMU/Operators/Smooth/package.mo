within HystFMU.Operators;
package Smooth "Operators as ordinary differential equations"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>These operators have no events, for solvers and optimisers that do not support events. They need the rate of the input. Plays have rounded corners; their error is at most <code>width</code>.</p>
</html>"));
end Smooth;
