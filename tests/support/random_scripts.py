"""Random scripts of Gaalop's language: most are well formed; some have an extra, missing or misplaced word."""

from __future__ import annotations

from random import Random

from gacompiler.cluscript.dialects import dialect
from gacompiler.cluscript.functions import FUNCTIONS

ALGEBRAS = ("2d", "3d", "2dpga", "3dpga", "cra", "cga", "sta", "gac", "qga", "ccga", "dcga")
NUMBERS = (
    *("0", "1", "2", "3", "0.5", "2.5", "4.5", "1e3", "1.e-3f", ".25d", "7", "1000", "10", "0.0", "1e200", "1e-200")
    * 4,
    "1e400",
    "1e-400",
    "1e99999",
)
VARIABLES = ("x", "y", "z", "a", "b", "t", "$v", "_w", "class", "out", "nothing", "einf", "e0", "lambda")
PRAGMAS = (
    "#pragma output {v} 1", "#pragma output {v} 1.0", "#pragma output {v} e1 e2", "#pragma output {v} e1^e2 1",
    "#pragma onlyEvaluate {v}", "#pragma range -1 <= {v} <= 2", "#pragma in2out {v} -> {v}", "#pragma normalize",
    "#pragma output {v} e1 e1", "#pragma segments {v} {v}", "#pragma return {v} typed T as x", "#pragma what",
)  # fmt: skip
WORDS = (
    "(",
    ")",
    ";",
    ",",
    "+",
    "-",
    "*",
    "/",
    "^",
    ".",
    "~",
    "?",
    ":",
    "=",
    "{",
    "}",
    "_P(1)",
    "if",
    "**",
    "!",
    '"s"',
    "@",
)


class Writer:
    """Writes scripts for one algebra."""

    def __init__(self, random: Random, algebra: str) -> None:
        chosen = dialect(algebra)
        self._random = random
        self._vectors = [*chosen.constants]
        self._functions = [(name, arity) for name, (arity, _) in FUNCTIONS.items()]
        self._macros = list(chosen.macros)
        self._own: list[tuple[str, int]] = []
        self._known: list[str] = []

    def expression(self, depth: int) -> str:
        """An expression."""
        random = self._random
        kind = random.random()
        if depth <= 0 or kind < 0.12:
            some = (NUMBERS, VARIABLES, self._vectors, self._known or VARIABLES)
            return random.choice(random.choice(some))
        if kind < 0.5:
            operator = random.choice("+-*/^.")
            return f"{self.expression(depth - 1)} {operator} {self.expression(depth - 1)}"
        if kind < 0.6:
            return f"({self.expression(depth - 1)})"
        if kind < 0.68:
            return f"{random.choice(('-', '~', '*'))}{self.expression(depth - 1)}"
        if kind < 0.74:
            second = random.choice(("1", *self._vectors, "e1^e2", self.expression(1)))
            return f"coefficient({self.expression(depth - 1)}, {second})"
        name, arity = random.choice(
            random.choice([each for each in (self._functions, self._macros, self._own) if each])
        )
        arity += random.random() < 0.03
        arguments = [self.expression(depth - 1 if arity < 3 else 0) for _ in range(arity)]
        return f"{name}({', '.join(arguments)})"

    def macro(self) -> str:
        """A macro, which later expressions may call."""
        random = self._random
        name, arity = f"m{len(self._own)}", random.randint(0, 2)
        known, self._known = self._known, [f"_P({k + 1})" for k in range(arity)] or ["x"]
        body = "".join(f"k{k} = {self.expression(2)}; " for k in range(random.randint(0, 2)))
        value = self.expression(2) + random.choice(("", ";"))
        self._known = known
        self._own.append((name, arity))
        if random.random() < 0.1:
            body = body.replace("; ", " ")
        return f"{name} = {{ {body}{value} }}"

    def script(self) -> str:
        """A script."""
        random = self._random
        lines = []
        if random.random() < 0.25:
            lines.append(random.choice(PRAGMAS).format(v=random.choice(("r0", "r1", "x"))))
        if random.random() < 0.25:
            lines.append(self.macro())
        for k in range(random.randint(1, 3)):
            mark = random.choice(("?", "?", "?", ":", "", "!"))
            lines.append(f"{mark}r{k} = {self.expression(random.randint(1, 4))};")
            self._known.append(f"r{k}")
        if random.random() < 0.1:
            lines.append(
                random.choice((":Red;", ":Color(x, 0, 1);", "_BGColor = Color(1, 0, 0);", ":IPNS;", "?x;", ":r0;"))
            )
        return self._damaged("\n".join(lines))

    def _damaged(self, text: str) -> str:
        random = self._random
        while random.random() < 0.15:
            place = random.randrange(len(text) + 1)
            kind = random.random()
            if kind < 0.4:
                text = text[:place] + text[place + random.randint(1, 3) :]
            elif kind < 0.8:
                text = f"{text[:place]}{random.choice(WORDS)}{text[place:]}"
            else:
                text = text[:place] + text[place : place + 20] * random.randint(2, 40) + text[place + 20 :]
        return text


def scripts(seed: int, n: int) -> list[tuple[str, str]]:
    """`n` pairs of an algebra and a script for it."""
    random = Random(seed)
    found = []
    for _ in range(n):
        # Algebras with many blades take longer and have no additional rules.
        algebra = random.choices(ALGEBRAS, [3] * 7 + [1] * 4)[0]
        found.append((algebra, Writer(random, algebra).script()))
    return found
