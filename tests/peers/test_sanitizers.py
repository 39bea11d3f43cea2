"""No kernel reads or writes out of bounds, on arrays of any shape and strides, according to the sanitizers of gcc.

The loops of a straight-line kernel are macros of the shapes of its arguments and results. A kernel is compiled if they
handle a shape that no earlier kernel has at that place. A kernel with loops is compiled if it has a kind of access or
loop that no shorter one has: all of a kind are printed by the same lines of the compiler. `test_indices_of_kernels.py`
the indices in the bodies of all kernels and in all parts of loops. Functions are compiled once each, and not again
at every place that calls them: that takes a fifth of the time, and the sanitizers look at each access all the same.
Large modules are compiled for doubles alone: their text is the same for floats, and the macros that it uses are
compiled for floats with smaller modules.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest
from programs import SANITIZED

from gacompiler.backends import library_name, runtime_files
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.files import write

pytestmark = pytest.mark.peers

FLAGS = ["-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-O0", *SANITIZED]
IN_RUNTIME = [*FLAGS, "-fsanitize=null,object-size,pointer-overflow,alignment"]
"""Nothing is left out in the runtime, which passes pointers to modules that are aligned as they expect."""
ROUNDS = 15
LARGE = 40_000
"""Characters of a text from which it is compiled for doubles alone."""
CHANGED = {
    "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3)) GAC_FOR(v4, NAME(name), NAME(name##_v4))":
        "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3))",
    "WIDTHS(name) {NAME(name##_v3), NAME(name##_v4)}": "WIDTHS(name) {NAME(name##_v3), NAME(name##_v3)}",
    "#define INLINE inline __attribute__((always_inline))": "#define INLINE __attribute__((noinline))",
    "static inline __attribute__((always_inline, unused))": "static __attribute__((unused))",
}  # fmt: skip
"""In the header: of the loops for vectors of either width, one text, one is compiled; functions are not inlined."""
MODULES = sorted(path.stem for path in generated_folder().glob("*.c"))
STRAIGHT = re.compile(
    r"^(?:static )?INLINE void(?:(?!^GAC_KERNEL|^GAC_PROCEDURE)[\s\S])*^GAC_KERNEL\w*\((\w+).*$", re.MULTILINE
)
"""A straight-line kernel with its forms, up to the use of the macro that makes its loops."""


LOOPS = re.compile(r"^#define TABLES_(\w+)\([\s\S]*?^GAC_PROCEDURE\w*\(.*\)\n", re.MULTILINE)
"""A kernel with loops, with its parts, from the list of its tables to the use of the macro that makes its batches."""
PART = re.compile(r"^static INLINE \w+ NAME\((\w+)\)", re.MULTILINE)
FUNCTION = re.compile(r"NAME\(\w+?(_lanes)?\)\(([^)]*)\)\n\{\n([\s\S]*?)^\}$", re.MULTILINE)
ROLES = {"intptr_t": "length", "const int64_t *": "index", "const REAL *": "given", "REAL *": "table"}
"""What parameters of these types are; others are numbers."""


def runtime(compiler: str) -> str:
    """The path of the library of the sanitizer, which must be loaded before Python."""
    found = subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    return found.stdout.strip()


def joined(text: str) -> str:
    """Return the text with statements and macros on one line each."""
    return re.sub(r"\s*\\\n\s*|(?<=,)\n +", " ", text)


def accesses(kernel: str) -> set[str]:
    """Return the kinds of accesses, loops and branches of a kernel with loops: what is printed, without names."""
    kinds = set()
    for lanes, parameters, body in FUNCTION.findall(kernel):
        if "NAME(" not in body:
            continue
        roles = dict.fromkeys(re.findall(r"\bintptr_t (\w+) =", body), "counter")
        roles |= dict.fromkeys(re.findall(r"\bREAL (\w+)\[", body), "row")
        for kind, name in re.findall(r"([^,]+? \*?)(\w+)(?:, |$)", parameters):
            roles[name] = ROLES.get(kind, ROLES.get(kind.strip(), "number"))

        def role(found: re.Match[str], roles: dict[str, str] = roles) -> str:
            word = found[0]
            if word.isdigit():
                return "1"
            return word if word.isupper() or word in ("for", "if") else roles.get(word, "local")

        for statement in re.sub(r"NAME\(\w+\)", "PART", body).splitlines():
            arguments = re.sub(r"^PART\((.*)\);$", r"\1", statement.strip())
            for access in re.sub(r"\b\w+\b", role, arguments).split(", "):
                if re.search(r"[\[+*]|for|if", access):
                    kinds.add(f"{lanes} {access.rstrip(' ;){')}")
    return kinds


def representative(texts: dict[str, str]) -> dict[str, str]:
    """Leave out of the texts of modules the kernels with loops of which all accesses are of kinds that others have."""
    kernels = [(len(found[0]), name, found[0]) for name, text in texts.items() for found in LOOPS.finditer(text)]
    known: set[str] = set()
    left_out = []
    for _, name, kernel in sorted(kernels):
        kinds = accesses(kernel)
        if kinds <= known:
            place = f"\0{len(left_out)}\0"
            left_out.append((name, place, kernel))
            texts = {**texts, name: texts[name].replace(kernel, place)}
        known |= kinds
    used = {name: set(re.findall(r"NAME\((\w+?)(?:_lanes)?\)", text)) for name, text in texts.items()}
    for name, place, kernel in left_out:
        # Parts of it that other kernels use are compiled for them.
        parts = [part for part in kernel.split("\n\n") if used[name].intersection(PART.findall(part))]
        texts[name] = texts[name].replace(place, "".join(f"{part}\n\n" for part in parts))
    return texts


def without_known_loops(text: str, earlier: set[tuple[str, ...]]) -> str:
    """Return the joined text of a module without straight-line kernels whose loops have no part that is new."""
    lists = dict(re.findall(r"^#define ((?:PARTS|SAME)_\w+)\(IN, NUMBER, OUT, AND\) (.*)$", text, re.MULTILINE))

    def kernel(found: re.Match[str]) -> str:
        parts: set[tuple[str, ...]] = set()
        for macro, given in re.findall(r"^GAC_(FORM|KERNEL)\w*\((.*)\)$", found[0], re.MULTILINE):
            name, *names = given.split(", ")
            uses = {way: f"PARTS_{name}" for way in names[:2]}
            if macro == "FORM":
                form, _, preparing, *applying = names
                uses = {f"with form {way}": f"PARTS_{name}_{form}" for way in applying}
                uses[f"for form {preparing}"] = f"SAME_{name}_{form}"
            for way, of in uses.items():
                parts |= {(way, *part) for part in re.findall(r"(\w+)\(\d+, \d+(.*?)\)", lists[of])}
        is_known = parts <= earlier
        earlier.update(parts)
        return "" if is_known else found[0]

    return STRAIGHT.sub(kernel, text)


def test_loops_are_left_out_once_they_are_known() -> None:
    text = "INLINE void NAME({0})\n#define PARTS_{0}(IN, NUMBER, OUT, AND) {1} AND \\\n  OUT(1, 1, 3)\n"
    text += "GAC_KERNEL({0}, PLAIN, NO)"
    earlier: set[tuple[str, ...]] = set()
    kept = [
        "INLINE" in without_known_loops(text.format(name, parts), earlier)
        for name, parts in (("f", "IN(0, 0, 3)"), ("g", "IN(0, 0, 4)"), ("h", "IN(0, 0, 3) AND IN(1, 1, 4)"))
    ]
    assert kept == [True, True, False]


def test_kernels_with_loops_are_left_out_if_shorter_ones_have_their_accesses() -> None:
    kernel = "#define TABLES_{0}(IN)\nvoid NAME({0})(intptr_t n, const REAL *x, REAL *out)\n{{\n"
    kernel += "    NAME(part)({1}, out + i);\n}}\nGAC_PROCEDURE({0}, PLAIN)\n"
    bodies = {"f": "x[i]", "g": "x + 3 * i", "of_any_name": "x + 8 * i", "higher": "x[i + 1]"}
    kept = representative({name: kernel.format(name, access) for name, access in bodies.items()})
    assert [name for name, text in kept.items() if text] == ["f", "g", "higher"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the runtime, its changed header, and its object file."""
    compiler = shutil.which("gcc")
    if compiler is None or not Path(runtime(compiler)).is_file():
        pytest.skip("no gcc with sanitizers")
    folder = tmp_path_factory.mktemp("sanitized")
    write(runtime_files(), folder)
    header = folder / "gac_runtime" / "gac_runtime.h"
    for text, changed in CHANGED.items():
        assert header.read_text().count(text) == 1
        header.write_text(header.read_text().replace(text, changed))
    command = [compiler, *IN_RUNTIME, "-c", str(header.with_suffix(".c")), "-o", str(folder / "runtime.o")]
    subprocess.run(command, check=True)
    return folder


def macros(texts: Iterable[str]) -> set[str]:
    """The macros of the runtime, which depend on the precision, in texts of modules."""
    return {name for text in texts for name in re.findall(r"\bGAC_\w+(?=\()", text)}


def run_sanitized(folder: Path, label: str, texts: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Call the kernels of modules with these texts in a process that the sanitizers end at the first wrong access."""
    compiler = str(shutil.which("gcc"))
    shortened = folder / label
    whole, build = shortened / "all.so", folder / "_build"
    shortened.mkdir()
    build.mkdir(exist_ok=True)
    command = [compiler, *FLAGS, "-shared", str(folder / "runtime.o"), "-o", str(whole)]
    for name, text in texts.items():
        for ending in ("py", "c", "h"):
            shutil.copy(generated_folder() / f"{name}.{ending}", folder)
        source, part, half = shortened / f"{name}.c", shortened / f"{name}.o", len(text) > LARGE
        source.write_text(text)
        flags = [*FLAGS, f"-I{folder}", *(["-DONLY_F64"] if half else [])]
        subprocess.run([compiler, *flags, "-c", str(source), "-o", str(part)], check=True)
        command.append(str(part))
        # The name depends on the changed header; under another name, the library would be compiled again as usual.
        library = build / library_name(
            name, (folder / f"{name}.c").read_text(), folder / "gac_runtime", only="f64" if half else ""
        )
        library.unlink(missing_ok=True)
        library.symlink_to(whole)
    subprocess.run([*command, "-lm"], check=True)
    environment = {
        **os.environ,
        "LD_PRELOAD": runtime(compiler),
        "ASAN_OPTIONS": "detect_leaks=0",
        "GAC_BACKEND": "c",
        "CC": " ".join([compiler, *SANITIZED[:2]]),
    }
    arguments = [str(folder), str(whole), str(ROUNDS), *texts]
    script = [sys.executable, str(Path(__file__).with_name("sanitized.py")), *arguments]
    return subprocess.run(script, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("name", "right", "wrong"), [("vga2", "out[3] = ", "out[4] = "), ("retiming", "i = n; i--", "i = n + 1; i--")]
)
def test_a_wrong_index_ends_the_process(built: Path, name: str, right: str, wrong: str) -> None:
    text = (generated_folder() / f"{name}.c").read_text()
    changed = text.replace(right, wrong)
    run = run_sanitized(built, f"wrong_{name}", {name: changed})
    assert text != changed and run.returncode and "AddressSanitizer" in run.stderr, run.stderr[-4000:]


def test_every_kernel_stays_within_bounds(built: Path) -> None:
    earlier: set[tuple[str, ...]] = set()
    folder = generated_folder()
    whole = {name: joined((folder / f"{name}.c").read_text()) for name in MODULES}
    texts = representative({name: without_known_loops(text, earlier) for name, text in whole.items()})
    texts = {name: text for name, text in texts.items() if re.search(r"^GAC_(KERNEL|PROCEDURE)", text, re.MULTILINE)}
    assert macros(texts.values()) == macros(whole.values()), "every macro of the runtime is among them"
    assert macros(texts.values()) == macros(text for text in texts.values() if len(text) <= LARGE)
    run = run_sanitized(built, "right", texts)
    assert run.returncode == 0, run.stdout + run.stderr[-4000:]
    assert len(re.findall(r"^\w+ \d+ calls$", run.stdout, re.MULTILINE)) == len(texts)
    assert len(list((built / "_build").iterdir())) == len(texts) + 1, "only the extension was compiled"
