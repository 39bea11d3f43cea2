"""The blocks of the page on wavelets run without failing assertions."""

from __future__ import annotations

import re
from pathlib import Path

from algorithms.wavelets import wavelet_filters, wavelet_names
from algorithms.wavelets.filters import LEVEL_ONE_ANALYSIS, LEVEL_ONE_SYNTHESIS, QSHIFT

PAGE = Path(__file__).parents[2] / "docs" / "wavelets.md"


def test_blocks_run() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 18
    exec(compile("\n".join(blocks), "docs/wavelets.md", "exec"), {"__name__": "wavelets"})


def test_the_table_of_families_has_their_numbers_of_taps() -> None:
    table = PAGE.read_text().split("| family | names | taps |")[1].split("| continuous |")[0]
    lines = [line.split("|") for line in table.split("\n")[2:-1]]
    rows = {cells[2].split()[0].rstrip("1234567890.,"): cells for cells in lines}
    taps: dict[str, list[int]] = {}
    for name in wavelet_names():
        taps.setdefault(name.rstrip("1234567890."), []).append(len(wavelet_filters(name).low))
    assert taps.pop("rbio") == taps["bior"]
    for family, lengths in taps.items():
        limits = sorted({min(lengths), max(lengths)})
        assert rows[family][3].strip() == " to ".join(map(str, limits)), family
    low = {name: (len(each), len(LEVEL_ONE_SYNTHESIS[name])) for name, each in LEVEL_ONE_ANALYSIS.items()}
    assert rows["near_sym_a"][3].strip() == ", ".join(f"{a} and {b}" for a, b in low.values())
    assert rows["qshift_"][3].strip() == ", ".join(str(len(each)) for each in QSHIFT.values())
