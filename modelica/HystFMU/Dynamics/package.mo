within HystFMU;
package Dynamics "Linear dynamics, scaling, sums and delays"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Transfer functions and lags are continuous here; the units discretise them exactly for their step.</p>
</html>"));
end Dynamics;
