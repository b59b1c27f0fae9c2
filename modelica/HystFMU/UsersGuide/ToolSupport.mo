within HystFMU.UsersGuide;
package ToolSupport "Tool support"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Verified with rumoca 0.10.2, solver rk-like: every block and model loads, every Validation and Example model is simulated and compared.
Every file is also read by a second parser, pymoca. Scripts for OpenModelica are in Resources/Scripts/OpenModelica. If
omc is installed, <code>make openmodelica</code> runs them, and compares simulations of all models and exports with the
same oracles. <code>make modelica-strict</code> checks rules that rumoca does not check: UsersGuide.Checks. Other tools
were not tested.</p>
<p>rumoca 0.10.2 has the following limitations. It does not apply the modifiers of a constraining clause to the default
of a replaceable component; therefore the examples write them twice. It loses assignments to elements of a protected
array within an if if the array has no value; therefore Functions.learn first assigns the whole array. It ignores the
redeclaration of a function that another function of the class calls; therefore Inverse.Sampled.ImplicitInverse has a
replaceable package. It does not solve initial equations of a state that depend on a discrete variable, such as the
memory of an operator with events. After such an operator, Dynamics.TransferFunction and Operators.Smooth.Creep need
inChain = true (Interfaces.InChain), as in exported blocks Events. In any tool, a loop around such a block then has an
algebraic loop at the start; use inChain = false for such loops. If a simulation starts before time 0, rumoca evaluates
relations of the time in initial equations at time 0, and it loses one of the samples that begin at -2.5 s with a period
of 1e-4 s. It reads a vector as a whole, so a sampled block after Dynamics.Sum may read the sum before its elements are
updated; therefore exports write such a sum as an equation.</p>
</html>"));
end ToolSupport;
