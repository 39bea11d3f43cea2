"""Write a page of public names for each package and module that users import from, without lists kept by hand."""

from __future__ import annotations

import ast
import importlib
import inspect
import itertools
import json
import re
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from .markdown import code, directive, first_sentence, table
from .places import CONTENTS, ROOT, notebooks, pages

TOPS = ("gacompiler", "algorithms")
RUNTIME = "gacompiler.gac_runtime.module"
"""The module whose classes generated modules use; they import it from a copy of its package."""
UNLISTED = ("gacompiler.specs",)
"""Packages whose public names are documented elsewhere: kernels, in the pages of generated modules."""

_INHERITED = {"inherited-members": "object,tuple,dict,int,float,str,Enum,BaseException,ndarray"}
"""Inherited members are documented, except those of these classes."""


@dataclass(frozen=True, slots=True)
class Interface:
    """The public names of a module."""

    module: str
    names: tuple[str, ...]

    @property
    def page(self) -> str:
        """The path of the page from the root of the site, without suffix."""
        return f"api/{self.module}"


@cache
def interfaces() -> list[Interface]:
    """Return the interfaces of packages that list public names, of modules that pages import, and of the runtime."""
    packages = {_module_name(path) for top in TOPS for path in (ROOT / top).rglob("__init__.py")}
    listing = {name for name in packages if getattr(importlib.import_module(name), "__all__", None)}
    names = sorted({*listing, *_imported_by_pages(), RUNTIME})
    found = [Interface(name, _public_names(importlib.import_module(name))) for name in names]
    return [each for each in found if each.names]


def page(interface: Interface) -> str:
    """Return the page of a module: its docstring, a table of its names, and the documentation of each."""
    module = importlib.import_module(interface.module)
    found = {name: getattr(module, name) for name in interface.names}
    rows = [(_link(interface, name, value), _summary(interface, name, value)) for name, value in found.items()]
    parts = [f"# {interface.module}\n", directive("automodule", interface.module), table(("name", "description"), rows)]
    here = {
        name: value for name, value in found.items() if home(interface, name, value) == f"{interface.module}.{name}"
    }
    parts += [_entry(interface, name, value) for name, value in here.items()]
    kinds = sorted({_class_path(value) for value in here.values()} - {""})
    if kinds:
        parts += ["## Classes of these objects\n"]
        parts += [directive("autoclass", path, members="", **_INHERITED) for path in kinds]
    return "\n".join(parts)


def home(interface: Interface, name: str, value: Any) -> str:
    """Return the path under which an object is documented. If several packages list it, the outermost one is used.

    The result is empty for modules, which are documented on their own pages.
    """
    if inspect.ismodule(value):
        return ""
    if inspect.isclass(value) or inspect.isroutine(value):
        return _homes().get(id(value), f"{interface.module}.{name}")
    return f"{interface.module}.{name}"


@cache
def _homes() -> dict[int, str]:
    """Return the paths of all public classes and functions by their identity. They live as long as their modules."""
    found: dict[int, str] = {}
    for each in sorted(interfaces(), key=lambda each: (each.module.count("."), each.module)):
        module = importlib.import_module(each.module)
        for name in each.names:
            found.setdefault(id(getattr(module, name)), f"{each.module}.{name}")
    return found


def documented() -> list[str]:
    """Return the paths of all public names, which the site must document."""
    found = set()
    for each in interfaces():
        module = importlib.import_module(each.module)
        found |= {home(each, name, getattr(module, name)) for name in each.names}
    return sorted(found - {""})


def _entry(interface: Interface, name: str, value: Any) -> str:
    """Return the directive that documents an object."""
    path = f"{interface.module}.{name}"
    if inspect.isclass(value):
        kind = "autoexception" if issubclass(value, BaseException) else "autoclass"
        return directive(kind, path, members="", **_INHERITED)
    if inspect.isroutine(value):
        return directive("autofunction", path)
    about = "\n\n".join(filter(None, [_text_of_data(interface, name), f"An object of the type {_type_text(value)}."]))
    return "```{py:data} " + name + f"\n:module: {interface.module}\n\n" + _as_markdown(about) + "\n```\n"


def _text_of_data(interface: Interface, name: str) -> str:
    """Return the text below the assignment of a name, in the module or in a module of its package."""
    for module in sorted(name for name in sys.modules if f"{name}.".startswith(f"{interface.module}.")):
        texts = _texts_of_data(getattr(sys.modules[module], "__file__", None) or "")
        if name in texts:
            return texts[name]
    return ""


@cache
def _texts_of_data(path: str) -> dict[str, str]:
    """Return the texts below the assignments of a file, by name."""
    found = {}
    body = ast.parse(Path(path).read_text()).body if path.endswith(".py") else []
    for node, after in itertools.pairwise(body):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            found |= {
                target.id: inspect.cleandoc(str(after.value.value))
                for target in targets
                if isinstance(target, ast.Name)
            }
    return found


def _type_text(value: Any) -> str:
    path = _class_path(value)
    return "{py:obj}`" + path + "`" if path else code(type(value).__name__)


def _class_path(value: Any) -> str:
    """Return the class of an object that is neither a class nor a function, if it has no documentation elsewhere."""
    kind = type(value)
    is_ours = kind.__module__.startswith("gacompiler.objects.")
    return f"{kind.__module__}.{kind.__qualname__}" if is_ours else ""


def _link(interface: Interface, name: str, value: Any) -> str:
    """Return the name of an object, linked to its documentation."""
    path = home(interface, name, value)
    return "{py:obj}`" + f"{name} <{path}>" + "`" if path else code(name)


def _summary(interface: Interface, name: str, value: Any) -> str:
    """Return a description in one sentence, or the type of an object that has none."""
    if inspect.ismodule(value) or inspect.isclass(value) or inspect.isroutine(value):
        return first_sentence(_as_markdown(inspect.getdoc(value) or ""))
    text = first_sentence(_as_markdown(_text_of_data(interface, name)))
    return text or f"An object of the type `{type(value).__name__}`."


def _as_markdown(text: str) -> str:
    """Convert inline markup of docstrings to Markdown, in which code has one backtick."""
    return re.sub(r"``(.+?)``", r"`\1`", text)


def _public_names(module: ModuleType) -> tuple[str, ...]:
    """Return the names that a module lists, or those that it defines."""
    listed = getattr(module, "__all__", None)
    if listed:
        return tuple(sorted(listed, key=lambda name: (name.lower(), name)))
    if hasattr(module, "__path__"):
        return ()
    found = [name for name, value in vars(module).items() if _is_defined_in(module, name, value)]
    return tuple(sorted(found, key=lambda name: (name.lower(), name)))


def _is_defined_in(module: ModuleType, name: str, value: Any) -> bool:
    if name.startswith("_") or inspect.ismodule(value):
        return False
    if inspect.isclass(value) or inspect.isroutine(value):
        return value.__module__ == module.__name__
    return bool(name.isupper() and re.search(rf"^{name}\b[^\n]*=", inspect.getsource(module), re.MULTILINE))


def _imported_by_pages() -> set[str]:
    """Return the modules of this project from which blocks of pages and cells of notebooks import names."""
    texts = ["\n".join(re.findall(r"```python\n(.*?)```", p.read_text(), re.DOTALL)) for p in (CONTENTS, *pages())]
    for path in notebooks():
        cells = json.loads(path.read_text())["cells"]
        texts += ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    found = set()
    for text in texts:
        for name in re.findall(r"^\s*from ([\w.]+) import ", text, re.MULTILINE):
            if name.split(".")[0] in TOPS and not name.startswith(UNLISTED):
                found.add(name)
    return found


def _module_name(path: Path) -> str:
    return ".".join(path.parent.relative_to(ROOT).parts)
