"""A real browser; without one, its tests are skipped with a word."""

from __future__ import annotations

import os
import shutil

import pytest

ARGUMENTS = [
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--disable-quic",
]
MISSING = "needs Chromium: apt-get install chromium (and pip install playwright)"


@pytest.fixture(scope="session")
def chromium_path():
    """Return where Chromium is, or skip the test."""
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip(MISSING)
    pytest.importorskip("playwright.sync_api", reason=MISSING)
    return path


@pytest.fixture(scope="module")
def chromium(chromium_path):
    """Return a browser; it is gone after the module, since it keeps an event loop running."""
    from playwright import sync_api as api

    sandbox = ["--no-sandbox"] if os.getuid() == 0 else []
    with api.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium_path, args=ARGUMENTS + sandbox)
        yield browser
        browser.close()


@pytest.fixture
def open_page(chromium):
    """Return a function that opens an address in a window of its own; errors on the page fail the test."""
    contexts, errors = [], []

    def make(address, **options):
        contexts.append(chromium.new_context(**{"viewport": {"width": 1000, "height": 700}, **options}))
        page = contexts[-1].new_page()
        page.set_default_timeout(30_000)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.goto(address.url)
        return page

    yield make
    for context in contexts:
        context.close()
    assert [text for text in errors if "WebSocket" not in text] == []  # a server that ends is no error
