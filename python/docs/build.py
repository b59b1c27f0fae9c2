"""Build the site: pages by hand, reference pages and pictures from the package, then Sphinx with warnings as errors.

    python python/docs/build.py build/docs

What follows from the code is written into the build folder only; nothing of it is committed.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.core.library import block_types
from hystfmu.face.page import explorer
from hystfmu.graph import listing
from hystfmu.report.page import Section, page, section
from hystfmu.scenario.system.spec import ScenarioSpec
from hystfmu.studies.spec import StudySpec

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))

from pictures import PICTURES  # noqa: E402

EXPLORED = ("actuator", "prandtl_ishlinskii", "zhao_tan_mlp")
FILES = {"scenario.toml": ScenarioSpec, "*.study.toml": StudySpec}


def build(out: Path) -> None:
    """Write the site to `out`/html."""
    source = out / "source"
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(HERE, source, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    shutil.copy(HERE / "conf.py", source)
    (source / "reference").mkdir()
    (source / "pictures").mkdir()
    for name, text in {"commands": commands(), "blocks": blocks(), "files": files(), "python": python()}.items():
        (source / "reference" / f"{name}.md").write_text(text)
    (source / "gallery.md").write_text(gallery(source / "pictures"))
    page = source / "tutorial" / "block.md"
    page.write_text(page.read_text() + "\n" + worked_example())
    schemas = out / "html" / "schema"
    words = ["-W", "--keep-going", "-q", "-b", "html", str(source), str(out / "html")]
    subprocess.run([sys.executable, "-m", "sphinx", *words], check=True)
    for made in (out / "html").rglob("*.html"):  # icons of the theme stand beside a text
        text = re.sub(r"<svg(?![^>]*role=)", '<svg aria-hidden="true"', made.read_text())
        made.write_text(text.replace('<th class="head', '<th scope="col" class="head'))
    (out / "html" / "explorer_alone.html").write_text(explored())
    schemas.mkdir(exist_ok=True)
    for name, spec in FILES.items():
        schema = json.dumps(spec.model_json_schema(by_alias=True), indent=1)
        (schemas / f"{name.removeprefix('*.').removesuffix('.toml')}.schema.json").write_text(schema)


COMPLETION = r"""A shell completes commands, options, values and file names after one line in its start file:

| Shell | Line | File |
|---|---|---|
| bash | `eval "$(_HYSTFMU_COMPLETE=bash_source hystfmu)"` | `~/.bashrc` |
| zsh | `eval "$(_HYSTFMU_COMPLETE=zsh_source hystfmu)"` | `~/.zshrc` |
| fish | `_HYSTFMU_COMPLETE=fish_source hystfmu \| source` | `~/.config/fish/completions/hystfmu.fish` |

In a terminal, tables wrap at its width and verdicts have a colour. The environment variable `NO_COLOR=1` switches
colours off. Output into a file or a pipe is never wrapped or coloured."""


def worked_example() -> str:
    """The block in four files that CONTRIBUTING.md works through, which a test builds."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    begin = text.index("## A block in four files")
    return text[begin : text.index("\n## ", begin) + 1]


def commands() -> str:
    """Return the help of every command."""
    parts = ["# Commands", "", COMPLETION, ""]
    for name in main.list_commands(click.Context(main)):
        command = main.commands[name]
        context = click.Context(command, info_name=f"hystfmu {name}")
        parts += [f"## {name}", "", "```text", command.get_help(context), "```", ""]
    return "\n".join(parts)


def blocks() -> str:
    """Every block as `hystfmu blocks NAME` describes it."""
    parts = ["# Blocks", "", "From the tables of the C files; names are the same in C, Python, Modelica and FMUs.", ""]
    for family in listing.FAMILIES:
        parts += [f"## {family.capitalize()}", ""]
        for t in block_types().values():
            if t.family == family:
                parts += [f"### {t.name}", "", "```text", listing.details(t.name), "```", ""]
    return "\n".join(parts)


def files() -> str:
    """The keys of the TOML files, from the models that check them."""
    parts = [
        "# Files",
        "",
        "Keys of the TOML files, from the models that check them. The same keys exist as JSON Schema for editors.",
        "With the first line `#:schema PATH/scenario.schema.json` in a file, an editor with Taplo completes and checks",
        "the keys. The schemas are in the folder `schema` of this site.",
        "",
    ]
    for name, spec in FILES.items():
        schema = spec.model_json_schema(by_alias=True)
        parts += [f"## {name}", "", *_keys(schema), ""]
        for kind, own in schema.get("$defs", {}).items():
            if own.get("properties"):
                title = f"{name}: {kind.removesuffix('Spec')}"
                parts += [f"### {title}", "", own.get("description", "").splitlines()[0], "", *_keys(own), ""]
    return "\n".join(parts)


def _keys(schema: dict[str, object]) -> list[str]:
    properties = schema["properties"]
    assert isinstance(properties, dict)
    rows = ["| key | default | meaning |", "|---|---|---|"]
    for key, p in properties.items():
        default = json.dumps(p["default"]) if "default" in p else "required"
        rows.append(f"| `{key}` | `{default}` | {str(p.get('description', '')).replace('|', '/')} |")
    return rows


def python() -> str:
    """The public face, from its docstrings."""
    parts = ["# Python", "", "`import hystfmu as hy` is enough for all of it.", ""]
    for name in dir(hy):
        what = getattr(hy, name)
        kind = "module" if not callable(what) else "class" if isinstance(what, type) else "function"
        home = what.__name__ if kind == "module" else f"{what.__module__}.{what.__qualname__}"
        if name == "blocks":
            continue  # a page of its own
        members = ["   :members:"] if kind != "function" else []
        parts += [f"## {name}", "", "```{eval-rst}", f".. auto{kind}:: {home}", *members, "```", ""]
    return "\n".join(parts)


def explored() -> str:
    """A page with the explorer of three kinds of models, fitted to the built-in piezo stack."""
    data = hy.synthetic.piezo(60, 1000.0)
    models = [hy.fit(data, key) for key in EXPLORED]
    shown = explorer(models, data, "voltage (V)", "displacement (um)")
    return page("Explorer", ["<h1>Explorer</h1>", section(Section("", explorer=shown))])


def gallery(folder: Path) -> str:
    """Pictures that the build computes, each with the lines that make it."""
    parts = ["# Gallery", "", "Every picture is computed when this site is built.", ""]
    for name, (title, text, draw) in PICTURES.items():
        parts += [f"## {title}", "", text, ""]
        for k, svg in enumerate(draw(), 1):
            (folder / f"{name}_{k}.svg").write_text(svg)
            parts.append(f"![{title}, {k}](pictures/{name}_{k}.svg)")
        parts.append("")
    return "\n".join(parts)


if __name__ == "__main__":
    build(Path(sys.argv[1] if len(sys.argv) > 1 else "build/docs"))
