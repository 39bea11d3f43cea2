"""Macros of xacro in robot descriptions: properties, expressions, conditions, macros and includes.

They are those of http://wiki.ros.org/xacro. A description cannot run programs, and reads no files but its includes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .errors import DescriptionError
from .expressions import MOST, NAMES, evaluated
from .packages import folders_of

Element = ElementTree.Element

_PARTS = re.compile(r"\$\$(?=[{(])|\$\{([^{}]*)\}|\$\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
_PARAMETER = re.compile(
    r"(\*{0,2})([\w.]+)(?:\s*(:?=)\s*(\^\|?)?((?:'[^']*'|\"[^\"]*\"|\$\{[^}]*\}|\$\([^)]*\)|[^\s'\"])*))?(?:\s+|$)"
)
_SIGNS = ("${", "$(")
_MOST_NESTED = 100
"""Macros and includes may be nested so often, those of people far less."""


def has_macros(root: Element) -> bool:
    """Return whether a description must be expanded: it has elements of xacro, or expressions."""
    return any(
        _is_macro(each.tag) or any(sign in text for text in (each.text or "", *each.attrib.values()) for sign in _SIGNS)
        for each in root.iter()
    )


def expanded(root: Element, arguments: Mapping[str, object], folder: Path | None, where: str) -> Element:
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
    found = _Expansion({name: str(value) for name, value in arguments.items()}, folder, where)
    result = Element(root.tag, {key: found.text(value, found.root) for key, value in root.attrib.items()})
    try:
        result.extend(found.children(root, found.root, folder))
    except RecursionError:
        raise DescriptionError(f"{where}: elements that are nested too often") from None
    if unknown := sorted(arguments.keys() - found.declared):
        raise DescriptionError(
            f"{where}: no argument {unknown[0]!r}; expected some of {', '.join(sorted(found.declared)) or 'none'}"
        )
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
        return next((scope.names[name] for scope in self._visible() if name in scope.names), None)

    def remove(self, name: str) -> None:
        for scope in self._visible():
            scope.names.pop(name, None)

    def _visible(self) -> Iterator[_Scope]:
        scope: _Scope | None = self
        while scope is not None:
            yield scope
            scope = scope.outer


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

    def __init__(self, arguments: dict[str, str], folder: Path | None, where: str) -> None:
        self.root = _Scope()
        self.declared: set[str] = set()
        self._arguments = arguments
        self._macros: dict[str, _Macro] = {}
        self._where = where
        self._depth = self._count = 0
        self._folder = folder

    # Elements.

    def children(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        """Return the elements inside of an element, expanded."""
        found: list[Element] = []
        outer, self._folder = self._folder, folder
        for child in element:
            found += self._expanded(child, scope, folder)
        self._folder = outer
        return found

    def _nested(self, what: str, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        """Return the elements inside of a macro or an included file, expanded."""
        self._depth += 1
        if self._depth > _MOST_NESTED:
            raise self._error(f"{what}: macros and includes nested more than {_MOST_NESTED} times")
        found = self.children(element, scope, folder)
        self._depth -= 1
        return found

    def _expanded(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        self._counted(1)
        if not _is_macro(element.tag):
            found = Element(element.tag, {key: self.text(value, scope) for key, value in element.attrib.items()})
            if element.text:
                found.text = self.text(element.text, scope)
            found.extend(self.children(element, scope, folder))
            return [found]
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
        return known.get(_local(element.tag), self._call)(element, scope, folder)

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
        if self._truth(element, "remove", False, scope):
            if "value" in element.attrib or "default" in element.attrib:
                raise self._error(f"property {name!r}: remove and a value; expected one of them")
            scope.remove(name)
            return []
        text = element.get("value")
        if text is None and "default" in element.attrib:
            if scope.find(name) is not None:
                return []
            text = element.get("default")
        if text is None:
            target.names[name] = _Property(self.children(element, scope, folder))
        elif target is scope and self._truth(element, "lazy_eval", True, scope):
            target.names[name] = _Property(text, scope)
        else:
            target.names[name] = _Property(self.value(text, scope))
        return []

    def _macro(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name = self._attribute(element, "name", scope).removeprefix("xacro:")
        found, params = [], element.get("params", "")
        if rest := _PARAMETER.sub("", params).strip():
            raise self._error(f"<xacro:macro> {name}: {rest!r} in params={params!r}; expected names and defaults")
        for stars, own, sign, outer, default in _PARAMETER.findall(params):
            # A default in quotes may contain spaces.
            is_quoted = len(default) > 1 and default[0] == default[-1] and default[0] in "'\""
            value = default[1:-1] if is_quoted else default
            found.append(_Parameter(own, len(stars), bool(outer), value if sign and outer != "^" else None))
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
        if (block := next(blocks, None)) is not None:
            raise self._error(f"<xacro:{name}>: <{_local(block.tag)}> is an element more than the macro takes")
        return self._nested(f"<xacro:{name}>", macro.body, inner, macro.folder)

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
        return self._nested(f"include of {name}", root, scope, path.parent)

    def _argument(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        name, default = self._attribute(element, "name", scope), element.get("default")
        self.declared.add(name)
        if name not in self._arguments:
            if default is None:
                raise self._error(f"no argument {name!r}; pass arguments={{{name!r}: ...}}")
            self._arguments[name] = self.text(default, scope)
        return []

    def _condition(self, element: Element, scope: _Scope, folder: Path | None) -> list[Element]:
        is_met = self._truth(element, "value", None, scope) == (_local(element.tag) == "if")
        return self.children(element, scope, folder) if is_met else []

    def _truth(self, element: Element, key: str, default: bool | None, scope: _Scope) -> bool:
        if default is not None and key not in element.attrib:
            return default
        given = self._attribute(element, key, scope)
        is_word = given.lower() in ("true", "false")
        try:
            return given.lower() == "true" if is_word else bool(float(given))
        except ValueError:
            raise self._error(
                f"<xacro:{_local(element.tag)}>: {key} {given!r}; expected true, false or a number"
            ) from None

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
        if any(sign in _PARTS.sub("|", text) for sign in _SIGNS):
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
                self.declared.add(rest)
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
