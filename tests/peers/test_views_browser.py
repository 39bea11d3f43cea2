"""The pages that `view` writes, loaded by the Chromium that kaleido 0.2 brings: they draw, and report no error."""

from __future__ import annotations

import base64
import io
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import colors, image

from gacompiler.objects import CGA2, CGA3, PGA3, view

pytestmark = pytest.mark.peers

SCRIPT = """
(function () {
  const watch = "<script>" +
    "addEventListener('error', function (e) { parent.heard.push(String(e.message)) });" +
    "addEventListener('unhandledrejection', function (e) { parent.heard.push(String(e.reason)) });" +
    "['error', 'warn'].forEach(function (kind) {" +
    "  console[kind] = function () { parent.heard.push(Array.from(arguments).join(' ')) } })<\\/script>";
  async function look(asked) {
    window.heard = [];
    const frame = document.createElement("iframe");
    frame.width = 700;
    frame.height = 500;
    frame.srcdoc = asked.page.replace("<head>", "<head>" + watch);
    await new Promise(function (done) { frame.onload = done; document.body.appendChild(frame); });
    const page = frame.contentDocument;
    const plots = Array.from(page.querySelectorAll(".js-plotly-plot"));
    const pictures = [];
    for (const plot of plots)
      pictures.push(await frame.contentWindow.Plotly.toImage(plot, { format: "png", width: 700, height: 500 }));
    return {
      heard: window.heard,
      agent: navigator.userAgent,
      pictures: pictures,
      canvases: page.querySelectorAll("canvas").length,
      dashes: Array.from(page.querySelectorAll("path.js-line")).map(function (p) { return p.style.strokeDasharray; }),
      texts: Array.from(page.querySelectorAll("text")).map(function (t) { return t.textContent; }),
    };
  }
  const scopes = window.kaleido_scopes || {};
  scopes.plotly = look;
  Object.defineProperty(window, "kaleido_scopes", { get: function () { return scopes; }, set: function () {} });
})();
"""
"""What stands in for plotly's script in kaleido's own page, and loads the page that it is asked to in a frame."""


def browser() -> Path:
    found = pytest.importorskip("kaleido").__file__
    place = Path(found).parent / "executable" / "kaleido"
    if not place.exists():
        pytest.skip("this kaleido brings no browser")
    return place


def looked_at(page: str, folder: Path) -> dict[str, Any]:
    """The content of a page after a headless Chromium has drawn it."""
    script = folder / "look.js"
    script.write_text(SCRIPT)
    command = [str(browser()), "plotly", f"--plotlyjs={script}", "--no-sandbox", "--disable-gpu"]
    command += ["--allow-file-access-from-files", "--disable-breakpad", "--disable-dev-shm-usage"]
    asked = json.dumps({"page": page}) + "\n"
    run = subprocess.run(command, input=asked, capture_output=True, text=True, timeout=60, check=False)
    replies = [json.loads(line) for line in run.stdout.splitlines() if line.strip()]
    assert replies and replies[0]["code"] == 0, run.stderr
    return dict(replies[1])


def picture(found: dict[str, Any]) -> np.ndarray[Any, Any]:
    """The one picture of a page, (height, width, 3) in [0, 1]."""
    (data,) = found["pictures"]
    return np.asarray(image.imread(io.BytesIO(base64.b64decode(data.partition(",")[2]))))[..., :3]


def pixels(drawn: np.ndarray[Any, Any], colour: str) -> int:
    """How many are of a colour, or of it on white to some part, as edges of lines are."""
    away = 1 - np.asarray(colors.to_rgb(colour))
    share = (1 - drawn) @ away / (away @ away)
    off = np.abs(1 - drawn - share[..., None] * away).max(-1)
    return int(np.sum((share > 0.5) & (off < 0.1)))


def test_the_plane_is_drawn(tmp_path: Path) -> None:
    objects = CGA2.circle([1, 2], 2), CGA2.circle([1, 2], radius_squared=-9), CGA2.point(0, 0)
    view(*objects, labels=["real", "imaginary", "o"], colours=["red", "blue", "black"], file=tmp_path / "plane.html")
    found = looked_at((tmp_path / "plane.html").read_text(), tmp_path)
    assert "HeadlessChrome" in found["agent"] and found["heard"] == []
    assert {"real", "imaginary", "o"} <= set(found["texts"])
    real, imaginary = [dash for dash in found["dashes"] if dash is not None][:2]
    assert not real and imaginary
    drawn = picture(found)
    assert pixels(drawn, "red") > 300 and pixels(drawn, "blue") > 300
    assert pixels(drawn, "lime") == 0


def test_space_is_drawn(tmp_path: Path) -> None:
    sphere = CGA3.sphere([0, 0, 0], 2)
    circle = sphere & CGA3.plane([0, 0, 1], 1)
    cloud = PGA3.point(np.random.default_rng(0).normal(size=(200, 3)))
    view(circle, sphere, labels=["c", "s"], colours=["red", "blue"], file=tmp_path / "space.html")
    found = looked_at((tmp_path / "space.html").read_text(), tmp_path)
    assert found["heard"] == [] and found["canvases"] > 0 and {"c", "s"} <= set(found["texts"])
    drawn = picture(found)
    assert pixels(drawn, "red") > 20, "the circle"
    blueish = (drawn[..., 2] > drawn[..., 0] + 0.05) & (drawn[..., 2] > 0.5)
    assert blueish.sum() > 5000, "the sphere, translucent"
    view(cloud, colours=["green"], file=tmp_path / "cloud.html")
    found = looked_at((tmp_path / "cloud.html").read_text(), tmp_path)
    assert found["heard"] == [] and pixels(picture(found), "green") > 100


def test_errors_of_a_page_are_heard(tmp_path: Path) -> None:
    """Otherwise the tests above could not fail."""
    view(CGA2.circle([1, 2], 2), file=tmp_path / "plane.html")
    page = (tmp_path / "plane.html").read_text()
    broken = page.replace("</body>", "<script>console.error('lost'); throw new Error('torn')</script></body>")
    heard = looked_at(broken, tmp_path)["heard"]
    assert "lost" in heard and any("torn" in each for each in heard)
