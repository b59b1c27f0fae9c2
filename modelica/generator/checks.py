"""Page UsersGuide.Checks of the library. It lists the lint rules by section of the language specification."""

from __future__ import annotations

import tomllib
from pathlib import Path

from generator.shelf import mark
from hystfmu.base.printable import escape

_FILE = "modelica/rules.toml"
_APART = {
    "conventions": "Modelica.UsersGuide.Conventions",
    "compiler": "silent errors of one compiler",
    "house": "of this library",
}


def page(root: Path) -> dict[str, str]:
    """Return the page by its name inside HystFMU.

    `root` is the folder of the library. The table of rules, ``rules.toml``, is next to this folder.
    """
    table = tomllib.loads((root.parent / "rules.toml").read_text("utf-8"))
    rows = sorted(table.items(), key=lambda row: _key(row[1]["section"]))
    lines = "\n".join(
        f"<tr><td>{_APART.get(row['section'], row['section'])}</td><td>{name}</td>"
        f"<td>{escape(row['text'], quote=False)}.</td></tr>"
        for name, row in rows
    )
    return {
        "UsersGuide.Checks": f"""{mark(_FILE)}
within HystFMU.UsersGuide;
package Checks "Checks of every class"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Different tools detect different faults. <code>make modelica-strict</code> checks every class by these rules, the
tests every exported package; numbers are sections of the Modelica Language Specification 3.6. Each rule has a test that
inserts a fault and checks that the lint reports it.</p>
<table>
<tr><th>Section</th><th>Rule</th><th>What it asks for</th></tr>
{lines}
</table>
</html>"));
end Checks;
"""
    }


def _key(section: str) -> tuple[bool, list[int], str]:
    numbers = [int(n) for n in section.split(".") if n.isdigit()]
    return not numbers, numbers, section
