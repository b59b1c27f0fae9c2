within HystFMU;
package Operators "Hysteresis operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each operator has up to three realisations with the same parameters: Sampled, Events, Smooth. A model that uses <code>replaceable Operators.Sampled.X constrainedby Operators.BaseClasses.X</code> can change the realisation by redeclare. Operators with return-point memory use the same list of dominant extrema (Functions.turn) and differ only in the branch function.</p>
</html>"));
end Operators;
