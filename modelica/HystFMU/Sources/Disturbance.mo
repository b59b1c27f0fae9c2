within HystFMU.Sources;
block Disturbance "Disturbance: step plus sine"
  extends BaseClasses.Disturbance;
protected
  constant Real turn(unit = "rad") = 6.283185307179586 "Number 2 pi";
equation
  d = (if time >= t_step then step else 0) + amplitude*sin(turn*frequency*time + phase);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.Disturbance\">Sources.BaseClasses.Disturbance</a>: equation, source, example.</p>
</html>"));
end Disturbance;
