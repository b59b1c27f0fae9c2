within HystFMU.Operators;
package Smooth "Operators as ordinary differential equations"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>No events at all, for solvers and optimisers that want none. They need the rate of the input. Plays have a rounded corner, with an error of at most <code>width</code>.</p>
</html>"));
end Smooth;
