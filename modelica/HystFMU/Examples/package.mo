within HystFMU;
package Examples "Closed loops, operators and physical actuators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Cascade, SlidingMode, SuperTwisting, Pid, PidObserver, LeadLag and IterativeLearning correspond to the scenarios with
the same names. ZhaoTan corresponds to a case of cascade_learned, and IpmcNetwork to a case of
papers/ipmc_bfbnn_compensator. The other examples show operators, inverses and physical actuators.</p>
</html>"));
end Examples;
