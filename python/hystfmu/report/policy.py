"""Content-Security-Policy of a page. It allows only the scripts and styles of the page, and no requests."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence


def policy(styles: Sequence[str], scripts: Sequence[str] = (), core: bool = False) -> str:
    """Return the <meta> element that states the policy. It must be in front of every style and script.

    Parameters
    ----------
    styles, scripts : sequence of str
        Complete text between the tags of each <style> and <script> element, including line ends.
    core : bool
        Whether the page compiles WebAssembly.
    """
    allowed = [*map(_hash, scripts), *(["'wasm-unsafe-eval'"] if core else [])]
    rules = ["default-src 'none'", f"style-src {' '.join(map(_hash, styles))}"]
    rules += [f"script-src {' '.join(allowed)}"] if allowed else []
    rules += ["base-uri 'none'", "form-action 'none'"]
    return f'<meta http-equiv="Content-Security-Policy" content="{"; ".join(rules)}">'


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
