within HystFMU;
package Plants "Reference plants"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Plants to test controllers on. Their hysteresis is a plain sum of plays, independent of the list of extrema in the operators, so that the two can be compared. Load, wall and ground are for the actuators of HystFMU.Actuators.</p>
</html>"));
end Plants;
