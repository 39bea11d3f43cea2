"""Macros of xacro in robot descriptions: properties, expressions, conditions, macros and includes.

They are those of http://wiki.ros.org/xacro. A description cannot run programs, and reads no files but its includes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .errors import DescriptionError
from .expressions import MOST, NAMES, evaluated
from .packages import folders_of

Element = ElementTree.Element

_PARTS = re.compile(r"\$\$(?=[{(])|\$\{([^{}]*)\}|\$\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
_PARAMETER = re.compile(r"(\*{0,2})([\w.]+)(?:(?::=|=)(\^\|?)?((?:'[^']*'|\"[^\"]*\"|\$\{[^}]*\}|[^\s'\"])*))?")
_MOST_NESTED = 100
"""Macros and includes may be nested so often, those of people far less."""


def has_macros(root: Element) -> bool:
    """Return whether a description must be expanded: it has elements of xacro, or expressions in attributes."""
    return any(_is_macro(each.tag) or any("${" in text for text in each.attrib.values()) for each in root.iter())


def expanded(root: Element, arguments: Mapping[str, Any], folder: Path | None, where: str) -> Element:
    """Return a description without macros.

    Parameters
    ----------
    root : Element
    arguments : mapping of str
        Values of the arguments that the description declares (``<xacro:arg>``).
    folder : Path or None
        Where includes are searched; None for texts, which may not include files.
    where : str
        How errors name the description.

    Raises
    ------
    DescriptionError
        If a macro, property or argument is unknown or missing, or an expression is none of those supported.
    OSError
        If an included file cannot be read.
    """
    found = _Expansion({name: str(value) for name, value in arguments.items()}, where)
    result = Element(root.tag, {key: found.text(value, found.root) for key, value in root.attrib.items()})
    result.extend(found.children(root, found.root, folder))
    return result


@dataclass(slots=True)
class _Property:
    """A property: a text that is evaluated where it is used first, or a value, or elements."""

    value: Any
    scope: _Scope | None = None


class _Scope:
    """Names of properties; those of the calling scope are visible, too."""

    def __init__(self, outer: _Scope | None = None) -> None:
        self.names: dict[str, _Property] = {}
        self.outer = outer

    def find(self, name: str) -> _Property | None:
        scope: _Scope | None = self
        while scope is not None:
            if name in scope.names:
                return scope.names[name]
            scope = scope.outer
        return None


@dataclass(frozen=True, slots=True)
class _Parameter:
    """A parameter of a macro. `stars` is 1 for an element and 2 for the contents of one."""

    name: str
    stars: int
    takes_outer: bool
    default: str | None


@dataclass(frozen=True, slots=True)
class _Macro:
    parameters: tuple[_Parameter, ...]
    body: Element
    folder: Path | None


class _Expansion:
    """The expansion of one description."""

    def __init__(self, arguments: dict[str, str], where: str) -> None:
        self.root = _Scope()
        self._arguments = arguments
        self._macros: dict[str, _Macro] = {}
        self._where = where
        self._depth = self._count = 0
        self._folder: Path | None = None

    # Elements.

    def children(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        """Return the elements inside of an element, expanded."""
        self._depth += 1
        if self._depth > _MOST_NESTED:
            raise self._error(f"<{_local(element.tag)}>: elements nested more than {_MOST_NESTED} times")
        found = [part for child in element for part in self._expanded(child, scope, folder)]
        self._depth -= 1
        return found

    def _expanded(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        self._counted(1)
        self._folder = folder
        if not _is_macro(element.tag):
            found = Element(element.tag, {key: self.text(value, scope) for key, value in element.attrib.items()})
            if element.text:
                found.text = self.text(element.text, scope)
            found.extend(self.children(element, scope, folder))
            return [found]
        name = _local(element.tag)
        known: Mapping[str, Callable[[Element, _Scope, Path | None], list[Element]]] = {
            "property": self._property,
            "macro": self._macro,
            "include": self._include,
            "arg": self._argument,
            "if": self._condition,
            "unless": self._condition,
            "insert_block": self._block,
            "call": self._call,
        }
        return known.get(name, self._call)(element, scope, folder)

    def _counted(self, count: int) -> None:
        self._count += count
        if self._count > MOST:
            raise self._error(f"more than {MOST} elements; expected macros that end")

    def _property(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name = self._attribute(element, "name", scope)
        if not name.isidentifier():
            raise self._error(f"property {name!r}; expected letters, digits and underscores")
        where = element.get("scope", "local")
        if where not in ("local", "parent", "global"):
            raise self._error(f"property {name!r}: scope {where!r}; expected parent or global")
        target = {"local": scope, "parent": scope.outer or scope, "global": self.root}[where]
        text = element.get("value")
        if text is None and "default" in element.attrib:
            if scope.find(name) is not None:
                return []
            text = element.get("default")
        if text is None:
            target.names[name] = _Property(self.children(element, scope, folder))
        elif target is scope:
            target.names[name] = _Property(text, scope)
        else:
            target.names[name] = _Property(self.value(text, scope))
        return []

    def _macro(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name = self._attribute(element, "name", scope).removeprefix("xacro:")
        found = []
        for stars, own, outer, default in _PARAMETER.findall(element.get("params", "")):
            # A default in quotes may contain spaces.
            is_quoted = len(default) > 1 and default[0] == default[-1] and default[0] in "'\""
            has_default = f"{own}:=" in element.get("params", "") or f"{own}=" in element.get("params", "")
            value = default[1:-1] if is_quoted else default
            found.append(_Parameter(own, len(stars), bool(outer), value if has_default and outer != "^" else None))
        self._macros[name] = _Macro(tuple(found), element, folder)
        return []

    def _call(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        given = dict(element.attrib)
        name = _local(element.tag)
        if name == "call":
            name = self.text(given.pop("macro", ""), scope)
        if name not in self._macros:
            names = ", ".join(self._macros) or "none"
            raise self._error(f"<xacro:{name}>: no such macro; expected one of {names}, defined before it is called")
        macro = self._macros[name]
        inner = _Scope(scope)
        blocks = iter(self.children(element, scope, folder))
        for parameter in macro.parameters:
            own = parameter.name
            if parameter.stars:
                block = next(blocks, None)
                if block is None:
                    raise self._error(
                        f"<xacro:{name}>: no element for {'*' * parameter.stars}{own}; expected one inside"
                    )
                inner.names[own] = _Property([block] if parameter.stars == 1 else list(block))
            elif own in given:
                inner.names[own] = _Property(self.value(given.pop(own), scope))
            elif parameter.takes_outer and (outer := scope.find(own)) is not None:
                inner.names[own] = outer
            elif parameter.default is not None:
                inner.names[own] = _Property(self.value(parameter.default, scope))
            else:
                raise self._error(f"<xacro:{name}>: no {own}; expected a value for it")
        if given:
            raise self._error(f"<xacro:{name}>: {next(iter(given))} is no parameter of the macro")
        return self.children(macro.body, inner, macro.folder)

    def _include(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name = self._attribute(element, "filename", scope)
        if "ns" in element.attrib:
            raise self._error(f"include of {name}: names in a namespace (ns) are not supported")
        if folder is None and not Path(name).is_absolute():
            raise self._error(f"include of {name}: a text has no folder; pass the name of a file")
        path = (folder or Path()) / name
        try:
            root = ElementTree.parse(path).getroot()
        except ElementTree.ParseError as error:
            raise DescriptionError(f"{path}: not XML ({error})") from None
        return self.children(root, scope, path.parent)

    def _argument(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name, default = self._attribute(element, "name", scope), element.get("default")
        if name not in self._arguments:
            if default is None:
                raise self._error(f"no argument {name!r}; pass arguments={{{name!r}: ...}}")
            self._arguments[name] = self.text(default, scope)
        return []

    def _condition(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        given = self._attribute(element, "value", scope)
        value = {"true": True, "false": False}.get(given.lower())
        if value is None:
            try:
                value = bool(float(given))
            except ValueError:
                raise self._error(
                    f"<xacro:{_local(element.tag)}>: {given!r}; expected true, false or a number"
                ) from None
        return self.children(element, scope, folder) if value == (_local(element.tag) == "if") else []

    def _block(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name = self._attribute(element, "name", scope)
        found = scope.find(name)
        if found is None or not isinstance(found.value, list) or not all(isinstance(x, Element) for x in found.value):
            raise self._error(f"insert_block of {name!r}; expected a parameter *{name} or a property with elements")
        self._counted(sum(1 for block in found.value for _ in block.iter()))
        return found.value

    def _attribute(self, element: Element, key: str, scope: _Scope) -> str:
        if key not in element.attrib:
            raise self._error(f"<xacro:{_local(element.tag)}>: no {key}; expected one")
        return self.text(element.attrib[key], scope)

    # Texts.

    def text(self, text: str, scope: _Scope) -> str:
        """Return a text with the values of its expressions."""
        value = self._evaluated(text, scope)
        return value if isinstance(value, str) else str(value)

    def value(self, text: str, scope: _Scope) -> Any:
        """Return the value of a text: that of its only expression, a number, a truth value, or a text."""
        value = self._evaluated(text, scope)
        if not isinstance(value, str):
            return value
        if len(value) > 1 and value[0] == value[-1] and value[0] in "'\"":
            return value[1:-1]
        if value.strip().lower() in ("true", "false"):
            return value.strip().lower() == "true"
        for kind in (int, float):
            try:
                return kind(value) if "_" not in value else value
            except ValueError:
                continue
        return value

    def _evaluated(self, text: str, scope: _Scope) -> Any:
        """Return a text with the values of its expressions; the value itself if there is nothing else."""
        whole = _PARTS.fullmatch(text)
        if whole is not None and text[:2] != "$$":
            return self._part(whole, scope)
        found = _PARTS.sub(lambda part: str(self._part(part, scope)), text)
        if "${" in _PARTS.sub("", text):
            raise self._error(f"{text!r}: an expression that does not end")
        if len(found) > MOST:
            raise self._error(f"a text of more than {MOST} letters")
        return found

    def _part(self, part: re.Match[str], scope: _Scope) -> Any:
        if part[0] == "$$":
            return "$"
        if part[1] is not None:
            return self._expression(part[1], scope)
        command, _, rest = part[2].strip().partition(" ")
        rest = rest.strip()
        match command:
            case "arg":
                if rest not in self._arguments:
                    raise self._error(f"no argument {rest!r}; pass arguments={{{rest!r}: ...}}")
                return self._arguments[rest]
            case "eval":
                return self._expression(rest, scope)
            case "dirname" if self._folder is not None:
                return str(self._folder)
            case "find":
                return str(self._package(rest))
        raise self._error(f"$({part[2]}); expected arg, eval, find or dirname")

    def _package(self, name: str) -> Path:
        """Return the folder of a package above the file."""
        found = None if self._folder is None else next(folders_of(name, self._folder.resolve()), None)
        if found is None:
            raise self._error(f"$(find {name}): no folder or package.xml of that name above the file")
        return found

    # Expressions.

    def _expression(self, text: str, scope: _Scope) -> Any:
        try:
            return evaluated(text, lambda name: self._name(name, scope))
        except DescriptionError:
            raise
        except (TypeError, ValueError, ArithmeticError, LookupError) as error:
            raise self._error(f"${{{text}}}: {error}") from None

    def _name(self, name: str, scope: _Scope) -> Any:
        found = scope.find(name)
        if found is None:
            if name in NAMES:
                return NAMES[name]
            raise LookupError(f"no property {name!r}")
        if found.scope is not None:
            text, inside = found.value, found.scope
            found.scope = None
            found.value = _Unfinished
            found.value = self.value(text, inside)
        if found.value is _Unfinished:
            raise LookupError(f"the property {name!r} refers to itself")
        return found.value

    def _error(self, message: str) -> DescriptionError:
        return DescriptionError(f"{self._where}: {message}")


def _is_macro(tag: str) -> bool:
    return tag.startswith("{") and "xacro" in tag.partition("}")[0]


class _Unfinished:
    """The value of a property that is being evaluated."""


def _local(tag: str) -> str:
    return tag.rpartition("}")[2].removeprefix("xacro:")
