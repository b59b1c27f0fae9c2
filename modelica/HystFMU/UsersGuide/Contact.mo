within HystFMU.UsersGuide;
package Contact "Contact"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Questions, faults and wishes: the issues of the HystFMU project. A report helps most with the model, the tool and its version, and what it says.</p>
<p>The HystFMU developers.</p>
</html>"));
end Contact;
