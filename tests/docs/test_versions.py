"""Sites of several versions: the folder, and the choice of a version on a page in a browser."""

from __future__ import annotations

import http.server
import threading
from functools import partial
from pathlib import Path

import pytest
from browser import PROGRAM, Browser
from website import versions
from website.places import DOCS

SCRIPT = DOCS / "website" / "static" / "versions.js"


def site(folder: Path, *pages: str) -> Path:
    """Write a site whose pages have the marks that Sphinx and the theme write."""
    for page in ("index.html", *pages):
        root = "../" * page.count("/") or "./"
        path = folder / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(
            f'<!doctype html><html data-content_root="{root}"><head><meta charset="utf-8">'
            f'<script src="{root}_static/versions.js"></script></head>'
            f'<body><a class="sidebar-brand">{folder.name}</a></body></html>'
        )
    (folder / "_static").mkdir()
    (folder / "_static" / "versions.js").write_text(SCRIPT.read_text())
    return folder


def test_versions_are_listed_from_the_newest_and_replace_their_earlier_copies(tmp_path: Path) -> None:
    all_versions = tmp_path / "all"
    one = site(tmp_path / "one", "old.html")
    for name in ("0.9.0", "main", "0.10.0"):
        found = versions.publish(one, all_versions, name)
    assert found == ["0.10.0", "0.9.0", "main"]
    assert (all_versions / "versions.js").read_text() == 'window.siteVersions = ["0.10.0", "0.9.0", "main"];\n'
    assert "url=0.10.0/index.html" in (all_versions / "index.html").read_text()
    assert versions.publish(site(tmp_path / "two"), all_versions, "0.9.0") == found
    assert not (all_versions / "0.9.0" / "old.html").exists() and (all_versions / "main" / "old.html").exists()
    with pytest.raises(ValueError, match="as in 0"):
        versions.publish(one, all_versions, "../one")
    assert (one / "index.html").exists()


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="needs Chromium")
def test_a_page_leads_to_the_same_page_of_another_version(tmp_path: Path) -> None:
    everything = tmp_path / "all"
    versions.publish(site(tmp_path / "new", "docs/a.html", "docs/b.html"), everything, "0.10.0")
    with Browser() as page:
        page.open(everything / "0.10.0" / "docs" / "a.html", "document.readyState === 'complete'")
        assert page.run("document.querySelectorAll('select').length") == 0, "there is one version"
        versions.publish(site(tmp_path / "old", "docs/a.html"), everything, "0.9.0")
        page.open(everything / "0.10.0" / "docs" / "a.html", "document.querySelector('select')")
        assert page.run("[...document.querySelector('select').options].map(o => o.text)") == ["0.10.0", "0.9.0"]
        assert page.run("document.querySelector('select').value") == "0.10.0"
    handler = partial(http.server.SimpleHTTPRequestHandler, directory=everything)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, Browser() as page:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        for name, expected in (("a.html?x=1#part", "docs/a.html?x=1#part"), ("b.html", "index.html")):
            page.call("Page.navigate", url=f"http://127.0.0.1:{server.server_port}/0.10.0/docs/{name}")
            ready = "new Promise(done => setTimeout(() => done(Boolean(document.querySelector('select'))), 50))"
            assert any(page.run(ready) for _ in range(100))
            page.run("{ const all = document.querySelector('select'); all.value = '0.9.0'; all.onchange(); }")
            moved = "new Promise(done => setTimeout(() => done(location.pathname.startsWith('/0.9.0/')), 50))"
            assert any(page.run(moved) for _ in range(100))
            assert page.run("location.href").endswith(f"/0.9.0/{expected}")
        server.shutdown()
