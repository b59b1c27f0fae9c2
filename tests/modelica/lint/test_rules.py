"""The table of rules names every rule of the lint, and each rule finds a fault that is planted for it."""

from pathlib import Path

import library
import lint
import pymoca.parser
import pytest
import rules
from test_mistakes import MISTAKES

PLACE = "annotation (Placement(transformation(extent = {{0, 0}, {20, 20}})))"
SECOND = PLACE.replace("{{0, 0}, {20, 20}}", "{{10, 10}, {30, 30}}")
APART = PLACE.replace("{{0, 0}, {20, 20}}", "{{-50, 0}, {-40, 9}}")
STATE = 'Types.Force F(start = 0, fixed = true) "F"; parameter Types.Time T = 1 annotation (Dialog(group = "A"));'


def rows() -> list[tuple[str, str]]:
    """Rule and class of each row of planted.txt."""
    found = []
    for line in Path(__file__).with_name("planted.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            rule, body = line.split(" | ")
            for word, text in {"PLACE": PLACE, "SECOND": SECOND, "STATE": STATE}.items():
                body = body.replace(f"{{{word}}}", text)
            found.append((rule, body))
    return found


PLANTED = rows()


def planted(body: str, folder: Path) -> set[str]:
    """Rules that complain about a class in the package Operators."""
    file = folder / "Bad.mo"
    file.write_text(f"within HystFMU.Operators;\n{body}\n")
    tree = pymoca.parser.parse(file.read_text())
    assert tree is not None
    c = library.Class("HystFMU.Operators.Bad", file, tree.classes["HystFMU"].classes["Operators"].classes["Bad"])
    return {m.split(":")[0] for m in lint.complaints(c)}


@pytest.mark.parametrize(("rule", "body"), PLANTED)
def test_planted_fault_is_found(rule: str, body: str, tmp_path: Path) -> None:
    assert rule in planted(body, tmp_path)


@pytest.mark.parametrize(("old", "new", "says"), [
    ('versionDate = "2026-11-26"', 'revisionId = "1"', "without_version: HystFMU: has no versionDate"),
    ('conversion(noneFromVersion = "0.1.0"),', "", "without_version: HystFMU: has no conversion"),
    ('preferredView = "info"', 'revisionId = "1"', 'without_view: HystFMU: has no preferredView = "info"'),
])  # fmt: skip
def test_fault_of_a_package_is_found(old: str, new: str, says: str, tmp_path: Path) -> None:
    body = library.text(library.ROOT / "package.mo")
    assert old in body
    file = tmp_path / "package.mo"
    file.write_text(body.replace(old, new))
    tree = pymoca.parser.parse(file.read_text())
    assert tree is not None
    assert list(lint.complaints(library.Class("HystFMU", file, tree.classes["HystFMU"]))) == [says]


def test_guide_without_a_page_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    guide = library.classes()["HystFMU.UsersGuide"]
    monkeypatch.delitem(library.classes(), "HystFMU.UsersGuide.Contact")
    assert list(lint.complaints(guide)) == ["without_contact: HystFMU.UsersGuide: has no page Contact"]


def test_sound_parts_are_quiet(tmp_path: Path) -> None:
    """The classes above without their faults: none of these rules complains of them."""
    line = "annotation (Line(points = {{0, 0}, {1, 1}}))"
    sound = (
        f'block Bad "b" extends Icons.Block; {STATE} Real v(unit = "m3", nominal = 1, start = 0, fixed = true); '
        f"Real y; Dynamics.Sum a {PLACE}; Interfaces.RealInput u {APART}; "
        f"equation connect(u, a.u[1]) {line}; a.u[2] = 1; T*der(v) = 1; T*der(F) = F; y = 2*a.y; end Bad;"
    )
    assert planted(sound, tmp_path) & {rule for rule, _ in PLANTED} == set()


def test_table_names_every_rule() -> None:
    files = {"package_order", "place_of_file", "encoding"}  # test_mistakes.py plants faults in folders for these
    assert {r.name for r in rules.table()} == {r.__name__ for r in lint.rules()} | files


def test_every_rule_has_a_planted_fault() -> None:
    # in test_mistakes.py and above
    apart = {"package_order", "place_of_file", "encoding"}
    apart |= {"without_version", "without_contact"}
    tested = {rule for rule, _ in PLANTED} | {m.says.split(":")[0] for m in MISTAKES.values()}
    assert {r.name for r in rules.table()} - tested - apart == set()


def test_strict_command_prints_every_rule_and_complaint(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On two classes and no file; test_library.py asks every rule of every class."""
    some = {n: library.classes()[n] for n in ("HystFMU.Dynamics.Sum", "HystFMU.UsersGuide")}
    monkeypatch.setattr(library, "files", list)
    monkeypatch.setattr(rules, "folders", list)
    monkeypatch.setattr(library, "classes", lambda: some)
    assert rules.main() == 1
    printed = capsys.readouterr().out
    assert all(f" {r.name} " in printed for r in rules.table())
    assert "without_contact: HystFMU.UsersGuide: has no page License" in printed
    assert "2 classes, " in printed
