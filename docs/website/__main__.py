"""The command ``python -m website``: collect the pages, build the site with Sphinx, and check it (`make docs`)."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

from gacompiler import __version__

from . import commands, contents, gallery, interfaces, modules, playground, scenes, versions
from .markdown import table
from .places import BUILD, DOCS, ROOT, SITE, SOURCE, notebooks, pages, write

MODULES = "modules/index"
API = "api/index"
COMMANDS = "command_line"
GALLERY = "gallery"

_COPIED = (".png", ".svg", ".gif", ".cff")
"""Endings of the files in ``docs`` that pages show or link to."""


def main(arguments: list[str] | None = None) -> int:
    """Build the site. The exit status is 1 if Sphinx emits a warning or a public name is missing."""
    parser = argparse.ArgumentParser(prog="python -m website", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--keep-going", action="store_true", help="list all warnings without failing")
    parser.add_argument("--fresh", action="store_true", help="build all pages, including unchanged ones")
    parser.add_argument(
        "--pyodide", type=Path, help="folder of Pyodide to copy; else the playground loads it elsewhere"
    )
    parser.add_argument("--versions", type=Path, help="folder of sites of several versions to copy the site to")
    parser.add_argument("--version-name", default=__version__, help="name of the copy [%(default)s]")
    parser.add_argument("-j", "--jobs", default="auto", help="number of processes [%(default)s]")
    given = parser.parse_args(arguments)
    if given.fresh:
        for folder in (SITE, SOURCE, BUILD / "site-cache"):
            shutil.rmtree(folder, ignore_errors=True)
    collect(given.pyodide)
    from sphinx.cmd.build import build_main

    strict = [] if given.keep_going else ["--fail-on-warning"]
    places = ["-c", str(DOCS), "-d", str(BUILD / "site-cache"), str(SOURCE), str(SITE)]
    status = build_main(["--quiet", "-j", given.jobs, *strict, *places])
    missing = [] if status else missing_names()
    if missing:
        print(f"website: public names without documentation in the site: {' '.join(missing)}", file=sys.stderr)
        return 1
    if not status:
        print(f"{SITE.relative_to(ROOT)}/index.html: {len(list(SITE.rglob('*.html')))} pages")
        if given.versions:
            found = versions.publish(SITE, given.versions, given.version_name)
            print(f"{given.versions}/index.html: versions {', '.join(found)}")
    return int(status)


def collect(pyodide: Path | None = None) -> None:
    """Write all files that Sphinx reads, and the playground, with a copy of Pyodide if its folder is given."""
    written = {
        "index.md": contents.index(
            {"Generated code": [MODULES], "API and command line": [API, COMMANDS], "Gallery": [GALLERY]}
        ),
        f"{MODULES}.md": _index("Generated modules", {f"modules/{n}": modules.summary(n) for n in modules.names()}),
        f"{API}.md": _index("API reference", {each.page: "" for each in interfaces.interfaces()}),
        f"{COMMANDS}.md": commands.page(),
    }
    written |= {f"modules/{name}.md": modules.page(name) for name in modules.names()}
    written |= {f"{each.page}.md": interfaces.page(each) for each in interfaces.interfaces()}
    pictures = [*gallery.of_pages(), *gallery.of_demo(SOURCE), *gallery.of_notebooks(SOURCE)]
    written[f"{GALLERY}.md"] = gallery.page(pictures)
    for path in pages():
        name = path.relative_to(ROOT).as_posix()
        written[name] = contents.with_links_to_index(path.read_text(), name)
    for name in ("index.md", *(path.relative_to(ROOT).as_posix() for path in pages())):
        written[name], files = scenes.shown(written[name], name)
        for scene, page in files.items():
            write(scenes.SCENES / "scenes" / scene, page)
    written[playground.PAGE] += playground.FRAME
    for name, content in playground.files(pyodide).items():
        target = scenes.SCENES / "playground" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    for name, text in written.items():
        write(SOURCE / name, text)
    copied = [*notebooks(), *(p for p in DOCS.rglob("*.*") if p.suffix in _COPIED)]
    for path in copied:
        target = SOURCE / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.is_file() or target.read_bytes() != path.read_bytes():
            shutil.copyfile(path, target)
    known = {SOURCE / name for name in written} | {SOURCE / path.relative_to(ROOT) for path in copied}
    for path in [*SOURCE.rglob("*.md"), *SOURCE.rglob("*.ipynb")]:
        if path not in known:
            path.unlink()


def _index(title: str, entries: Mapping[str, str]) -> str:
    """Return the page that lists a group of generated pages."""
    rows = [(f"[](/{path}.md)", about) for path, about in entries.items()]
    listing = "\n".join(f"/{path}" for path in entries)
    return f"# {title}\n\n{table(('page', 'description'), rows)}\n```{{toctree}}\n:hidden:\n\n{listing}\n```\n"


def missing_names() -> list[str]:
    """Return the public names that the site does not document."""
    from sphinx.util.inventory import InventoryFile

    inventory = InventoryFile.loads((SITE / "objects.inv").read_bytes(), uri="")
    known = {name for kind, entries in inventory.data.items() if kind.startswith("py:") for name in entries}
    return [path for path in interfaces.documented() if path not in known]


if __name__ == "__main__":
    sys.exit(main())
