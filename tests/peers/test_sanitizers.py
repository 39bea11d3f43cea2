"""No kernel reads or writes out of bounds, on arrays of any shape and strides, according to the sanitizers of gcc.

The loops of a straight-line kernel are macros of the shapes of its arguments and results. A kernel is compiled if they
handle a shape that no earlier kernel has at that place; `test_indices_of_kernels.py` reads the indices in the bodies of
all. Both precisions are one text, so that each module is compiled with the sanitizers for one of them, in turn.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gacompiler.backends import library_name, runtime_files
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.files import write

pytestmark = pytest.mark.peers

PLAIN = ["-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno"]
FLAGS = [*PLAIN, "-Og", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
IN_MODULES = [*FLAGS, "-fno-sanitize=null,object-size,pointer-overflow,alignment"]
"""What is left out takes half of the time: the address sanitizer reports the use of such pointers, and the runtime, in
which nothing is left out, passes aligned ones."""
ROUNDS = 60
WIDTHS = {
    "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3)) GAC_FOR(v4, NAME(name), NAME(name##_v4))":
        "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3))",
    "WIDTHS(name) {NAME(name##_v3), NAME(name##_v4)}": "WIDTHS(name) {NAME(name##_v3), NAME(name##_v3)}",
}  # fmt: skip
"""Loops have one text for vectors of either width; one of them is compiled, in half the time."""
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


def run_sanitized(folder: Path, texts: dict[str, str], halves: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Call the kernels of modules with these texts in a process that the sanitizers end at the first wrong access."""
    compiler = shutil.which("gcc")
    if compiler is None or not Path(runtime(compiler)).is_file():
        pytest.skip("no gcc with sanitizers")
    write(runtime_files(), folder)
    header = folder / "gac_runtime" / "gac_runtime.h"
    for both, one in WIDTHS.items():
        assert header.read_text().count(both) == 1
        header.write_text(header.read_text().replace(both, one))
    (folder / "_build").mkdir()
    (folder / "shortened").mkdir()
    whole = folder / "all.so"
    command = [compiler, *FLAGS, "-shared", str(header.with_suffix(".c")), "-o", str(whole)]
    for name, text in texts.items():
        for ending in ("py", "c", "h"):
            shutil.copy(generated_folder() / f"{name}.{ending}", folder)
        source = folder / "shortened" / f"{name}.c"
        source.write_text(text)
        for half in ("F64", "F32"):
            part, flags = folder / f"{name}_{half}.o", IN_MODULES if half == halves[name] else PLAIN
            options = [f"-I{folder}", f"-DONLY_{half}", "-c", str(source), "-o", str(part)]
            subprocess.run([compiler, *flags, *options], check=True)
            command.append(str(part))
        # The name depends on the changed header; under another name, the library would be compiled again as usual.
        library = library_name(name, (folder / f"{name}.c").read_text(), header.parent)
        (folder / "_build" / library).symlink_to(whole)
    subprocess.run([*command, "-lm"], check=True)
    environment = {
        **os.environ,
        "LD_PRELOAD": runtime(compiler),
        "ASAN_OPTIONS": "detect_leaks=0",
        "GAC_BACKEND": "c",
        "CC": f"{compiler} -fsanitize=address,undefined -fno-sanitize-recover=all",
    }
    script = [sys.executable, str(Path(__file__).with_name("sanitized.py")), str(folder), str(ROUNDS), *texts]
    return subprocess.run(script, env=environment, capture_output=True, text=True, check=False)


def test_a_wrong_index_ends_the_process(tmp_path: Path) -> None:
    text = (generated_folder() / "vga2.c").read_text()
    changed = text.replace("out[3] = ", "out[4] = ", 1)
    run = run_sanitized(tmp_path, {"vga2": changed}, {"vga2": "F64"})
    assert text != changed and run.returncode and "AddressSanitizer" in run.stderr, run.stderr[-4000:]


@pytest.mark.parametrize("first", [0, 1])
def test_every_kernel_stays_within_bounds(first: int, tmp_path: Path) -> None:
    """Every second module, so that two processors are used."""
    earlier: set[tuple[str, ...]] = set()
    folder = generated_folder()
    texts = {name: without_known_loops((folder / f"{name}.c").read_text(), earlier) for name in MODULES}
    halves = {name: ("F64", "F32")[number // 2 % 2] for number, name in enumerate(MODULES)}
    run = run_sanitized(tmp_path, {name: texts[name] for name in MODULES[first::2]}, halves)
    assert run.returncode == 0, run.stdout + run.stderr[-4000:]
    assert run.stdout.endswith("calls\n")
    assert len(list((tmp_path / "_build").iterdir())) == len(MODULES[first::2]) + 1, "only the extension was compiled"
