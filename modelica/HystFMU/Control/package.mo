within HystFMU;
package Control "Discrete-time controllers"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The controllers have the sample period Ts. They read their inputs at k Ts and hold their output until (k + 1) Ts.</p>
</html>"));
end Control;
