"""The comparison of motions of charges has networks of equal size, and real ones that do not turn with motions."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.learning import Interaction, Network
from algorithms.learning.charges import simulate_charges
from benchmarks.charges import HIDDEN, STEPS, main, real_steps

pytestmark = pytest.mark.peers


def test_networks(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    torch = pytest.importorskip("torch")
    network = real_steps(torch).double()
    ours = Network([Interaction(5, STEPS, (HIDDEN, HIDDEN))], "G(3)", 10).parameters.size
    assert ours <= sum(own.numel() for own in network.parameters()) < 1.01 * ours
    x = torch.tensor(simulate_charges(6, seed=0).inputs)
    order = [3, 0, 4, 1, 2]
    both = torch.tensor([*order, *(5 + k for k in order)])
    with torch.no_grad():
        y = network(x)
        assert torch.allclose(network(x[:, both]), y[:, order], atol=1e-12)  # the charges have no numbers
        moved = x.clone()
        moved[:, :5, 1:4] += 2
        assert torch.allclose(network(moved), y + 2, atol=1e-12)
        turned = x.clone()
        turned[..., 1:4] = x[..., [2, 1, 3]] * torch.tensor([1.0, -1, 1])
        assert not torch.allclose(network(turned), y[..., [1, 0, 2]] * torch.tensor([1.0, -1, 1]), atol=1e-3)
        for own in network.parameters():
            own.zero_()
        straight = x[:, :5, 1:4] + x[:, 5:, 1:4]  # during the time 1, without messages
        assert np.abs((network(x) - straight).numpy()).max() < 1e-12
    assert main(["--seeds", "1", "--epochs", "1", "--count", "50"]) == 0
    text = capsys.readouterr().out
    assert "seed 1: Interaction" in text and "real, turned: median" in text
