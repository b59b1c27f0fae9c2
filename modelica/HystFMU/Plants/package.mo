within HystFMU;
package Plants "Reference plants"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Plants that the controllers are tried on. Their hysteresis is a plain sum of plays, not the list of extrema that the operators use, so that the two can be held against each other. Load, wall and ground are for the actuators of HystFMU.Actuators.</p>
</html>"));
end Plants;
