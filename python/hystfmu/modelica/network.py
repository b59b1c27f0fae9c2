"""A network with many weights: a function with the weights as constants, and a block that calls it."""

from __future__ import annotations

from hystfmu.graph import Node
from hystfmu.modelica import classes
from hystfmu.modelica.layout import port_placed
from hystfmu.modelica.literals import array, class_name, string


def names(node: Node) -> tuple[str, str]:
    """Return the names of the function and of the block."""
    return f"{node.name}Output", f"{class_name(node.name)}Network"


def network(node: Node, within: str) -> dict[str, str]:
    """Return the two classes by name, without the first line of a file (the mark)."""
    n_in, n_hidden, n_out = (node.dims[k] for k in ("n_in", "n_hidden", "n_out"))
    function, block = names(node)
    text = f"Network {node.name}: {n_in} inputs, {n_hidden} hidden neurons, {n_out} outputs"
    weights = [
        f"  constant Real {k}[{', '.join(map(str, w.shape))}] = {array(w)} {string(v.text)};"
        for k, (v, w) in classes.values(node).items()
    ]
    activation = classes.choices(node)["activation"]
    return {
        function: f"""within {within};
function {function} {string(text)}
  extends HystFMU.Icons.Function;
  input Real u[{n_in}] "Inputs";
  output Real y[{n_out}] "Outputs";
protected
{chr(10).join(weights)}
algorithm
  y := b2 + W2*HystFMU.Functions.activation(b1 + W1*u, {activation});
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = b2 + W2 f(b1 + W1 u), f the activation.</p>
<p><b>Source:</b> trained by hystfmu.</p>
<p><b>Limitations:</b> the weights are constants, so that tools need not handle thousands of parameters.</p>
</html>"));
end {function};
""",
        block: f"""within {within};
block {block} {string(text)}
  extends HystFMU.Icons.Block;
  HystFMU.Interfaces.RealInput u[{n_in}] "Inputs" annotation ({port_placed(True, 0, 1)});
  HystFMU.Interfaces.RealOutput y[{n_out}] "Outputs" annotation ({port_placed(False, 0, 1)});
equation
  y = {function}(u);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = {function}(u).</p>
<p><b>Source:</b> trained by hystfmu.</p>
<p><b>Limitations:</b> memoryless; the weights cannot be changed.</p>
<p><b>Example:</b> <a href=\\"modelica://{within}.Example\\">{within}.Example</a>.</p>
<p><b>See also:</b> <a href=\\"modelica://HystFMU.Networks.Mlp\\">HystFMU.Networks.Mlp</a>.</p>
</html>"));
end {block};
""",
    }
