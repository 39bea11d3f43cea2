"""Operations of clifford's multivectors and arrays, beside ours, on the same numbers.

clifford runs in a process of its own, without numba. Results that differ by convention are listed in `OTHER` with the
reason, and on the page about switching from other libraries.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.peers
pytest.importorskip("clifford")

from clifford_operations import OPERATIONS  # noqa: E402
from rival_operands import COUNT, SPACES, dense, operands  # noqa: E402

from gacompiler.algebra.factorization import join_and_meet  # noqa: E402
from gacompiler.objects.arrays import from_exact  # noqa: E402

DEGENERATE, NULL_PAIR, SMALL = ("PGA2", "PGA3"), ("CGA2", "CGA3"), ("VGA2", "VGA3", "PGA2", "QUATERNIONS")

HERE: dict[str, Callable[..., Any]] = {
    "a * b": lambda s, a, b: a * b,
    "a ^ b": lambda s, a, b: a ^ b,
    "a | b": lambda s, a, b: a.hestenes_product(b),
    "a & b": lambda s, a, b: a & b,
    "a.vee(b)": lambda s, a, b: a.regressive_product(b),
    "a << b": lambda s, a, b: a.left_contraction(b),
    "a.lc(b)": lambda s, a, b: a.left_contraction(b),
    "a + b": lambda s, a, b: a + b,
    "a - b": lambda s, a, b: a - b,
    "-a": lambda s, a: -a,
    "+a": lambda s, a: +a,
    "a + 2": lambda s, a: a + 2,
    "2 - a": lambda s, a: 2 - a,
    "s * a": lambda s, x, a: x * a,
    "a / s": lambda s, a, x: a / x,
    "a / v": lambda s, a, v: a / v,
    "2 / v": lambda s, v: 2 / v,
    "a ^ 2": lambda s, a: a ^ 2,
    "a | 2": lambda s, a: a.hestenes_product(2),
    "a ** 0": lambda s, a: a**0,
    "a ** 2": lambda s, a: a**2,
    "a ** 3": lambda s, a: a**3,
    "2 ** B": lambda s, a: 2**a,
    "~a": lambda s, a: a.reverse(),
    "a.adjoint()": lambda s, a: a.reverse(),
    "a.gradeInvol()": lambda s, a: a.grade_involution(),
    "a.conjugate()": lambda s, a: a.clifford_conjugate(),
    "a.even": lambda s, a: a.even_part(),
    "a.odd": lambda s, a: a.odd_part(),
    "a(0)": lambda s, a: a.grade(0),
    "a(1)": lambda s, a: a.grade(1),
    "a(1, 2)": lambda s, a: a.grade(1, 2),
    "a.mag2()": lambda s, a: a.norm_squared(),
    "abs(a)": lambda s, a: abs(a),
    "a.normal()": lambda s, a: a / a.norm(),
    "v.normal()": lambda s, a: a.normalize(),
    "v.inv()": lambda s, a: a.inverse(),
    "R.inv()": lambda s, a: a.inverse(),
    "V.normalInv()": lambda s, a: a.inverse(),
    "a.inv()": lambda s, a: a.inverse(),
    "a.hitzer_inverse()": lambda s, a: a.inverse(),
    "a.shirokov_inverse()": lambda s, a: a.inverse(),
    "a.leftLaInv()": lambda s, a: a**-1,
    "a.dual()": lambda s, a: a.dual() if s in (SPACES["PGA2"], SPACES["PGA3"]) else a.polarity(),
    "a.dual(P)": lambda s, a, p: a / p,
    "a.right_complement()": lambda s, a: a.dual(),
    "a.left_complement()": lambda s, a: a.undual(),
    "a.x(b)": lambda s, a, b: a.commutator(b),
    "B.commutator(v)": lambda s, a, b: a.commutator(b),
    "a.anticommutator(b)": lambda s, a, b: a.anticommutator(b),
    "B.exp()": lambda s, a: a.exp(),
    "simple.exp()": lambda s, a: a.exp(),
    "c.exp()": lambda s, a: a.exp(),
    "P.project(v)": lambda s, p, v: v.project(p),
    "P.project(a)": lambda s, p, a: a.left_contraction(p) / p,
    "R a ~R": lambda s, r, a: r >> a,
    "V a* ~V": lambda s, r, a: r >> a,
    "isBlade": lambda s, a: a.is_blade(),
    "isBlade of R": lambda s, a: a.is_blade(),
    "isVersor": lambda s, a: a.is_versor(),
    "isVersor of a": lambda s, a: a.is_versor(),
    "grades": lambda s, a: [list(x.grades()) for x in a],
    "grades of R": lambda s, a: [list(x.grades()) for x in a],
    "astype": lambda s, a: s.of(a.layout, np.asarray(a.values, np.float32)),
    "round": lambda s, a: round(a, 3),
    "blades_list": lambda s, a: a["1"] + sum(a[name] * getattr(s, name) for name in a.layout.blades[1:]),
    "a == a": lambda s, a: a == a * 1.0,
    "left matrix": lambda s, a, b: a * b,
    "right matrix": lambda s, a, b: a * b,
    "pseudoScalar": lambda s, a: s.pseudoscalar,
    "invPS": lambda s, a: s.pseudoscalar.inverse(),
    "Frame.En": lambda s, v, w: v ^ w,
    "MVArray.sum": lambda s, *x: sum(x),
    "MVArray.gp": lambda s, *x: np.prod(np.stack(x), axis=0),
    "MVArray.op": lambda s, *x: x[0] ^ x[1] ^ x[2],
}
"""The counterpart of each operation; join, meet, factorise and basis have tests of their own."""

OTHER: dict[tuple[str, str], str] = {
    **{(name, space): "the complement of a blade depends on the basis, e0 and einf or e4 and e5" for name in (
        "a.right_complement()", "a.left_complement()") for space in NULL_PAIR},
    **{(name, space): "another basis has other coefficients" for name in ("round", "astype") for space in NULL_PAIR},
    **{("c.exp()", space): "takes our compiler seconds" for space in SPACES if space not in SMALL},
    ("isVersor of a", "QUATERNIONS"): "here every quaternion but 0 is a versor, as Hamilton named it",
    **{("invPS", space): "the pseudoscalar has no inverse" for space in DEGENERATE},
    **{(name, "QUATERNIONS"): "in algebras of numbers ~q is the conjugate, and norms are those of numbers" for name in (
        "~a", "a.adjoint()", "a.mag2()", "abs(a)", "a.normal()", "v.normal()", "R a ~R", "V a* ~V")},
}  # fmt: skip
"""Results that differ on purpose, by operation and space."""
NEGATIVE = {"a & b", "a.vee(b)", "pseudoScalar", "invPS", "a.dual()"}
"""Results that have the other sign in CGA2, whose pseudoscalar is e012inf, ``-e1 ^ e2 ^ e3 ^ e4`` of clifford."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("clifford")
    given = {}
    for name, space in SPACES.items():
        algebra = space.algebra
        gram = [[int(x) for x in row] for row in algebra.gram]
        blades = [([k for k in range(algebra.dimension) if s.blade >> k & 1], s.sign) for s in algebra.full.stored]
        rows = {key: np.asarray(x) if key == "s" else dense(name, x) for key, x in operands(name).items()}
        given[name] = gram, blades, rows
    with open(folder / "operands.pickle", "wb") as file:
        pickle.dump(given, file)
    command = [sys.executable, "-m", "clifford_operations", str(folder / "operands.pickle"), str(folder / "results")]
    paths = os.pathsep.join([str(Path(__file__).parents[1] / "support"), *sys.path])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths, "PYTHONWARNINGS": "ignore"}
    subprocess.run(command, env=environment, check=True)
    with open(folder / "results", "rb") as file:
        found: dict[str, dict[str, Any]] = pickle.load(file)
    return found


@pytest.fixture(autouse=True)
def without_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAC_BACKEND", "arrays")


def same(name: str, mine: Any, theirs: list[Any], sign: float) -> bool:
    """Whether results agree, relative to the largest coefficient; booleans and lists have to be equal."""
    if isinstance(theirs[0], (bool, np.bool_)):
        return list(map(bool, np.broadcast_to(mine, len(theirs)))) == list(map(bool, theirs))
    if isinstance(theirs[0], list):
        return bool(mine == theirs)
    rows = sign * np.stack([dense(name, x) if np.ndim(x) == 0 else x for x in theirs])
    found = np.broadcast_to(dense(name, mine), rows.shape)
    return bool(np.allclose(found, rows, rtol=0, atol=1e-9 * max(1.0, np.abs(rows).max())))


@pytest.mark.parametrize("space", SPACES)
def test_operations(results: dict[str, dict[str, Any]], space: str) -> None:
    """On arrays, and on the first elements of these alone."""
    given, wrong, compared = operands(space), [], 0
    for name, function in HERE.items():
        letters = OPERATIONS[name][0].split()
        if (name, space) in OTHER:
            continue
        theirs = results[space][name]
        sign = -1.0 if name in NEGATIVE and space == "CGA2" else 1.0
        mine = function(SPACES[space], *(given[each] for each in letters))
        if any(isinstance(each, str) for each in theirs) or not same(space, mine, theirs, sign):
            wrong.append((name, mine, theirs))
        if not name.startswith(("grades", "MVArray.gp")):
            alone = function(SPACES[space], *(given[each][0] for each in letters))
            if not same(space, alone, theirs[:1], sign):
                wrong.append((f"{name}, one element", alone, theirs[0]))
        compared += 1
    assert not wrong, wrong[:3]
    assert compared == len(HERE) - sum(where == space for _, where in OTHER)


@pytest.mark.parametrize("space", [name for name in SPACES if name not in ("VGA2", "QUATERNIONS")])
def test_subspaces(results: dict[str, dict[str, Any]], space: str) -> None:
    """Joins and meets of planes as subspaces are the same up to a factor; factors span the same plane."""
    given = operands(space)
    for k in range(COUNT):
        p, q = (x.layout.element([float(value) for value in x.values[k]]) for x in (given["P"], given["Q"]))
        for name, mine in zip(("join", "meet"), join_and_meet(p, q, 1e-9), strict=True):
            theirs = results[space][name][k]
            if isinstance(theirs, str) or not np.isfinite(theirs).all():
                assert space in (*DEGENERATE, *NULL_PAIR, "STA", "G(2,2)"), theirs  # clifford divides by null blades
                continue
            row = dense(space, from_exact(mine))
            cosine = row @ theirs / np.linalg.norm(row) / np.linalg.norm(theirs)
            assert abs(cosine) == pytest.approx(1, abs=1e-9), (name, k)
        weight, vectors = given["P"][k].factorize()
        assert (weight * vectors[0] ^ vectors[1]).isclose(given["P"][k])
        factors, scale = results[space]["factorise"][k]
        assert abs(weight) == pytest.approx(scale) or space in DEGENERATE
        for factor in factors:
            vector = SPACES[space].of(SPACES[space].algebra.full, np.asarray(factor)).grade(1)
            assert (vector ^ given["P"][k]).isclose(0, atol=1e-9)
