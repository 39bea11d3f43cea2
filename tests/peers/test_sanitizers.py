"""No kernel reads or writes out of bounds, on arrays of any shape and strides, according to the sanitizers of gcc.

The loops of a straight-line kernel are macros of the shapes of its arguments and results. A kernel is compiled if they
handle a shape that no earlier kernel has at that place; `test_indices_of_kernels.py` reads the indices in the bodies of
all. Functions are compiled once each, and not again at every place that calls them: that takes a fifth of the time, and
the sanitizers look at each access all the same. Large modules are compiled for doubles alone: their text is the same
for floats, and the macros that it uses are compiled for floats with smaller modules.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from gacompiler.backends import library_name, runtime_files
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.files import write

pytestmark = pytest.mark.peers

SANITIZED = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
CHECKS_BY_CALLS = ["--param", "asan-instrumentation-with-call-threshold=0"]
"""A check is a call of the sanitizer's library, which is compiled in less time than its instructions at each access."""
FLAGS = ["-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-O0", *SANITIZED, *CHECKS_BY_CALLS]
IN_MODULES = [*FLAGS, "-fno-sanitize=null,object-size,pointer-overflow,alignment"]
"""What is left out takes half of the time: the address sanitizer reports the use of such pointers, and the runtime, in
which nothing is left out, passes aligned ones."""
ROUNDS = 30
LARGE = 80_000
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


def runtime(compiler: str) -> str:
    """The path of the library of the sanitizer, which must be loaded before Python."""
    found = subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    return found.stdout.strip()


def without_known_loops(text: str, earlier: set[tuple[str, ...]]) -> str:
    """Return the text of a module without straight-line kernels whose loops have no part that is new."""
    joined = re.sub(r"\s*\\\n\s*|(?<=,)\n +", " ", text)
    lists = dict(re.findall(r"^#define ((?:PARTS|SAME)_\w+)\(IN, NUMBER, OUT, AND\) (.*)$", joined, re.MULTILINE))

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

    return STRAIGHT.sub(kernel, joined)


def test_loops_are_left_out_once_they_are_known() -> None:
    text = "INLINE void NAME({0})\n#define PARTS_{0}(IN, NUMBER, OUT, AND) {1} AND \\\n  OUT(1, 1, 3)\n"
    text += "GAC_KERNEL({0}, PLAIN, NO)"
    earlier: set[tuple[str, ...]] = set()
    kept = [
        "INLINE" in without_known_loops(text.format(name, parts), earlier)
        for name, parts in (("f", "IN(0, 0, 3)"), ("g", "IN(0, 0, 4)"), ("h", "IN(0, 0, 3) AND IN(1, 1, 4)"))
    ]
    assert kept == [True, True, False]


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
    command = [compiler, *FLAGS, "-c", str(header.with_suffix(".c")), "-o", str(folder / "runtime.o")]
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
        flags = [*IN_MODULES, f"-I{folder}", *(["-DONLY_F64"] if half else [])]
        subprocess.run([compiler, *flags, "-c", str(source), "-o", str(part)], check=True)
        command.append(str(part))
        # The name depends on the changed header; under another name, the library would be compiled again as usual.
        library = build / library_name(name, (folder / f"{name}.c").read_text(), folder / "gac_runtime", half=half)
        library.unlink(missing_ok=True)
        library.symlink_to(whole)
    subprocess.run([*command, "-lm"], check=True)
    environment = {
        **os.environ,
        "LD_PRELOAD": runtime(compiler),
        "ASAN_OPTIONS": "detect_leaks=0",
        "GAC_BACKEND": "c",
        "CC": " ".join([compiler, *SANITIZED]),
    }
    arguments = [str(folder), str(whole), str(ROUNDS), *texts]
    script = [sys.executable, str(Path(__file__).with_name("sanitized.py")), *arguments]
    return subprocess.run(script, env=environment, capture_output=True, text=True, check=False)


def test_a_wrong_index_ends_the_process(built: Path) -> None:
    text = (generated_folder() / "vga2.c").read_text()
    changed = text.replace("out[3] = ", "out[4] = ", 1)
    run = run_sanitized(built, "wrong", {"vga2": changed})
    assert text != changed and run.returncode and "AddressSanitizer" in run.stderr, run.stderr[-4000:]


def test_every_kernel_stays_within_bounds(built: Path) -> None:
    earlier: set[tuple[str, ...]] = set()
    folder = generated_folder()
    texts = {name: without_known_loops((folder / f"{name}.c").read_text(), earlier) for name in MODULES}
    assert macros(texts.values()) == macros(text for text in texts.values() if len(text) <= LARGE)
    run = run_sanitized(built, "right", texts)
    assert run.returncode == 0, run.stdout + run.stderr[-4000:]
    assert len(re.findall(r"^\w+ \d+ calls$", run.stdout, re.MULTILINE)) == len(MODULES)
    assert len(list((built / "_build").iterdir())) == len(MODULES) + 1, "only the extension was compiled"
