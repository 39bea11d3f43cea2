"""Sites of several versions in one folder: a list of them, and a page that leads to the newest one.

Each version has its own folder. Pages look for the list beside their folder (``static/versions.js``), and offer to
switch to the same page of another version. A site that stands alone has no list, and offers nothing.
"""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

LIST = "versions.js"
"""The list is a script, since pages that are opened as files may read no other ones."""
_NUMBERED = re.compile(r"\d+(\.\d+)*")
_REDIRECT = """<!doctype html>
<meta charset="utf-8">
<meta http-equiv="refresh" content="0; url={0}/index.html">
<title>gacompiler {0}</title>
<a href="{0}/index.html">gacompiler {0}</a>
"""


def publish(site: Path, folder: Path, version: str) -> list[str]:
    """Copy a site to a folder of versions, in place of an earlier one of the same name, and list all versions.

    Parameters
    ----------
    site : Path
        The site, with ``index.html``.
    folder : Path
        The folder of versions; it is created if necessary.
    version : str
        A name such as ``0.3.0`` or ``main``.

    Returns
    -------
    list of str
        All versions in the folder: numbers from the newest to the oldest, then other names. The page ``index.html`` of
        the folder leads to the first one.

    Raises
    ------
    ValueError
        If the name is not a name of a folder in `folder`.
    """
    if not re.fullmatch(r"\w[\w.+-]*", version):
        raise ValueError(f"version {version!r}; expected letters, digits, '.', '+' or '-', as in 0.3.0")
    target, new = folder / version, folder / f".{version}"
    shutil.rmtree(new, ignore_errors=True)
    shutil.copytree(site, new)
    shutil.rmtree(target, ignore_errors=True)
    new.rename(target)
    found = sorted((page.parent.name for page in folder.glob("[!.]*/index.html")), key=_order)
    (folder / LIST).write_text(f"window.siteVersions = {json.dumps(found)};\n")
    (folder / "index.html").write_text(_REDIRECT.format(found[0]))
    return found


def _order(version: str) -> tuple[bool, list[int], str]:
    numbers = _NUMBERED.match(version)
    return numbers is None, [-int(n) for n in numbers[0].split(".")] if numbers else [], version
