within HystFMU;
package Plants "Reference plants"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>These plants test controllers. Their hysteresis is a plain sum of plays, which does not use the list of extrema of the operators, so both can be compared. Load, fixed flange and ground are for the actuators of HystFMU.Actuators.</p>
</html>"));
end Plants;
