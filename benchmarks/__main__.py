"""The command ``python -m benchmarks``: measure, and write pages of figures, or list those that are outdated.

python -m benchmarks vision-speed        # write docs/vision-speed.md; further arguments are those of its command
python -m benchmarks all                 # write all pages
python -m benchmarks --check             # list pages without a stamp, or older than the code that they measure
python -m benchmarks minimal             # commands that write no page: charges gpu minimal overview random_kernels
"""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path

PAGES = {
    "benchmarks": "command",
    "clifford-svm-speed": "clifford_svm",
    "cost-model-times": "cost_models",
    "estimation-speed": "estimation",
    "evidence": "evidence",
    "grasping-loop-speed": "grasping_loop",
    "grasping-speed": "grasping",
    "growth": "growth",
    "learning-speed": "learning",
    "loop-speed": "loops",
    "mapping-speed": "mapping",
    "matrix-speed": "matrices",
    "numba": "chain",
    "operation-counts": "counts",
    "registration-speed": "registration",
    "robot-speed": "robots",
    "shapes-speed": "shapes",
    "signals": "signals",
    "speech-speed": "speech",
    "start-up": "start_up",
    "subspaces": "subspaces",
    "tensor-speed": "tensors",
    "toolkit-speed": "toolkit",
    "tracking-speed": "tracking",
    "vision-speed": "vision",
    "visual-grasping-speed": "visual_grasping",
}
"""The module that writes each page of figures."""

WITHOUT_PAGES = ("charges", "gpu", "minimal", "overview", "random_kernels")
"""Further modules with a command."""


def main(words: list[str]) -> int:
    """Run the command on one thread. Return the exit status, which is 1 if a check finds outdated pages."""
    # The libraries read these variables when they are loaded, so the modules are imported afterwards.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"
    first, rest = (words[0], words[1:]) if words else ("--help", [])
    if first == "--check":
        return _check()
    if first == "all":
        return max(run(command, rest) for command in PAGES.values())
    command = PAGES.get(first, first)
    if command in (*PAGES.values(), *WITHOUT_PAGES):
        return run(command, rest)
    print(__doc__, f"Pages: {' '.join(PAGES)}", sep="\n")
    return 0 if first in ("-h", "--help") else 2


def run(command: str, words: list[str]) -> int:
    """Run the command of a module. Return the exit status."""
    status: int = importlib.import_module(f".{command}", __package__).main(words)
    return status


def _check() -> int:
    from .stamp import is_outdated

    docs = Path(__file__).parents[1] / "docs"
    outdated = [page for page, command in PAGES.items() if is_outdated((docs / f"{page}.md").read_text(), command)]
    for page in outdated:
        print(f"docs/{page}.md: older than the code that it measures; run make bench PAGE={page}")
    print(f"{len(PAGES) - len(outdated)} of {len(PAGES)} pages are current")
    return bool(outdated)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
