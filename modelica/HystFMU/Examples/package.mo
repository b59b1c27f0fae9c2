within HystFMU;
package Examples "Closed loops, operators, a physical actuator"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Cascade, SlidingMode, SuperTwisting, Pid, PidObserver, LeadLag and IterativeLearning are the twins of the scenarios of the same names, ZhaoTan of a case of cascade_learned; the
others show operators, inverses and a physical actuator; IpmcNetwork is a case of papers/ipmc_bfbnn_compensator.</p>
</html>"));
end Examples;
