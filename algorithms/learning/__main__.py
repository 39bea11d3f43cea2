"""Train one task in several algebras and print a table: ``python -m algorithms.learning moebius --algebras R C``."""

from __future__ import annotations

import argparse

from .experiments import TASKS, compare


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m algorithms.learning", description=__doc__)
    parser.add_argument("task", choices=sorted(TASKS))
    parser.add_argument("--algebras", nargs="+", default=["R", "C", "H", "G(2)", "G(3)"])
    parser.add_argument("--parameters", type=int, default=100, help="real parameters, approximately")
    parser.add_argument("--seeds", type=int, default=3)
    given = parser.parse_args(arguments)
    rows = compare(given.task, given.algebras, given.parameters, given.seeds)
    print("| algebra | real parameters | median test error |\n|---|---|---|")
    for name, count, error in rows:
        print(f"| {name} | {count} | {error:.2e} |")


if __name__ == "__main__":
    main()
