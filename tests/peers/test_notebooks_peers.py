"""The notebooks print their stored output also in cells that compare with other libraries."""

from __future__ import annotations

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

from stored_notebooks import NOTEBOOKS, check_outputs, missing_peers, peers_of  # noqa: E402

pytestmark = pytest.mark.peers
WITH_PEERS = [path for path in NOTEBOOKS if any(peers_of(cell) for cell in nbformat.read(path, as_version=4).cells)]


def test_most_notebooks_compare_with_a_peer() -> None:
    assert len(WITH_PEERS) >= 8


@pytest.mark.parametrize("path", WITH_PEERS, ids=lambda path: path.stem)
def test_notebook_prints_its_stored_output_with_peers(path: Path) -> None:
    assert not missing_peers(nbformat.read(path, as_version=4))
    check_outputs(path)
