within HystFMU;
package Operators "Hysteresis operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each operator in up to three realisations with the same parameters: Sampled, Events, Smooth. A model that uses <code>replaceable Operators.Sampled.X constrainedby Operators.BaseClasses.X</code> can change over by redeclare. Those with return-point memory share one list of dominant extrema, Functions.turn, and differ in the branch function alone.</p>
</html>"));
end Operators;
