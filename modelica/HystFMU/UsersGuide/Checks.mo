// generated from modelica/rules.toml by `make generate` - do not edit
within HystFMU.UsersGuide;
package Checks "Checks of every class"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Different tools detect different faults. <code>make modelica-strict</code> checks every class by these rules, the
tests every exported package; numbers are sections of the Modelica Language Specification 3.6. Each rule has a test that
inserts a fault and checks that the lint reports it.</p>
<table>
<tr><th>Section</th><th>Rule</th><th>What it asks for</th></tr>
<tr><td>2.3</td><td>keyword</td><td>No name is a word of the language.</td></tr>
<tr><td>3.5</td><td>equal_reals</td><td>No == and &lt;&gt; between Reals outside functions.</td></tr>
<tr><td>3.6.1</td><td>string_sum</td><td>Only a text is added to a text.</td></tr>
<tr><td>3.8</td><td>higher_variability</td><td>A constant follows from constants; a parameter, a size and an attribute from parameters.</td></tr>
<tr><td>4.1</td><td>protected_access</td><td>Nothing reads what another class protects, or what it has not.</td></tr>
<tr><td>4.1</td><td>protected_modified</td><td>A protected element is modified by a derived class only.</td></tr>
<tr><td>4.2</td><td>twice</td><td>No component has the name of an inherited one.</td></tr>
<tr><td>4.2</td><td>declared_twice</td><td>Two elements of a class have two names.</td></tr>
<tr><td>4.4.2.2</td><td>assigned_input</td><td>No equation assigns an input.</td></tr>
<tr><td>4.4.4</td><td>outside_when</td><td>A discrete variable is assigned in a when-equation, and once.</td></tr>
<tr><td>4.6</td><td>block_connector</td><td>A public connector of a block is an input or an output.</td></tr>
<tr><td>4.8.1</td><td>below_min</td><td>A default lies within min and max.</td></tr>
<tr><td>4.8.5</td><td>other_choice</td><td>A word belongs to the enumeration of the parameter.</td></tr>
<tr><td>6.7</td><td>real_as_integer</td><td>A size, an Integer and the range of a loop have no Real value.</td></tr>
<tr><td>7.1.3</td><td>kind_of_base</td><td>A block extends no model, a function no block.</td></tr>
<tr><td>7.2.4</td><td>repeated_annotation</td><td>A declaration or class has one annotation, with each key once.</td></tr>
<tr><td>7.2.5</td><td>missing_each</td><td>A modifier of an array has one value for each element, or 'each'.</td></tr>
<tr><td>8.4</td><td>own_value</td><td>In a when-equation the old value of a variable is pre of it.</td></tr>
<tr><td>8.6</td><td>without_start</td><td>What pre reads at the first event has a start value that is fixed.</td></tr>
<tr><td>8.6</td><td>without_value</td><td>A parameter of a class that is not partial has a value.</td></tr>
<tr><td>8.6</td><td>reinit_at_start</td><td>No reinit at initial(): a start is an initial equation or an assignment.</td></tr>
<tr><td>8.6</td><td>open_start</td><td>What a sample assigns has a start value that is fixed.</td></tr>
<tr><td>9.3.1</td><td>flow_balance</td><td>A connector has as many flow variables as potentials.</td></tr>
<tr><td>12.2</td><td>equation_in_function</td><td>A function has no equation.</td></tr>
<tr><td>12.2</td><td>assigned_argument</td><td>The inputs of a function are not assigned.</td></tr>
<tr><td>12.2</td><td>event_in_function</td><td>A function calls no der, pre, sample, initial.</td></tr>
<tr><td>12.2</td><td>public_in_function</td><td>A public component of a function is an input or an output.</td></tr>
<tr><td>12.4.4</td><td>unassigned_output</td><td>Every output of a function is assigned.</td></tr>
<tr><td>12.4.4</td><td>used_unset</td><td>A protected variable of a function is set before it is read.</td></tr>
<tr><td>12.7.3</td><td>false_inverse</td><td>The inverse that a function names exists and takes its output.</td></tr>
<tr><td>13.4</td><td>package_order</td><td>package.order lists what stands in the folder, once.</td></tr>
<tr><td>13.4</td><td>place_of_file</td><td>A file stands where `within` says and ends with the name of its class.</td></tr>
<tr><td>13.4</td><td>encoding</td><td>A file is UTF-8 without a mark, a tab or a carriage return, and ends with one newline.</td></tr>
<tr><td>18.2.1</td><td>dead_link</td><td>A link or picture of the documentation leads to a class or file that exists.</td></tr>
<tr><td>18.2.1</td><td>unbalanced_html</td><td>Documentation is HTML from &lt;html&gt; to &lt;/html&gt;; every tag is closed, every picture has a text.</td></tr>
<tr><td>18.3</td><td>evaluate</td><td>Evaluate is true or false, and of a parameter or constant.</td></tr>
<tr><td>18.4</td><td>experiment_values</td><td>An experiment ends after its start, has an interval within it and a tolerance between 0 and 1.</td></tr>
<tr><td>18.8.2</td><td>without_version</td><td>A library has version, versionDate, uses, and conversion after its first version.</td></tr>
<tr><td>18.8.2</td><td>conversion_order</td><td>A library converts from versions before its own.</td></tr>
<tr><td>18.8.2</td><td>unlisted_use</td><td>A class of another library needs its name and version in uses.</td></tr>
<tr><td>19.1</td><td>unit_syntax</td><td>A unit of measure has the form of the specification, and symbols that it knows.</td></tr>
<tr><td>silent errors of one compiler</td><td>lost_elements</td><td>A protected array of a function has a value as a whole before an element is set in a branch.</td></tr>
<tr><td>silent errors of one compiler</td><td>redeclared_function</td><td>A component or base class has no function redeclared: a package, instead.</td></tr>
<tr><td>Modelica.UsersGuide.Conventions</td><td>without_icon</td><td>A class has an icon or inherits one; a frame alone is none.</td></tr>
<tr><td>Modelica.UsersGuide.Conventions</td><td>labels</td><td>An icon has %name once, and no two labels on top of each other.</td></tr>
<tr><td>Modelica.UsersGuide.Conventions</td><td>without_contact</td><td>The guide has pages on contact and licence.</td></tr>
<tr><td>of this library</td><td>undocumented</td><td>A class has a description and documentation; a function or block its equation, source, limitations, example.</td></tr>
<tr><td>of this library</td><td>stale_example</td><td>The call that a function shows as its example stands in the class that it names.</td></tr>
<tr><td>of this library</td><td>unlike_units</td><td>A connection joins ports of one unit.</td></tr>
<tr><td>of this library</td><td>connected_twice</td><td>Two ends are connected once.</td></tr>
<tr><td>of this library</td><td>event_storm</td><td>No relation in the equation of a derivative is an event.</td></tr>
<tr><td>of this library</td><td>without_line</td><td>A connection is drawn: its Line has two points or more.</td></tr>
<tr><td>of this library</td><td>without_place</td><td>A component with an icon has a Placement.</td></tr>
<tr><td>of this library</td><td>overlapping</td><td>No two components stand in one place.</td></tr>
<tr><td>of this library</td><td>without_dialog</td><td>A parameter has a group in the dialog.</td></tr>
<tr><td>of this library</td><td>without_constraint</td><td>A replaceable component has constrainedby and choicesAllMatching.</td></tr>
<tr><td>of this library</td><td>without_experiment</td><td>A model to simulate has StopTime, Interval and Tolerance.</td></tr>
<tr><td>of this library</td><td>vendor</td><td>No annotation of one vendor.</td></tr>
<tr><td>of this library</td><td>der_of_input</td><td>No input and no output of a component is differentiated: it may jump at an event.</td></tr>
<tr><td>of this library</td><td>undeclared_discrete</td><td>A Real that a when-equation assigns is declared discrete, or is a port.</td></tr>
<tr><td>of this library</td><td>without_smoothness</td><td>A function that a continuous equation calls says smoothOrder, derivative, or what jumps.</td></tr>
<tr><td>of this library</td><td>unit_clash</td><td>Both sides of an equation, and the terms of a sum, have one unit.</td></tr>
<tr><td>of this library</td><td>without_unit</td><td>A Real to which an equation gives a dimension has a unit.</td></tr>
<tr><td>of this library</td><td>without_nominal</td><td>A state with a unit has a nominal value.</td></tr>
<tr><td>of this library</td><td>other_nominal</td><td>Two names of one variable have one nominal value.</td></tr>
<tr><td>of this library</td><td>without_view</td><td>Pages of the guide have preferredView and DocumentationClass.</td></tr>
<tr><td>of this library</td><td>start_unfixed</td><td>A state with a start value says whether it is fixed.</td></tr>
<tr><td>of this library</td><td>fixed_start_time</td><td>Samples begin at the start of the simulation, and no relation of the time with a sample period tells the first one.</td></tr>
<tr><td>of this library</td><td>quantity_unit</td><td>A quantity has the unit that Modelica.Units.SI gives it.</td></tr>
</table>
</html>"));
end Checks;
