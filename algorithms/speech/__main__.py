"""Train and evaluate classifiers of speech: ``python -m algorithms.speech train digits DATA --save FILE``."""

from __future__ import annotations

import argparse
import sys

from ..learning.classifier import KINDS, confusion_matrix, load_classifier, train_classifier
from .experiments import TASKS, Rates, leave_out, read_corpus


def _table(rates: Rates) -> str:
    """Return the confusion matrix as text."""
    width = max(4, *(len(str(name)) + 1 for name in rates.classes))
    head = "".join(f"{name!s:>{width}}" for name in ["", *rates.classes])
    rows = (
        f"{name!s:>{width}}" + "".join(f"{count:>{width}}" for count in row)
        for name, row in zip(rates.classes, rates.confusion, strict=True)
    )
    return "\n".join([head, *rows])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m algorithms.speech", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in (
        ("train", "train on all samples of a file, and save the classifier"),
        ("evaluate", "train without the speakers of each fold, recognise them, and print the confusion matrix"),
        ("predict", "recognise the samples of a file by a saved classifier"),
    ):
        own = commands.add_parser(name, help=text)
        own.add_argument("task", choices=TASKS)
        own.add_argument("data", help="file of images (npz) or formants (csv.gz)")
        if name == "predict":
            own.add_argument("--load", required=True, help="file of the classifier")
            continue
        own.add_argument("--kind", choices=KINDS, default="perceptron")
        own.add_argument("--hidden", type=int, default=32)
        own.add_argument("--members", type=int, default=3, help="networks whose probabilities are averaged")
        own.add_argument("--decay", type=float, default=1e-2)
        own.add_argument("--iterations", type=int, default=200)
        if name == "train":
            own.add_argument("--save", required=True, help="file of the classifier")
        else:
            own.add_argument("--folds", type=int, help="folds of speakers; one for each speaker unless given")
    return parser


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    given = _parser().parse_args(arguments)
    if given.command == "predict":
        model = load_classifier(given.load)
        corpus = read_corpus(given.data, given.task, model.kind)
        found = model.predict(corpus.features)
        confusion = confusion_matrix(corpus.labels, found, model.classes)
        share = float((found == corpus.labels).mean())
        print(_table(Rates(share, corpus.features[:0], confusion, model.classes)))
        print(f"{100 * share:.1f} % of {len(found)} samples")
        return
    corpus = read_corpus(given.data, given.task, given.kind)
    options = {name: getattr(given, name) for name in ("hidden", "members", "decay", "iterations")}
    if given.command == "train":

        def report(name: str, iteration: int, loss: float) -> None:
            if iteration % 20 == 0:
                print(f"{name}, iteration {iteration}: loss {loss:.4f}", file=sys.stderr)

        train_classifier(corpus.features, corpus.labels, given.kind, progress=report, **options).save(given.save)
        print(f"{len(corpus.labels)} samples; the classifier is in {given.save}")
        return
    rates = leave_out(
        corpus, given.kind, folds=given.folds, **options,
        progress=lambda fold, share: print(f"fold {fold}: {100 * share:.1f} %", file=sys.stderr),
    )  # fmt: skip
    print(_table(rates))
    print(f"{100 * rates.mean:.1f} % on average over {len(rates.folds)} folds")


if __name__ == "__main__":
    main()
