"""Names of basis blades, parsed in any spelling and printed in one.

``e12`` is the outer product of ``e1`` and ``e2``; ``e21``, ``e2e1`` and ``e2^e1`` are its negative. The name of a
vector is a letter and a label. Labels may be joined after one letter as long as the result is unambiguous.
"""

from __future__ import annotations

from itertools import pairwise

from ..errors import AlgebraError


class BladeNames:
    """Parser and printer of the names of the basis blades of an algebra."""

    def __init__(self, algebra: str, vectors: tuple[str, ...], spellings: tuple[str, ...]) -> None:
        if len(set(vectors)) != len(vectors) or not all(name.isidentifier() for name in vectors):
            raise AlgebraError(algebra, f"basis vectors {' '.join(vectors)}", "distinct names like e1 e2 einf")
        self._algebra = algebra
        self._vectors = vectors
        self._index = {name: k for k, name in enumerate(vectors)}
        labels = sorted((name[0], name[1:]) for name in vectors)
        self._run_together = all(label for _, label in labels) and not any(
            a[0] == b[0] and b[1].startswith(a[1]) for a, b in pairwise(labels)
        )
        self._known: dict[str, tuple[int, int]] = {"1": (1, 0)}
        self._spelled: dict[int, tuple[int, str]] = {0: (1, "1")}
        for spelling in spellings:
            sign, blade = self.parse(spelling)
            self._spelled[blade] = (sign, spelling)

    def parse(self, spelling: str) -> tuple[int, int]:
        """Return the sign and bitmap of a blade from its name.

        Raises
        ------
        AlgebraError
            If the name is not a blade of the algebra, is ambiguous, or contains a vector twice.
        """
        if spelling not in self._known:
            self._known[spelling] = self._sorted(spelling, self._read(spelling))
        return self._known[spelling]

    def spell(self, blade: int) -> tuple[int, str]:
        """Return the sign and preferred name of the blade of a bitmap."""
        if blade not in self._spelled:
            names = [name for k, name in enumerate(self._vectors) if blade >> k & 1]
            if self._run_together:
                text = names[0] + "".join(
                    name[1:] if name[0] == before[0] else name for before, name in pairwise(names)
                )
            else:
                text = "^".join(names)
            self._spelled[blade] = (1, text)
        return self._spelled[blade]

    def _read(self, spelling: str) -> list[int]:
        if "^" in spelling:
            names = [name.strip() for name in spelling.split("^")]
            if all(name in self._index for name in names):
                return [self._index[name] for name in names]
            readings: list[list[int]] = []
        elif spelling in self._index:
            readings = [[self._index[spelling]]]
        else:
            readings = self._readings(spelling, "")
            readings = [reading for reading in readings if len(set(reading)) == len(reading)] or readings[:1]
        if not readings or not readings[0]:
            example = self.spell(3)[1] if len(self._vectors) > 1 else "1"
            raise AlgebraError(
                f"blade {spelling!r}",
                f"not a blade of {self._algebra}",
                f"1 or products of its basis vectors {' '.join(self._vectors)}, such as {example}",
            )
        if len(readings) > 1:
            raise AlgebraError(
                f"blade {spelling!r}", f"ambiguous in {self._algebra}: {len(readings)} readings", "vectors joined by ^"
            )
        return readings[0]

    def _readings(self, text: str, letter: str) -> list[list[int]]:
        if not text:
            return [[]]
        found = []
        for name, k in self._index.items():
            for token in {name, name[1:]} if name[0] == letter else {name}:
                if token and text.startswith(token):
                    found += [[k, *rest] for rest in self._readings(text[len(token) :], name[0])]
        return found

    def _sorted(self, spelling: str, indices: list[int]) -> tuple[int, int]:
        if len(set(indices)) != len(indices):
            raise AlgebraError(f"blade {spelling!r}", "a basis vector occurs twice", "each vector at most once")
        inversions = sum(a > b for i, a in enumerate(indices) for b in indices[i + 1 :])
        return (-1 if inversions & 1 else 1), sum(1 << k for k in indices)
