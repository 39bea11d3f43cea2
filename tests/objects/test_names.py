"""The names that type checkers know of spaces and elements, beside those of the catalog."""

from __future__ import annotations

import ast
from pathlib import Path

import gacompiler.objects
from gacompiler import objects
from gacompiler.algebra.layout import Layout
from tests.support.all_cases import all_cases

STUB = Path(gacompiler.objects.__file__).with_name("names.pyi")
SPACES = {
    "Pga2": objects.PGA2, "Pga3": objects.PGA3, "Cga2": objects.CGA2, "Cga3": objects.CGA3, "Vga2": objects.VGA2,
    "Vga3": objects.VGA3, "Quaternion": objects.QUATERNIONS, "Sta": objects.STA,
}  # fmt: skip


def declared(name: str) -> dict[str, str]:
    """Return the attributes of a class of the stub with their types."""
    for each in ast.parse(STUB.read_text()).body:
        if isinstance(each, ast.ClassDef) and each.name == name:
            return {
                item.target.id: ast.unparse(item.annotation)
                for item in each.body
                if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
            }
    raise AssertionError(name)


@all_cases("name", SPACES)
def test_names_of_blades_and_layouts(name: str) -> None:
    space, blades, of_space = SPACES[name], declared(f"{name}Element"), declared(f"{name}Space")
    one = space.vector(*range(1, space.algebra.dimension + 1))
    canonical = {each for each in space.algebra.full.blades if each.isidentifier()}
    assert canonical <= blades.keys()
    for blade, kind in blades.items():
        assert kind == "Final[Real]" and isinstance(getattr(one, blade), float)
    layouts = {each for each, kind in of_space.items() if kind == "Final[Layout]"}
    assert {*space.algebra.layouts, "full", "even"} <= layouts
    assert all(isinstance(getattr(space, each), Layout) for each in layouts)
    assert of_space.keys() - layouts <= blades.keys()
    assert all(isinstance(getattr(space, each), objects.MultivectorArray) for each in of_space.keys() - layouts)
