"""Diagrams in a file of their own: one <svg> element with style contains several diagrams; HTML or SVG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.files import write_text
from hystfmu.base.printable import escape
from hystfmu.report.policy import policy

ACROSS, TITLE = 2, 24  # diagrams in a row; height of a title
_STYLE = (
    ".hystfmu{background:#fff;font-family:system-ui,sans-serif}.hystfmu .grid{stroke:#d9e0e6;fill:none}"
    ".hystfmu .frame{stroke:#5d6b78;fill:none}.hystfmu .tick{fill:#5d6b78;font-size:11px}"
    ".hystfmu .title{fill:#1b2733;font-size:13px}"
    ".hystfmu .line{vector-effect:non-scaling-stroke;fill:none;stroke-width:1.4;stroke-linejoin:round}"
    ".hystfmu .c0{stroke:#0b63b5}.hystfmu .c1{stroke:#c24a17}.hystfmu .c2{stroke:#2a7f45}.hystfmu .c3{stroke:#8a3fa0}"
    ".hystfmu .c4{stroke:#8a6500}.hystfmu .dots{stroke-width:4;stroke-linecap:round}"
    ".hystfmu .shade{stroke:none;fill:#5d6b78;fill-opacity:.18}"
)


def drawing(named: Sequence[tuple[str, str]], width: int, height: int) -> str:
    """Return one <svg> element that contains several diagrams.

    Parameters
    ----------
    named : sequence of (title, <svg> element)
    width, height : int
        Size of each element.
    """
    columns = min(ACROSS, max(len(named), 1))
    whole = columns * width, -(-len(named) // columns) * (height + TITLE)
    parts = [
        f'<svg class="hystfmu" xmlns="http://www.w3.org/2000/svg" width="{whole[0]}" height="{whole[1]}" '
        f'viewBox="0 0 {whole[0]} {whole[1]}"><style>{_STYLE}</style>'
    ]
    for k, (title, element) in enumerate(named):
        x, y = k % columns * width, k // columns * (height + TITLE)
        parts.append(f'<text class="title" x="{x + 8}" y="{y + 16}">{escape(title)}</text>')
        parts.append(element.replace("<svg ", f'<svg x="{x}" y="{y + TITLE}" width="{width}" height="{height}" ', 1))
    return "".join([*parts, "</svg>"])


def save(path: str | Path, title: str, svg: str) -> Path:
    """Write a drawing to the file `path`. After an error no incomplete file remains.

    Raises
    ------
    InputError
        The suffix is not .html or .svg, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix == ".svg":
        write_text(path, svg + "\n")
    elif path.suffix == ".html":
        head = f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">{policy([_STYLE])}'
        write_text(path, f"{head}<title>{escape(title)}</title></head><body>\n{svg}\n</body></html>\n")
    else:
        raise InputError(
            f"{path}: The file of a plot must end in .html, .svg, .png or .pdf. Got {path.suffix!r} instead."
        )
    return path
