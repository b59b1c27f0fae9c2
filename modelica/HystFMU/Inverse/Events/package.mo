within HystFMU.Inverse;
package Events "Inverses with one event for each reversal"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The memory changes only at reversals of the wanted output. Input and output of the operators turn at the same times, so one sign of the rate is sufficient.</p>
</html>"));
end Events;
