"""Join the C core and the FMI layer into one text of sections, from which the export selects those that an FMU needs.

amalgamate.py FMU_BUILD LICENSE OUT

The binaries of an FMU (`platforms/build.py`) are also compiled from such texts, because tables and functions of headers
then occur only once.

Every section begins with a line "/* ==== name ==== */". Names that are private to a file must not collide in one
translation unit:
- names of a file (static functions and data, types, enumeration constants) are prefixed with the name of the file;
- the functions of a block, which headers may define too, are renamed by macros; the initialiser of its descriptor has
  no field names then, which also makes it valid C++; texts for people are omitted;
- macros of a file are undefined at its end;
- names shared by files are prefixed with HYST_PREFIX, so that two FMUs can be linked into one program.
"""

import re
import sys
from pathlib import Path

FILES = {"resource.c", "open_file.c", "own_folder.c"}  # replaced by embedded.c: a source FMU reads no file
WORD = r"[A-Za-z_]\w*"


def in_place(header: Path) -> bool:
    """Return whether a header must be inserted at each include. It has no guard, or depends on earlier macros."""
    return header.name == "calls.h" or not re.search(r"^#ifndef \w+_H$", header.read_text(), re.M)


def blank(text: str) -> str:
    """Return the text with spaces instead of comments, strings and directives, so that only declarations remain."""

    def spaces(m: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", m[0])

    text = re.sub(r"/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'", spaces, text, flags=re.S)
    return re.sub(r"^[ \t]*#(?:.*\\\n)*.*$", spaces, text, flags=re.M)


def top_level(text: str) -> str:
    """Return the declarations outside of braces. The content of braces is removed."""
    out, depth = [], 0
    for c in blank(text):
        depth -= c == "}"
        if depth == 0:
            out.append(c)
        depth += c == "{"
    return "".join(out)


def private_names(text: str) -> set[str]:
    """Return the names that are private to the file with this text."""
    outside, whole = top_level(text), blank(text)
    names = set(re.findall(rf"\bstatic\b[^;{{}}=()]*?\b({WORD})\s*[=;(\[]", outside))
    names |= set(re.findall(rf"\bHYST_\w+_FN\(({WORD})\)", outside))
    names |= set(re.findall(rf"\btypedef\b[^;]*?\b({WORD})\s*;", outside))
    for body in re.findall(rf"\benum\s*(?:{WORD})?\s*{{([^}}]*)}}", whole):
        names |= set(re.findall(rf"(?:^|,)\s*({WORD})", body))
    return names


def public_names(headers: str) -> set[str]:
    """Return the names of functions and data that several files use."""
    names = set()
    for declaration in re.split("[;}]", top_level(headers)):
        if not re.search(r"\b(?:static|typedef)\b", declaration):
            names |= set(re.findall(rf"^[^(]*?\b({WORD})\s*\(", declaration, re.S)[:1])
            names |= set(re.findall(rf"\bextern\b.*?\b({WORD})\s*(?:\[\])?\s*$", declaration, re.S))
    return {n for n in names if re.match("hyst_|fmi_", n)}


def rename(text: str, names: set[str], prefix: str) -> str:
    """Return the text in which the given names have a prefix, except members, strings and comments."""
    if not names:
        return text
    pattern = rf"/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|(?:\.|->)\s*{WORD}|\b(?:{'|'.join(sorted(names))})\b"
    return re.sub(pattern, lambda m: prefix + m[0] if m[0] in names else m[0], text, flags=re.S)


def arguments(text: str, at: int) -> tuple[list[str], int]:
    """Return the arguments of the macro call whose "(" is at the position `at`, and the position after its ")"."""
    depth, begin, found, quoted = 0, at + 1, [], False
    for k in range(at, len(text)):
        c = text[k]
        if c == '"' and text[k - 1] != "\\":
            quoted = not quoted
        if quoted:
            continue
        depth += (c == "(") - (c == ")")
        if (c == "," and depth == 1) or depth == 0:
            found.append(text[begin:k].strip())
            begin = k + 1
        if depth == 0:
            return found, k + 1
    raise SystemExit("amalgamate.py: a macro call does not end")


def fields(hyst_h: str) -> list[str]:
    """Return the names of the members of `hyst_block` in their order."""
    body = re.search(r"typedef struct hyst_block \{(.*?)\} hyst_block;", hyst_h, re.S)[1]
    body = re.sub(r"/\*.*?\*/|HYST_TOLD\(.*?\)", "", body, flags=re.S)
    names: list[str] = []
    for declaration in filter(str.strip, body.split(";")):
        function = re.search(r"\(\*(\w+)\)", declaration)
        names += [function[1]] if function else [w.split()[-1].strip("*") for w in declaration.split(",")]
    return names


class Amalgamation:
    """Sections of the joined text by name, in the order of compilation."""

    def __init__(self, root: Path, sources: list[Path]) -> None:
        self.root, self.sections = root, dict[str, str]()
        self.headers: list[Path] = []
        for path in sources:
            self.collect(path)
        self.fields = fields((root / "core" / "hyst.h").read_text())
        data = {"name", "flags", "trial", "n_dims", "dims", "rate", "n_vars", "vars", "size"}
        self.functions = set(self.fields) - data
        shared = "".join(p.read_text() for p in self.headers)
        blocks = {f"hyst_{p.stem}" for p in root.glob("core/blocks/*/*.c")}
        defines = [f"#define {n} HYST_NAME({n})" for n in sorted(public_names(shared) | blocks)]
        paste = "#define HYST_PASTE(a, b) a##b\n#define HYST_PASTED(a, b) HYST_PASTE(a, b)\n"
        paste += "#define HYST_NAME(name) HYST_PASTED(HYST_PREFIX, name)\n"
        untold = "#ifndef HYST_UNDOCUMENTED\n#define HYST_UNDOCUMENTED\n#endif\n"
        self.sections["names"] = paste + untold + "\n".join(defines)
        for path in self.headers:
            self.sections[self.name(path)] = self.header(path)
        for path in sources:
            self.sections[self.name(path)] = self.source(path)

    def name(self, path: Path) -> str:
        """Return the name of the section of a file."""
        return path.relative_to(self.root).as_posix()

    def includes(self, path: Path) -> list[Path]:
        """Return the headers of this project that a file includes, without the official FMI headers."""
        found = re.findall(r'^#include "([^"]+/[^"]+)"', path.read_text(), re.M)
        return [self.root / name for name in found]

    def collect(self, path: Path) -> None:
        """Add the headers that a file needs, in the order of compilation."""
        for header in self.includes(path):
            self.collect(header)
            if header not in self.headers and not in_place(header):
                self.headers.append(header)

    def body(self, path: Path) -> str:
        """Return the text of a file without includes of project headers. Headers of `in_place` are inserted."""
        text = path.read_text()
        for header in self.includes(path):
            if in_place(header):
                text = text.replace(f'#include "{self.name(header)}"\n', self.body(header))
        return re.sub(r'#include "[^"]+/[^"]+"\n', "", text)

    def header(self, path: Path) -> str:
        """Return the section of a header."""
        text = self.body(path)
        return self.positional_macro(text) if path.name == "hyst.h" else text

    def positional_macro(self, text: str) -> str:
        """Return the macro HYST_BLOCK with one parameter for each field of a block, in the order of the descriptor."""
        at = text.index("const hyst_block hyst_##id = {")
        first, rest = re.split(r"HYST_TOLD\(.*?\) __VA_ARGS__", text[at:], maxsplit=1)
        own = dict(re.findall(r"\.(\w+) = ([^,\\]+),", first))
        self.given = [f for f in self.fields if f not in own]
        values = ", ".join(own.get(f, f"{f}_") for f in self.fields)
        parameters = ", ".join(["id", *(f"{f}_" for f in self.given)])
        head = text[:at].replace("HYST_BLOCK(id, facts, ...)", f"HYST_BLOCK({parameters})")
        return f"{head}const hyst_block hyst_##id = {{{values}{rest}"

    def source(self, path: Path) -> str:
        """Return the section of a source file, with its private names renamed."""
        text = self.body(path)
        stem, block = path.stem, path.parents[1].name == "blocks"
        names = private_names(text)
        before = ""
        if block:
            functions = self.functions
            names -= functions
            tables = text + "".join(header.read_text() for header in self.includes(path))  # headers share rows
            rows = set(re.findall(rf"\b[VD]\(({WORD}),", tables))
            if names & rows:
                raise SystemExit(f"amalgamate.py: {path.name}: {sorted(names & rows)} name a variable and a function")
            text = self.positional_call(text)
            used = sorted(f for f in functions if re.search(rf"\b{f}\b", text) or "HYST_RETURN_POINT(" in text)
            before = f"extern const hyst_block hyst_{stem};\n" + "".join(f"#define {f} {stem}_{f}\n" for f in used)
        text = rename(text, names, f"{stem}_")
        text = text.replace("CALL_", f"{stem}_CALL_")  # enumeration constants of calls.h, made by token pasting
        macros = sorted(set(re.findall(rf"^[ \t]*#define ({WORD})", before + text, re.M)))
        return before + text + "".join(f"#undef {m}\n" for m in macros)

    def positional_call(self, text: str) -> str:
        """Return the text in which the call of HYST_BLOCK has its values in the order of the descriptor."""
        at = text.index("HYST_BLOCK(")
        found, end = arguments(text, at + len("HYST_BLOCK"))
        given = dict(re.match(r"\.(\w+)\s*=\s*(.*)", a, re.S).groups() for a in found[2:])
        numbers = {"flags": "0", "trial": "0", "rate": "HYST_FUNCTION"}
        values = [found[0], *(given.get(f, numbers.get(f, "NULL")) for f in self.given)]
        return f"{text[:at]}HYST_BLOCK({', '.join(values)}){text[end:]}"

    def text(self, licence: str) -> str:
        """Return the licence, followed by all sections."""
        lines = "\n".join(f" * {line}".rstrip() for line in licence.splitlines())
        out = [f"/* generated from fmu_build/core and fmu_build/fmi - do not edit\n *\n{lines}\n */\n"]
        for name, content in self.sections.items():
            out.append(f"/* ==== {name} ==== */\n{content.rstrip()}\n")
        return "".join(out)


def source_files(root: Path) -> list[Path]:
    """Return all source files of an FMU, with the files of blocks first."""
    blocks = sorted(root.glob("core/blocks/*/*.c"))
    return [*blocks, *sorted(set(root.glob("core/**/*.c")) - set(blocks)), *sorted(root.glob("fmi/**/*.c"))]


def main() -> None:
    """Write the text for source FMUs: ``amalgamate.py FMU_BUILD LICENSE OUT``."""
    root, licence, out = (Path(a).resolve() for a in sys.argv[1:])
    sources = [p for p in source_files(root) if p.name not in FILES]
    sources.append(root / "sources" / "embedded.c")
    out.write_text(Amalgamation(root, sources).text(licence.read_text()))


if __name__ == "__main__":
    main()
