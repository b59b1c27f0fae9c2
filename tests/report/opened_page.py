"""Pages from files, with a count of what they request, and a drag in their explorer."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@contextmanager
def opened(browser: Browser, file: Path, waits: bool = True, **options: Any) -> Iterator[Page]:
    """A page in a window, with its explorer started; it may print nothing and request nothing but its own file."""
    context = browser.new_context(**{"viewport": {"width": 1100, "height": 900}, "accept_downloads": True, **options})
    page = context.new_page()
    asked: list[str] = []
    told: list[str] = []
    page.on("request", lambda r: asked.append(r.url))
    page.on("console", lambda m: told.append(m.text))
    page.on("pageerror", lambda e: told.append(str(e)))
    page.route(lambda url: not url.startswith("file:"), lambda route: route.abort())
    page.goto(file.as_uri())
    if waits and page.locator(".explorer").count():
        page.locator(".status:not(:empty)").wait_for()
    yield page
    outside = [url for url in asked if url != file.as_uri() and not url.startswith("blob:")]
    context.close()
    assert outside == []
    assert told == []


def dragged(p: Page) -> dict[str, np.ndarray]:
    """Drag the input of an explorer to and fro; return the columns of the file that the page saves."""
    p.locator("canvas.loop").scroll_into_view_if_needed()
    box = p.locator("canvas.loop").bounding_box()
    assert box is not None
    for k, share in enumerate([0.2, 0.9, 0.35, 0.7]):
        p.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2, steps=1 if k == 0 else 5)
        if k == 0:
            p.mouse.down()
    p.mouse.up()
    with p.expect_download() as waited:
        p.get_by_role("button", name="Save the path").click()
    head, *rows = csv.reader(waited.value.path().read_text().splitlines())
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))
