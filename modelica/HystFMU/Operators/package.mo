within HystFMU;
package Operators "Hysteresis operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Sampled operators with memory. Those with return-point memory share one list of dominant extrema, Functions.turn, and differ in the branch function alone.</p>
</html>"));
end Operators;
