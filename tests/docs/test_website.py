"""The pages that the documentation site adds are complete, reproducible, and agree with the code."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import click
import pytest
from website import commands, contents, gallery, interfaces, modules
from website.markdown import anchors, first_sentence, headings, images, links, table
from website.places import DOCS, ROOT, notebooks, pages

from gacompiler.cli import COMMANDS, main


def packages() -> list[str]:
    """The packages whose text lists public names."""
    found = []
    for top in ("gacompiler", "algorithms"):
        for path in sorted((ROOT / top).rglob("__init__.py")):
            nodes = ast.walk(ast.parse(path.read_text()))
            if any(isinstance(node, ast.Name) and node.id == "__all__" for node in nodes):
                found.append(".".join(path.parent.relative_to(ROOT).parts))
    return found


def test_the_table_of_contents_has_every_page_and_notebook() -> None:
    listed = [entry for entries in contents.listed().values() for entry in entries]
    expected = [path.relative_to(ROOT).as_posix() for path in [*pages(), *notebooks()]]
    assert sorted(listed) == sorted(expected), "docs/README.md lists every page once"


def test_the_index_has_links_from_the_root_and_a_navigation_for_every_group() -> None:
    text = contents.index({"Generated code": ["modules/index"]})
    assert "](docs/tutorials/calling.md)" in text and "](README.md)" in text
    assert "```{container} hero\n**[" in text and "](README.md#install)**" in text
    assert [group for group in contents.listed() if f":caption: {group}\n" not in text] == []
    assert "\n/docs/speed\n" in text and "\n/notebooks/conformal_geometry\n" in text and "\n/modules/index\n" in text


def test_links_to_the_table_of_contents_lead_to_the_index() -> None:
    text = "[a](docs/README.md) [b](README.md)"
    assert contents.with_links_to_index(text, "README.md") == "[a](/index.md) [b](README.md)"
    assert contents.with_links_to_index(text, "docs/speed.md") == "[a](docs/README.md) [b](/index.md)"


@pytest.mark.slow
def test_every_public_name_of_a_package_has_an_entry() -> None:
    found = {each.module: each for each in interfaces.interfaces()}
    documented = set(interfaces.documented())
    entries: dict[str, set[str]] = {}
    for package in packages():
        module = importlib.import_module(package)
        assert package in found, f"{package} has no page"
        for name in module.__all__:
            path = interfaces.home(found[package], name, getattr(module, name))
            assert not path or path in documented, f"{package}.{name} is in no page"
            if path:
                home = path.rpartition(".")[0]
                if home not in entries:
                    listed = re.findall(r"auto\w+:: (.*)$|py:data\} (\w+)$", interfaces.page(found[home]), re.MULTILINE)
                    entries[home] = {automatic or f"{home}.{data}" for automatic, data in listed}
                assert path in entries[home], path


def test_modules_that_pages_import_from_have_a_page() -> None:
    found = {each.module: each.names for each in interfaces.interfaces()}
    assert "polyhedral_group" in found["gacompiler.structure.finite_groups"]
    assert "GREY" in found["algorithms.wavelets.colours"] and "PGA3" in found["gacompiler.algebra.catalog"]
    assert not [name for names in found.values() for name in names if name.startswith("_")]


def test_classes_of_objects_and_texts_of_data_are_documented() -> None:
    found = {each.module: each for each in interfaces.interfaces()}
    objects = interfaces.page(found["gacompiler.objects"])
    assert re.search(r"autoclass:: gacompiler\.objects\.projective\.\w+\n +:members:", objects)
    assert "{py:data} KINDS\n:module: algorithms.geometry\n" in interfaces.page(found["algorithms.geometry"])


def test_every_generated_module_has_a_page() -> None:
    assert set(modules.names()) == {path.stem for path in (ROOT / "generated").glob("*.c")}
    assert "lane-based geometric algebra G(2,0,1)" in modules.summary("pga2")


@pytest.mark.parametrize("name", ["pga2", "robots"])
def test_the_page_of_a_module_agrees_with_the_module(name: str) -> None:
    """Compared with the text of the module, read without running it."""
    text = modules.page(name)
    source = (ROOT / "generated" / f"{name}.py").read_text()
    kernels = re.findall(r"^@_module\.(?:kernel|loop\w*)\((.*?)\)\ndef (\w+)\(", source, re.MULTILINE | re.DOTALL)
    layouts = re.findall(r'^(\w+) = _layout\("[^"]+", "([^"]+)"', source, re.MULTILINE)
    assert layouts
    for layout, blades in layouts:
        assert f"| `{layout}` | `{blades}` |" in text
    for record, kernel in kernels:
        row = next(line for line in text.splitlines() if f"`{kernel} <" in line and "->" in line)
        error = re.search(r'error="([\d.e+-]+ ulp)', record)
        assert error is None or error[1] in row, kernel
        assert f"autofunction:: generated.{name}.{kernel}" in text
    declared = importlib.import_module(f"generated.{name}").kernels
    assert text.count(".. autofunction::") == len(declared) and len(declared) > 10


def test_operation_counts_of_a_module_page_are_those_of_its_kernels() -> None:
    text = modules.page("pga2")
    row = next(line for line in text.splitlines() if "`normalize_line <" in line)
    assert "| 5 | 1 | 1 | 1 |" in row and "`(3)->(3)`" in row and "1.8 ulp" in row
    assert "e0 · e0 = 0" in text and "| `Motor * Motor` | `Motor` |" in text
    cga = modules.page("cga2")
    assert "e0 · einf = -1" in cga and "| once |" in cga


def test_pages_are_the_same_at_every_call() -> None:
    found = interfaces.interfaces()[0]
    assert modules.page("vga2") == modules.page("vga2") and commands.page() == commands.page()
    assert interfaces.page(found) == interfaces.page(found)


def test_every_command_has_its_options_and_examples() -> None:
    sections = commands.page().split("\n## ")
    assert len(sections) == 1 + len(COMMANDS)
    for name, section in zip(COMMANDS, sections[1:], strict=True):
        command = main.get_command(click.Context(main), name)
        assert command is not None and section.startswith(f"gac {name}\n")
        options = {option for each in command.params for option in each.opts if option.startswith("-")}
        assert [option for option in options if option not in section] == [], name
        examples = section.partition("| option | description |")[2]
        assert f"\ngac {name}" in examples or "Examples" not in (command.epilog or "")


def test_the_gallery_has_every_picture_of_the_pages() -> None:
    found = gallery.of_pages()
    expected = {path.relative_to(ROOT).as_posix() for path in DOCS.iterdir() if path.suffix in (".png", ".svg", ".gif")}
    assert {each.path for each in found} == expected and len(found) >= 4
    assert all(len(each.caption) > 10 for each in found)
    growth = next(each for each in found if each.path.endswith("growth.svg"))
    assert "`make bench PAGE=growth`" in growth.made_by and "(/docs/growth.md)" in growth.made_by
    text = gallery.page(found)
    assert "{figure} /docs/growth.svg" in text
    shown = re.findall(r'src="scenes/(.*?)"', text)
    assert len(shown) == len(set(shown)) >= 7 and "index-mirror_scene.html" in shown
    assert text.count("\nmirror_scene\n") == 1, "the program of each scene is shown"


def test_the_gallery_has_stored_pictures_of_notebooks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = """{"cells": [
        {"cell_type": "markdown", "source": ["# Title\\n", "\\n", "Two circles. They meet."]},
        {"cell_type": "code", "source": [], "outputs": [{"data": {"image/png": "iVBORw=="}}, {"data": {}}]}]}"""
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "notebooks" / "circles.ipynb").write_text(notebook)
    monkeypatch.setattr(gallery, "ROOT", tmp_path)
    monkeypatch.setattr(gallery, "notebooks", lambda: [tmp_path / "notebooks" / "circles.ipynb"])
    (found,) = gallery.of_notebooks(tmp_path)
    assert found.caption == "Two circles." and "[Title](/notebooks/circles.ipynb)" in found.made_by
    assert (tmp_path / found.path).read_bytes() == b"\x89PNG"


def test_markdown_is_read_like_in_repository_browsers() -> None:
    text = "# A `b`, *c*\n\n## A\n\n## A\n\n[x](y.md#a) `[no](z.md)` ![the *p*](q.png)\n\n```\n[no](w.md)\n```\n"
    assert headings(text) == ["A b, c", "A", "A"] and anchors(text) == {"a-b-c", "a", "a-1"}
    assert links(text) == ["y.md#a", "q.png"] and images(text) == [("q.png", "the *p*")]
    assert table(("a", "b"), [("`x | y`", "")]).splitlines()[2] == "| `x \\| y` |  |"
    assert first_sentence("Of `a`, e.g. b.\nThe next. And so on.") == "Of `a`, e.g. b."
