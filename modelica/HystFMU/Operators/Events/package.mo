within HystFMU.Operators;
package Events "Operators with one event for each reversal"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The memory changes only at reversals of the input. Between reversals, the output is a closed form of the input. The operators need the sign of the rate of the input: <code>rising = du &gt; eps or (pre(rising) and not du &lt; -eps)</code>.</p>
</html>"));
end Events;
