"""Live scenes: what a browser computes equals what Python computes, and what is dragged moves."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path
from typing import Any

import browser
import numpy as np
import pytest

import gacompiler as ga
from gacompiler.errors import AlgebraError, GacError, KernelError, LayoutError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, VGA3, view
from gacompiler.objects.scene import shapes_of
from tests.support.all_cases import all_cases

P, Q, R = PGA3.point(-1, 0, 0), PGA3.point(1, 0.5, 0.5), PGA3.point(0, 1, 0)
A, B, C = CGA3.point(0, 0, 0), CGA3.point(1.5, 0, 0), CGA3.point(0, 1, 0.5)
FLAT = [PGA2.point(0, 0), PGA2.point(2, 1)]
ROUND = [CGA2.point(0, 0), CGA2.point(2, 0), CGA2.point(0.4, 1.4)]


def screw(p: Any, q: Any, angle: Any) -> dict[str, Any]:
    """Move a point about the line of two points; the plane, the projection and a direction follow."""
    line = p & q
    moved = PGA3.motor(line, angle, 0.2 * angle) >> R
    return {
        "p": p,
        "line": line,
        "moved": moved,
        "plane": moved & line,
        "foot": ((line | moved) * line).grade(3),
        "way": q - p,
    }


def rounds(a: Any, b: Any, c: Any, radius: Any) -> list[Any]:
    """Return the circle through three points, a sphere, where they meet, and flats."""
    circle, sphere = a ^ b ^ c, CGA3.sphere(a, radius)
    return [
        a,
        circle,
        sphere,
        sphere & circle,
        sphere & CGA3.plane(a, b, c),
        a ^ b,
        CGA3.line(b, c),
        circle ^ CGA3.einf,
    ]


def triangle(a: Any, b: Any, c: Any) -> list[Any]:
    """Return the circle, a side and the bisector of the points of a plane."""
    return [a ^ b ^ c, CGA2.line(a, b), a ^ b, (a ^ b ^ c) & CGA2.line(a, c), a - b]


def turned(p: Any, q: Any, angle: Any, size: Any) -> list[Any]:
    """Turn a line about a point, and place a point with functions of numbers."""
    return [PGA2.rotor(angle, p) >> (p & q), PGA2.point(size * ga.cos(angle), size * ga.sin(angle)), p & q]


SCENES = {
    "screw": (screw, [P, Q], {"angle": (0, 6.28)}),
    "rounds": (rounds, [A, B, C], {"radius": (0.5, 2, 1.2)}),
    "triangle": (triangle, ROUND, {}),
    "turned": (turned, FLAT, {"angle": (0, 6.28, 1), "size": (1, 2)}),
}


def numbers(shape: Any) -> dict[str, Any]:
    """Return the numbers of a shape so that opposite directions of one flat are equal."""
    found = (
        {name: getattr(shape, name) for name in shape.__dataclass_fields__}
        if not isinstance(shape, dict)
        else dict(shape)
    )
    for name in ("direction", "normal"):
        vector = found.get(name)
        if vector is not None and found.get("type", type(shape).__name__) != "Arrow":
            first = np.asarray(vector)[np.argmax(np.abs(vector))]
            found[name] = np.asarray(vector) * np.sign(first)
            if "distance" in found:
                found["distance"] *= np.sign(first)
    return {name.removeprefix("is_"): x for name, x in found.items() if name != "type"}


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
@pytest.mark.slow
def test_the_browser_computes_what_python_computes(tmp_path: Path) -> None:
    """The emitted module and the program of the page under node, at random places of points and sliders."""
    random = np.random.default_rng(3)
    program = (files("gacompiler.objects") / "live.js").read_text()
    for name, (function, drag, sliders) in SCENES.items():
        live = view(function, drag=drag, sliders=sliders)
        space = (
            {2: PGA2, 3: PGA3}[len(drag[0].values)]
            if not drag[0].algebra.null_pairs
            else {2: CGA2, 3: CGA3}[len(drag[0].values)]
        )
        cases = []
        for _ in range(20):
            points = [space.point(random.normal(size=len(drag[0].values))) for _ in drag]
            cases.append((points, {each.name: random.uniform(each.low, each.high) for each in live.sliders}))
        given = [[[p.values.tolist() for p in points], list(values.values())] for points, values in cases]
        text = f"{live.javascript}\n{program}\nconst data = {json.dumps(live._data())}, given = {json.dumps(given)};"
        text += "\nconsole.log(JSON.stringify(given.map(([p, v]) => shapesOf(data, scene, p, v))));"
        (tmp_path / f"{name}.mjs").write_text(text)
        run = subprocess.run(["node", str(tmp_path / f"{name}.mjs")], capture_output=True, text=True, check=True)
        for (points, values), found in zip(cases, json.loads(run.stdout), strict=True):
            for x, shapes in zip(live.at(*points, **values), found, strict=True):
                (expected,), (shape,) = shapes_of(x), shapes
                assert shape["type"] == type(expected).__name__, f"{name}: {x}"
                right, own = numbers(expected), numbers(shape)
                assert right.keys() == own.keys()
                for key, value in right.items():
                    if value is None or isinstance(value, bool):
                        assert own[key] == value
                        continue
                    size = max(1.0, *(float(np.max(np.abs(y))) for y in right.values() if y is not None))
                    assert np.allclose(own[key], value, rtol=0, atol=1e-12 * size**2), f"{name}: {x}: {key}"


def test_objects_of_a_scene_follow_in_python() -> None:
    """The join of the dragged points passes through them, and the motor turns about it: closed forms."""
    live = view(screw, drag=[P, Q], sliders={"angle": (0, 6.28)})
    assert live.labels == ("p", "line", "moved", "plane", "foot", "way")
    q = PGA3.point(-1, 0, 2)
    _, line, moved, *_ = live.at(P, q, angle=np.pi / 2)
    assert np.allclose(line.direction(), [0, 0, 1]) and np.allclose(line.distance(P), 0)
    assert np.allclose(PGA3.coordinates(moved), [-2, 1, 0.1 * np.pi])
    assert live.at()[0].isclose(P) and np.allclose(PGA3.coordinates(live.at()[2]), [0, 1, 0])


def test_dragged_points_alone_are_a_scene() -> None:
    live = view(P, Q, drag=[P, Q], sliders={"angle": (0, 6.28)})
    assert live.kernel is None and [each["point"] for each in live._data()["items"]] == [0, 1]
    assert live._repr_html_().startswith("<iframe srcdoc=")
    assert view(P, lambda p: p & R, drag=P).labels == ("", "")
    assert len(view(lambda size: [PGA2.point(size, 0), PGA2.e1], sliders={"size": (0, 1)}).at()) == 2


@pytest.mark.slow
def test_objects_without_a_picture_at_the_start_appear_later() -> None:
    """Two points that coincide have no line, until one of them is dragged."""
    live = view(lambda p, q: {"p": p, "line": p & q, "motor": PGA3.motor(p & R, 1.0)}, drag=[P, P])
    assert "Live scene" in live.html() and [each.get("kind") for each in live._parts] == [None, "line3", "frame"]
    assert np.allclose(live.at(P, Q)[1].distance(Q), 0, atol=1e-12)


def test_pages_need_no_network_and_quote_what_they_contain(tmp_path: Path) -> None:
    live = view(lambda p: {"</script><b>": p & R}, drag=[P], file=tmp_path / "scene.html")
    text = (tmp_path / "scene.html").read_text()
    assert text == live.html() and "</script><b>" not in text and text.count("</script>") == 1
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", text) and "import " not in re.sub(r"//.*", "", text)


def test_pictures_and_models_of_scenes(tmp_path: Path) -> None:
    """The places in a model are on the object: a sphere at its radius, a plane on its equation, ends on a line."""
    live = view(
        lambda a, b: {
            "s": CGA3.sphere(b, 1.25),
            "l": CGA3.line(a, b),
            "e": CGA3.plane([0, 0, 1], 0.25),
            "m": CGA3.motor([0, 0, 1], np.pi / 2, translation=[1, 2, 3]),
            "a": a,
        },
        drag=[A, B],
    )
    live.save(tmp_path / "scene.svg")
    live.save(tmp_path / "scene.gltf")
    assert "<svg" in (tmp_path / "scene.svg").read_text()
    model = json.loads((tmp_path / "scene.gltf").read_text())
    data = base64.b64decode(model["buffers"][0]["uri"].partition(",")[2])
    assert len(data) == model["buffers"][0]["byteLength"] and [x.get("name") for x in model["nodes"][1:]] == [
        "s",
        "l",
        "e",
        "m",
        "a",
    ]

    def array(index: int) -> Any:
        entry = model["accessors"][index]
        part = model["bufferViews"][entry["bufferView"]]
        kind = "<f4" if entry["type"] == "VEC3" else "<u4"
        found = np.frombuffer(data[part["byteOffset"] :][: part["byteLength"]], kind)
        assert len(found) == entry["count"] * (3 if kind == "<f4" else 1)
        return found.reshape(-1, 3)

    sphere, line, plane, frame, _ = (
        [array(p["attributes"]["POSITION"]) for p in mesh["primitives"]] for mesh in model["meshes"]
    )
    assert np.allclose(np.linalg.norm(sphere[0] - [1.5, 0, 0], axis=1), 1.25, atol=1e-6)
    assert np.allclose(line[0][:, 1:], 0, atol=1e-6) and np.allclose(plane[0][:, 2], 0.25)
    assert np.allclose(frame, [[[1, 2, 3], end] for end in ([1, 3, 3], [0, 2, 3], [1, 2, 4])], atol=1e-6)
    red, green, blue = (model["materials"][p["material"]] for p in model["meshes"][3]["primitives"])
    assert np.argmax(blue["pbrMetallicRoughness"]["baseColorFactor"][:3]) == 2 and red != green != blue
    corners = array(model["meshes"][0]["primitives"][0]["indices"])
    assert corners.max() < len(sphere[0])
    a, b, c = (sphere[0][corners[:, k]] - [1.5, 0, 0] for k in range(3))
    volume = abs(np.sum(np.einsum("ni,ni->n", np.cross(a, b), c))) / 6  # of the polyhedron, inside of the sphere
    assert 0.95 < volume / (4 / 3 * np.pi * 1.25**3) < 1


NAN = PGA3.point(np.nan, 0, 0)


@all_cases(
    "wrong, error, message",
    [
        (lambda: view(drag=[P]), AlgebraError, "no object"),
        (lambda: view(P, drag=[P, Q]), AlgebraError, r"depends on drag\[1\]"),
        (lambda: view(P, Q, P & Q, drag=[P, Q]), AlgebraError, "object 2, whose numbers do not follow"),
        (lambda: view(P, drag=[P & Q]), AlgebraError, r"drag\[0\] is line through"),
        (lambda: view(NAN, drag=[NAN]), AlgebraError, "single finite point"),
        (lambda: view(P, drag=[VGA3.e1]), AlgebraError, r"drag\[0\] is vector"),
        (lambda: view(P, drag=[3.0]), AlgebraError, r"drag\[0\] is float"),
        (lambda: view(P, drag=[PGA3.point([[1, 2, 3], [4, 5, 6]])]), AlgebraError, "single finite point"),
        (lambda: view(lambda p: [p], drag=[P], sliders={"size": (0, 1)}), AlgebraError, "depends on the slider 'size'"),
        (lambda: view(lambda p, q: [p], drag=[P, Q]), AlgebraError, r"depends on drag\[1\]"),
        (lambda: view(lambda p, size: [p], drag=[P], sliders={"size": (0, 1)}), AlgebraError, "the slider 'size'"),
        (lambda: view(lambda p, x: [p], drag=[P], sliders={"size": (0, 1)}), LayoutError, "1 parameters"),
        (lambda: view(lambda size: [P], sliders={"size": (1, 0)}), LayoutError, "slider 'size' from"),
        (lambda: view(lambda size: [P], sliders={"size": (0, float("nan"))}), LayoutError, "finite numbers"),
        (lambda: view(lambda size: [P], sliders={"size": 3}), LayoutError, "low, high"),
        (lambda: view(lambda p: [p, 3], drag=[P]), AlgebraError, "result of type int"),
        (lambda: view(lambda p: [p, NAN], drag=[P]), AlgebraError, "object 1 with coefficients that are not finite"),
        (lambda: view(P, "q", drag=[P]), AlgebraError, "object of type str"),
        (lambda: view(lambda p: [p], drag=[P], labels=["a", "b"]), LayoutError, "2 labels"),
        (lambda: view(lambda p: [np.cos(p["e123"]) * p], drag=[P]), KernelError, "functions of gacompiler"),
        (lambda: view(lambda p: [1 + p], drag=[P]), AlgebraError, "grades"),
        (lambda: view(P, drag=[P]).save("scene.png"), LayoutError, r".html, .svg or .gltf"),
        (lambda: view(P, drag=[P]).at(P, Q), LayoutError, "2 points; expected 1"),
        (lambda: view(P, drag=[P]).at(size=1.0), LayoutError, "slider 'size'"),
    ],
)
def test_error_messages(wrong: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(GacError, match=message) as found:
        wrong()
    assert isinstance(found.value, error)


needs_browser = pytest.mark.skipif(browser.PROGRAM is None, reason="no Chromium is installed")
TURNED = """(() => { const at = liveScene.project(liveScene.state().points[1]); return at.slice(0, 2); })()"""


@needs_browser
@pytest.mark.slow
def test_a_point_is_dragged_in_a_browser(tmp_path: Path) -> None:
    """The mouse moves a point by 80 and -60 pixels, and the object is where Python computes it; then a slider plays."""
    live = view(turned, drag=FLAT, sliders={"angle": (0, 6.2832, 1), "size": (1, 2)}, labels=["line", "end", "base"])
    live.save(tmp_path / "scene.html")
    with browser.Browser(800, 600) as page:
        page.open(tmp_path / "scene.html", "window.liveScene && document.querySelector('.handle[transform]')")
        x, y = page.run(TURNED)
        page.drag((x, y), (x + 80, y - 60))
        assert np.allclose(page.run(TURNED), [x + 80, y - 60], atol=0.51)
        places = page.run("liveScene.state().points.map(p => Array.from(p))")
        assert not np.allclose(places[1], [2, 1]) and np.allclose(places[0], 0)
        values = dict(zip(("angle", "size"), page.run("liveScene.state().values"), strict=True))
        expected = [shapes_of(each)[0] for each in live.at(*map(PGA2.point, places), **values)]
        for shape, (found,) in zip(expected, page.run("liveScene.shapes()"), strict=True):
            for key, value in numbers(shape).items():
                assert np.allclose(
                    numbers(found)[key], value, rtol=0, atol=1e-12 * max(1.0, *map(abs, np.ravel(places))) ** 2
                )
        page.run("document.querySelector('#sliders button').click()")
        page.run("new Promise(done => setTimeout(done, 300))")
        assert page.run("liveScene.state().values[0]") > 1
        boxes = page.run(
            "[...document.querySelectorAll('svg > g:last-of-type text')].map(t => t.getBBox())"
            ".map(b => [b.x, b.y, b.x + b.width, b.y + b.height])"
        )
        assert len(boxes) == 3
        for k, a in enumerate(boxes):
            for b in boxes[:k]:
                width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
                assert width <= 1 or height <= 4, "labels do not cover one another"


COVERED = """(() => {
  const boxes = [...document.querySelectorAll("svg > g:last-of-type text")].map((text) => text.getBBox());
  const inside = (box, p) => p.x > box.x && p.x < box.x + box.width && p.y > box.y + 3 && p.y < box.y + box.height - 4;
  let found = 0;
  for (const line of document.querySelectorAll("svg g[class^=c] > path"))
    for (let at = 0; at < line.getTotalLength(); at++)
      found += boxes.some((box) => inside(box, line.getPointAtLength(at)));
  return [boxes.length, found];
})()"""


@needs_browser
@pytest.mark.slow
def test_labels_cover_no_lines(tmp_path: Path) -> None:
    """A point is dragged across a line: all labels leave both lines free."""
    drag = [PGA2.point(*each) for each in ((0, -1), (0, 1), (0.8, -1), (1.6, 1), (0.4, 0))]
    live = view(lambda a, b, c, d, x: {"one": a & b, "other": c & d, "moved": x}, drag=drag)
    live.save(tmp_path / "scene.html")
    with browser.Browser(800, 500) as page:
        page.open(tmp_path / "scene.html", "window.liveScene && document.querySelector('.handle[transform]')")
        for k in range(12):
            page.run(f"liveScene.state().points[4].set([{0.2 * k - 0.8}, 0]); liveScene.redraw()")
            assert page.run(COVERED) == [3, 0], k


@needs_browser
@pytest.mark.slow
def test_a_point_is_dragged_by_a_finger(tmp_path: Path) -> None:
    """In space, the point moves at its distance from the eye; its coordinates change and its handle follows."""
    view(screw, drag=[P, Q], sliders={"angle": (0, 6.28)}, file=tmp_path / "scene.html")
    with browser.Browser(390, 700) as page:
        page.open(tmp_path / "scene.html", "window.liveScene && document.querySelector('.handle[transform]')")
        x, y = page.run(TURNED)
        page.swipe((x, y), (x - 40, y + 30))
        assert np.allclose(page.run(TURNED), [x - 40, y + 30], atol=0.51)
        assert not np.allclose(page.run("Array.from(liveScene.state().points[1])"), Q.values)


@needs_browser
@pytest.mark.slow
def test_a_scene_in_a_page_of_a_notebook_follows_its_colours(tmp_path: Path) -> None:
    live = view(P, Q, drag=[P, Q])
    (tmp_path / "page.html").write_text(
        f'<meta name=viewport content=width=device-width><body data-theme="dark">{live._repr_html_()}</body>'
    )
    with browser.Browser(390, 700) as page:
        inner = "document.querySelector('iframe').contentWindow"
        page.open(tmp_path / "page.html", f"{inner}.liveScene")
        assert page.run(f"{inner}.document.documentElement.className") == "dark"
        assert page.run(f"{inner}.document.documentElement.scrollWidth") <= 390
