"""The statuses of neural gases."""

from __future__ import annotations

from ..evidence import Status


class GasStatus(Status):
    """Whether the graph of a neural gas has the topology of its samples."""

    OK = 0
    """Each stage of growth from half of the nodes on, and edges with two witnesses alone, give the same numbers of
    parts, loops and cavities."""
    UNCERTAIN = 1
    """These numbers depend on the number of nodes, or on single samples: more samples are needed, or there are
    outliers."""
    TOO_FEW_POINTS = 2
    """There are too few different samples for a graph; the nodes are the samples."""
