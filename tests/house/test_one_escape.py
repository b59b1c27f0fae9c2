"""Text leaves the package through one place: what prints or escapes beside it forgets what the place knows."""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "python" / "hystfmu"
PLACES = {  # spelling: the files that may use it
    "click.echo(": {"report/terminal.py"},
    "click.secho(": set(),
    "html.escape(": {"base/printable.py"},
    "from html import": set(),
    "saxutils": set(),
    "ET.tostring(": {"fmu/archive.py"},
}


@pytest.mark.parametrize("spelling", PLACES)
def test_text_leaves_through_one_place(spelling):
    found = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.rglob("*.py") if spelling in p.read_text("utf-8")}
    assert found == PLACES[spelling]
