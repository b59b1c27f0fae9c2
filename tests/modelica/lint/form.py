"""Form of a library on disk: folders, package.order, `within`, names of files; blocks without a Validation model."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import library


def order_complaints(folder: Path) -> Iterator[str]:
    """package.order against the files and folders beside it."""
    listed = (folder / "package.order").read_text().split()
    there = [f.stem for f in folder.glob("*.mo") if f.stem != "package"]
    there += [d.name for d in folder.iterdir() if d.is_dir() and d.name != "Resources"]
    for name in sorted(set(there) - set(listed)):
        yield f"package.order of {folder.name} does not list {name}"
    for name in sorted(set(listed) - set(there)):
        yield f"package.order of {folder.name} lists {name}, which has no file"
    for name in sorted({n for n in listed if listed.count(n) > 1}):
        yield f"package.order of {folder.name} lists {name} twice"


def place_complaints(file: Path, root: Path) -> Iterator[str]:
    """`within` and `end` of a file against its place below `root`, the folder that the library stands in."""
    inside, name = (file.parent, file.stem) if file.stem != "package" else (file.parent.parent, file.parent.name)
    expected = ".".join(inside.relative_to(root).parts)
    body = library.text(file)
    within = re.search(r"^within ([\w.]+);", body, re.M)
    if (within[1] if within else "") != expected:
        yield f"{file.name} is within {within[1] if within else 'nothing'} and stands in {expected}"
    if not re.search(rf"^end {name};\s*\Z|^type {name} = ", body, re.M):
        yield f"{file.name} does not end with 'end {name};'"


def encoding_complaints(file: Path) -> Iterator[str]:
    """The bytes of a file: what one tool reads and another does not."""
    data = file.read_bytes()
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as e:
        yield f"{file.name} is not UTF-8 at byte {e.start}"
    for bad, what in ((b"\xef\xbb\xbf", "a byte order mark"), (b"\t", "a tab"), (b"\r", "a carriage return")):
        if bad in data:
            yield f"{file.name} has {what}"
    if not data.endswith(b"\n") or data.endswith(b"\n\n"):
        yield f"{file.name} does not end with one newline"


def blocks(classes: Mapping[str, library.Class]) -> list[str]:
    """Blocks that a user puts into a model; those of Loops are parts of examples, which are tested as they are."""
    without = ("HystFMU.Icons", "HystFMU.Validation", "HystFMU.Loops")
    return sorted(
        n for n, c in classes.items() if c.tree.type == "block" and not c.tree.partial and not n.startswith(without)
    )


def validations(classes: Mapping[str, library.Class]) -> dict[str, list[str]]:
    """For each class that a Validation model has as its component `tested`: the names of these models."""
    found: dict[str, list[str]] = {}
    for name, c in classes.items():
        if name.startswith("HystFMU.Validation.") and c.tree.type == "model":
            tested = library.find(str(c.tree.symbols["tested"].type), name)
            if tested:
                found.setdefault(tested.name, []).append(name)
    return found


def untested(classes: Mapping[str, library.Class]) -> list[str]:
    """Blocks without a Validation model."""
    return sorted(set(blocks(classes)) - set(validations(classes)))
