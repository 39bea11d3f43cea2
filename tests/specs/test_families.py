"""Kernels of families in specs: their order and names, the places of errors, and the hash of all source texts."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from gacompiler import Family, kernel
from gacompiler.algebra.catalog import PGA2, PGA3
from gacompiler.errors import GacError, KernelError, SpecError
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.spec_files import load_spec

FAMILY = '''
from gacompiler import Family

def motions(algebra, space):
    family = Family("motions", space=space)

    @family.kernel(m=algebra.MOTOR, p=algebra.POINT)
    def move_point(m, p):
        """The point `p` of {space}, moved."""
        return m * p * ~m

    @family.kernel(a=algebra.MOTOR, b=algebra.MOTOR)
    def motor_product(a, b):
        """First `b`, then `a`."""
        return a * b

    return family
'''

SPEC = '''
from gacompiler import kernel
from gacompiler.algebra.catalog import PGA2
from shared import motions

MOTIONS = motions(PGA2, "the plane")
motor_product = MOTIONS.motor_product

@kernel(m=PGA2.MOTOR)
def motor_inverse(m):
    """Back."""
    return ~m

move_point = MOTIONS.move_point
'''


def written(folder: Path, **texts: str) -> Path:
    """Files of these names and texts; the path of that which is called `spec`."""
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)
    return folder / "spec.py"


def test_kernels_of_a_family_are_where_a_spec_assigns_them(tmp_path: Path) -> None:
    spec = load_spec(written(tmp_path, spec=SPEC, shared=FAMILY))
    assert [each.name for each in spec.kernels] == ["motor_product", "motor_inverse", "move_point"]
    assert spec.kernels[2].summary == "The point `p` of the plane, moved."


def test_imported_and_renamed_kernels_are_not_part_of_a_spec(tmp_path: Path) -> None:
    other = SPEC.replace("motor_inverse", "turned_back")
    text = "from other import move_point, turned_back as back\nimport other\nproduct = other.motor_product\n" + SPEC
    spec = load_spec(written(tmp_path, spec=text.replace("\nmove_point", "\nmoved"), shared=FAMILY, other=other))
    assert [each.name for each in spec.kernels] == ["motor_product", "motor_inverse"]


@pytest.mark.parametrize(
    ("more", "line"),
    [
        ("motor_product = MOTIONS.motor_product\n", 15),
        ("first, move_point = MOTIONS.motor_product, MOTIONS.move_point\n", 15),
        ("@kernel(m=PGA2.MOTOR)\ndef move_point(m):\n    return m\n", 16),
    ],
)
def test_a_second_kernel_of_one_name_is_an_error(tmp_path: Path, more: str, line: int) -> None:
    with pytest.raises(SpecError, match=rf"spec\.py:{line}: mo\w+ is defined twice, first on line (7|14)"):
        load_spec(written(tmp_path, spec=SPEC + more, shared=FAMILY))


def test_a_kernel_may_be_made_from_that_of_its_name(tmp_path: Path) -> None:
    more = 'move_point = move_point.documented("""Elsewhere.\n\n    Not here.\n    """)\n'
    kernels = load_spec(written(tmp_path, spec=SPEC + more, shared=FAMILY)).kernels
    assert [each.name for each in kernels] == ["motor_product", "motor_inverse", "move_point"]
    assert kernels[2].summary == "Elsewhere.\n\nNot here."


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (FAMILY.replace("def motor_product(a, b)", "def motor_product(a, c)"), ["shared.py:12: kernel motor_product"]),
        (FAMILY.replace("def motor_product(a, b)", "def move_point(a, b)"), ["shared.py:12", "shared.py:7", "motions"]),
        (FAMILY.replace("{space}", "{place}"), ["shared.py:7: kernel move_point", "'place'", "space"]),
        (FAMILY.replace("def motor_product", "def kernel"), ["shared.py:12: kernel kernel", "method"]),
        (FAMILY.replace("algebra.MOTOR, b", "algebra.MOTORS, b"), ["shared.py:12", "MOTORS"]),
        (FAMILY.replace("    return family", "    return familiar"), ["shared.py:17: NameError"]),
    ],
)
def test_errors_name_the_line_of_the_family_and_that_of_the_spec(tmp_path: Path, wrong: str, words: list[str]) -> None:
    with pytest.raises(GacError) as caught:
        load_spec(written(tmp_path, spec=SPEC, shared=wrong))
    assert all(word in str(caught.value) for word in ["spec.py:6: ", *words]), caught.value


def test_a_kernel_that_a_family_does_not_have_is_named(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"spec\.py:14: AttributeError: the family motions has no kernel move_line"):
        load_spec(written(tmp_path, spec=SPEC.replace("MOTIONS.move_point", "MOTIONS.move_line"), shared=FAMILY))


def test_places_of_kernels_are_in_the_file_of_the_family(tmp_path: Path) -> None:
    kernels = load_spec(written(tmp_path, spec=SPEC, shared=FAMILY)).kernels
    assert kernels[0].where == f"{tmp_path / 'shared.py'}:12: kernel motor_product"
    assert kernels[1].where == f"{tmp_path / 'spec.py'}:9: kernel motor_inverse"


def test_the_hash_covers_what_a_spec_imports(tmp_path: Path) -> None:
    shared = FAMILY + "from deeper import nothing\n"
    path = written(tmp_path, spec=SPEC, shared=shared, deeper="nothing = None\n", unused="")
    digests = {load_spec(path).digest}
    for name, text in (
        ("shared", shared.replace("a * b", "b * a")),
        ("deeper", "nothing = None  # at all\n"),
        ("spec", SPEC.replace("~m", "m")),
    ):
        written(tmp_path, **{name: text})
        digest = load_spec(path).digest
        assert digest not in digests, name
        digests.add(digest)
    written(tmp_path, unused="something = 1\n")
    assert load_spec(path).digest in digests


def test_files_that_import_each_other_are_hashed(tmp_path: Path) -> None:
    path = written(tmp_path, spec=SPEC, shared=FAMILY + "import deeper\n", deeper="import shared\n")
    first = load_spec(path).digest
    assert load_spec(path).digest == first
    written(tmp_path, deeper="import shared  # again\n")
    assert load_spec(path).digest != first


def test_relative_imports_in_a_package_count(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "shared.py").write_text(FAMILY + "from . import deeper\nfrom .deeper import nothing\n")
    (package / "deeper.py").write_text("nothing = None\n")
    path = written(tmp_path, spec=SPEC.replace("from shared", "from package.shared"))
    first = load_spec(path).digest
    (package / "deeper.py").write_text("nothing = None  # at all\n")
    assert load_spec(path).digest != first


@pytest.mark.parametrize(
    ("imported", "counts"),
    [("gacompiler.algebra.catalog", False), ("math", False), ("gacompiler.specs.pga3", True)],
)
def test_libraries_and_the_compiler_are_not_hashed(tmp_path: Path, imported: str, counts: bool) -> None:
    text = f"import {imported}\n" + SPEC.replace("from shared import motions\n", "") + FAMILY
    text = text.replace("\nMOTIONS = ", FAMILY + "\nMOTIONS = ")
    digest = load_spec(written(tmp_path, spec=text)).digest
    assert (digest != hashlib.sha256(text.encode()).hexdigest()[:16]) == counts


def test_an_edited_family_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path, spec=SPEC, shared=FAMILY)
    assert load_spec(path).kernels[0].summary == "First `b`, then `a`."
    written(tmp_path, shared=FAMILY.replace("First `b`, then `a`.", "One after the other."))
    assert load_spec(path).kernels[0].summary == "One after the other."


def test_a_family_is_made_for_each_algebra() -> None:
    def family(algebra, space):  # type: ignore[no-untyped-def]
        made = Family("points", space=space)

        @made.kernel(a=algebra.POINT, b=algebra.POINT)
        def join(a, b):  # type: ignore[no-untyped-def]
            """The join in {space}, {{a, b}}."""
            return a & b

        return made

    plane, space = family(PGA2, "the plane").join, family(PGA3, "space").join
    assert plane.parameters[0].layout == PGA2.POINT and space.parameters[0].layout == PGA3.POINT
    assert (plane.summary, space.summary) == ("The join in the plane, {a, b}.", "The join in space, {a, b}.")
    assert plane(*(PGA2.multivector({"e12": 1, "e20": x}) for x in (0, 1))) == PGA2.multivector({"e2": 1})


def test_a_family_has_the_errors_of_kernels() -> None:
    with pytest.raises(KernelError) as plain:
        kernel(a=PGA2.POINT)(lambda b: b)
    with pytest.raises(KernelError) as inside:
        Family("none").kernel(a=PGA2.POINT)(lambda b: b)
    assert str(plain.value).partition(": ")[2] == str(inside.value).partition(": ")[2]


def test_files_of_families_are_not_specs() -> None:
    names = {path.stem for path in own_specs()}
    folder = own_specs()[0].parent
    assert {path.parent for path in own_specs()} == {folder}
    assert "products" in {path.stem for path in (folder / "families").glob("*.py")} - names


def test_families_are_equal_by_what_they_hold() -> None:
    def family(name: str, *kernels: str) -> Family:
        made = Family(name)
        for each in kernels:
            made.kernel(a=PGA2.POINT)(FUNCTIONS[each])
        return made

    assert family("one", "first") == family("one", "first") != family("one", "first", "second")
    assert family("one", "first") != family("two", "first") and family("one", "first") != "one"
    assert len({family("one"), family("one"), family("two")}) == 2
    assert repr(family("one", "first", "second")) == "Family(one: first second)"


def first(a):  # type: ignore[no-untyped-def]
    """The same."""
    return a


def second(a):  # type: ignore[no-untyped-def]
    """The opposite."""
    return -a


FUNCTIONS = {"first": first, "second": second}
