within HystFMU.UsersGuide;
package ToolSupport "Tool support"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Verified with rumoca 0.10.2, solver rk-like: every block and model loads, every Validation and Example model is simulated and compared.
Every file is also read by a second parser, pymoca. Scripts for OpenModelica stand in Resources/Scripts/OpenModelica; <code>make openmodelica</code>
runs them, and simulates every model and export there against the same oracles, where omc is installed. <code>make modelica-strict</code> checks what this compiler does not notice: UsersGuide.Checks. Nothing else is claimed.</p>
<p>rumoca 0.10.2 does not apply the modifiers of a constraining clause to the default of a replaceable component: the examples write them twice.
It loses what a function writes, within an if, into elements of a protected array that has no value as a whole yet: Functions.learn gives it
one first. It ignores the redeclaration of a function where another function of the class calls it: what is replaceable in
Inverse.Sampled.ImplicitInverse is a package. It solves no
initial equation of a state that depends on a discrete variable, such as the memory of an operator with events: Dynamics.TransferFunction and
Operators.Smooth.Creep have another form for chains behind one, inChain (Interfaces.InChain), which exported blocks Events use. Its price in any
tool: a loop around such a block has an algebraic loop through a when-equation at the start, for which inChain = false is right. In the initial
equations of a simulation from a time before 0 it takes relations of the time as they are at 0, and it loses one of the samples
that begin at -2.5 s with a period of 1e-4 s. It reads a vector as a whole, so that a sampled block behind
Dynamics.Sum may read the sum before its elements are new: exports write such a sum as an equation.</p>
</html>"));
end ToolSupport;
