"""Pages from files, with a count of what they request."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
