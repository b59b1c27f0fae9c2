within HystFMU.UsersGuide;
package GettingStarted "Getting started"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Add the folder that contains HystFMU to the library path (MODELICAPATH), or open HystFMU/package.mo. Then open Examples.MinorLoops,
simulate for 1 s and plot events.y over signal.r.</p>
<p>For your own model, drag Operators.Sampled.PrandtlIshlinskii into it, set n, w0, r, w and the sample period Ts, and connect u and y.</p>
<p>An identified model: <code>hystfmu export piezo.model.toml --modelica DIR</code> writes a package with the record of its values and a ready block.</p>
</html>"));
end GettingStarted;
