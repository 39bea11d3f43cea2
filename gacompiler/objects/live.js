// Shapes of homogeneous numbers, by the rules of `scene` in Python. Results without a finite picture are null.

const FLAT = 1e-10; // a round counts as flat if the part that makes it round is smaller, relative to the others
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const scaled = (a, factor) => a.map((x) => x * factor);
const plus = (a, b, factor = 1) => a.map((x, k) => x + factor * b[k]);
const length = (a) => Math.hypot(...a);
const largest = (a) => a.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function pointOf(v, w) {
  if (Math.abs(w) <= 1e-12 * largest(v)) return { type: "Arrow", direction: v };
  return { type: "Points", places: [scaled(v, 1 / w)] };
}

function lineOf(direction, moment) {
  const size = length(direction);
  return { type: "Line", point: scaled(cross(direction, moment), 1 / size ** 2), direction: scaled(direction, 1 / size) };
}

function flatOf(normal, distance) {
  const size = length(normal);
  if (normal.length === 3) return { type: "Plane", normal: scaled(normal, 1 / size), distance: distance / size };
  return { type: "Line", point: scaled(normal, distance / size ** 2), direction: [-normal[1] / size, normal[0] / size] };
}

function roundOf(centre, squared, make) {
  const radius = Math.sqrt(Math.abs(squared));
  if (radius <= 1e-9 * (1 + largest(centre))) return { type: "Points", places: [centre] };
  return { ...make, centre, radius, imaginary: squared < 0 };
}

const rowsOf = (v, d) => [...Array(v.length / d).keys()].map((k) => v.slice(k * d, (k + 1) * d));

function shapeOf(kind, v, d, faces) {
  if (!v.every(Number.isFinite)) return null;
  const part = (from, count = d) => v.slice(from, from + count);
  const found = (() => {
    switch (kind) {
      case "point": return pointOf(part(0), v[d]);
      case "line2": case "plane": return flatOf(part(0), -v[d]);
      case "line3": return lineOf(part(0), part(3));
      case "ball": {
        const normal = part(0), [e0, einf] = part(d, 2);
        if (Math.abs(e0) <= FLAT * largest(v)) return flatOf(normal, einf);
        const squared = (dot(normal, normal) - 2 * e0 * einf) / e0 ** 2;
        return roundOf(scaled(normal, 1 / e0), squared, d === 2 ? { type: "Circle", normal: null } : { type: "Sphere" });
      }
      case "pair": {
        const along = part(d + 1), flat = part(2 * d + 3);
        if (largest(along) <= FLAT * largest(part(2 * d + 3, d + 1))) return pointOf(flat, v[3 * d + 3]);
        const squared = v[2 * d + 1] / v[2 * d + 2];
        return roundOf(scaled(part(0), 1 / v[d]), squared, { type: "PointPair", direction: scaled(along, 1 / length(along)) });
      }
      case "circle3": {
        const normal = part(4);
        if (largest(normal) <= FLAT * largest(part(9, 6))) return lineOf(part(9), part(12));
        const unit = scaled(normal, 1 / length(normal));
        return roundOf(scaled(part(0), 1 / v[3]), v[7] / v[8], { type: "Circle", normal: unit });
      }
      case "chain": return { type: "Chain", places: rowsOf(v, d) };
      case "body": return { type: "Body", places: rowsOf(v, d), faces };
      case "axes": return { type: "Frame", places: rowsOf(v, d) };
      default: {
        const places = [];
        for (let k = 0; k <= d; k++) places.push(scaled(part(k * (d + 1)), 1 / v[k * (d + 1) + d]));
        return { type: "Frame", places };
      }
    }
  })();
  return Object.values(found).flat(2).every((x) => typeof x !== "number" || Number.isFinite(x)) ? found : null;
}

// The shapes of all objects, for coordinates of the dragged points and values of the sliders.
function shapesOf(data, kernel, points, values) {
  const numbers = kernel ? Array.from(kernel(...points, ...values)) : [];
  return data.items.map((item) => {
    if (item.shapes) return item.shapes;
    if (item.point !== undefined) return [{ type: "Points", places: [Array.from(points[item.point])] }];
    const own = numbers.slice(item.start, item.start + item.size);
    const shape = shapeOf(item.kind, own, data.dimension, item.faces);
    return shape ? [shape] : null;
  });
}

// Geometry of the picture

function clipped(line, limits) {
  let low = -Infinity, high = Infinity;
  for (let k = 0; k < limits.length; k++) {
    const [a, b] = limits[k], p = line.point[k], v = line.direction[k];
    if (Math.abs(v) < 1e-12) {
      if (p < a || p > b) return null;
      continue;
    }
    const [s, t] = [(a - p) / v, (b - p) / v].sort((x, y) => x - y);
    low = Math.max(low, s);
    high = Math.min(high, t);
  }
  return low < high ? [plus(line.point, line.direction, low), plus(line.point, line.direction, high)] : null;
}

function polygon(plane, limits) {
  const corners = [...Array(8).keys()].map((k) => limits.map((x, axis) => x[(k >> axis) & 1])), found = [];
  for (let k = 0; k < 8; k++) {
    for (let axis = 0; axis < 3; axis++) {
      if ((k >> axis) & 1) continue;
      const a = corners[k], b = corners[k | (1 << axis)];
      const x = dot(a, plane.normal) - plane.distance, y = dot(b, plane.normal) - plane.distance;
      if (x * y <= 0 && x !== y) found.push(plus(a, plus(b, a, -1), x / (x - y)));
    }
  }
  if (found.length < 3) return null;
  const middle = scaled(found.reduce((a, b) => plus(a, b)), 1 / found.length), [u, v] = across(plane.normal);
  const angle = (x) => Math.atan2(dot(plus(x, middle, -1), v), dot(plus(x, middle, -1), u));
  return found.sort((a, b) => angle(a) - angle(b));
}

function across(normal) {
  const sizes = normal.map(Math.abs), axis = sizes.indexOf(Math.min(...sizes));
  const u = cross(normal, [0, 1, 2].map((k) => (k === axis ? 1 : 0)));
  const unit = scaled(u, 1 / length(u));
  return [unit, cross(normal, unit)];
}

function ring(centre, radius, u, v, count = 73) {
  return [...Array(count).keys()].map((k) => {
    const angle = (2 * Math.PI * k) / (count - 1);
    return plus(plus(centre, u, radius * Math.cos(angle)), v, radius * Math.sin(angle));
  });
}

// The page

function start(data, kernel) {
  const svg = document.querySelector("svg"), d = data.dimension, note = document.getElementById("note");
  const middle = data.limits.map(([a, b]) => (a + b) / 2), extent = Math.max(...data.limits.map(([a, b]) => b - a));
  const fresh = () => ({ points: data.points.map((x) => Float64Array.from(x)), values: data.sliders.map((x) => x.start) });
  const facing = () => ({ middle: [...middle], zoom: 1, yaw: 0.65, pitch: 0.45 });
  let state = fresh(), view = facing(), width = 0, height = 0, waiting = false, floor = "";
  const layer = (name) => svg.appendChild(document.createElementNS("http://www.w3.org/2000/svg", name));
  const style = layer("style"), ground = layer("g"), drawing = layer("g"), handles = layer("g"), words = layer("g");
  style.textContent = data.items.map((item, k) => `.c${k} { --c: color-mix(in oklab, ${CSS.supports("color", item.colour) ? item.colour : "gray"} var(--part), var(--mix)); }`).join("\n");

  const unit = () => (Math.min(width, height) / extent) * view.zoom;
  function turned(p) {
    const [x, y, z] = plus(p, view.middle, -1), [c, s] = [Math.cos(view.yaw), Math.sin(view.yaw)];
    const across = c * x + s * y, away = -s * x + c * y, [cp, sp] = [Math.cos(view.pitch), Math.sin(view.pitch)];
    return [across, cp * z + sp * away, cp * away - sp * z]; // to the right, up, away from the eye
  }
  function project(p) {
    if (d === 2) return [width / 2 + (p[0] - view.middle[0]) * unit(), height / 2 - (p[1] - view.middle[1]) * unit(), 0];
    const [x, y, away] = turned(p), near = (0.82 * unit()) / (1 + Math.max(-0.9, (0.3 * away) / extent));
    return [width / 2 + x * near, height / 2 - y * near, away];
  }
  // The place at a position on the screen; in space, at the distance of a place from the eye.
  function placeAt(sx, sy, like) {
    if (d === 2) return [view.middle[0] + (sx - width / 2) / unit(), view.middle[1] - (sy - height / 2) / unit()];
    const away = turned(like)[2], near = (0.82 * unit()) / (1 + Math.max(-0.9, (0.3 * away) / extent));
    const x = (sx - width / 2) / near, up = -(sy - height / 2) / near;
    const [cp, sp] = [Math.cos(view.pitch), Math.sin(view.pitch)], [c, s] = [Math.cos(view.yaw), Math.sin(view.yaw)];
    const z = cp * up - sp * away, back = sp * up + cp * away;
    return plus([c * x - s * back, s * x + c * back, z], view.middle);
  }
  const limits = () => {
    if (d === 3) return data.limits;
    const reach = [width, height].map((size) => size / 2 / unit());
    return view.middle.map((x, k) => [x - reach[k], x + reach[k]]);
  };

  const path = (places, close = false) => places.map((p, k) => `${k ? "L" : "M"}${p[0].toFixed(2)} ${p[1].toFixed(2)}`).join("") + (close ? "Z" : "");
  const WIDTH = 2.5, strokes = []; // polylines of the picture, which labels leave free
  const stroke = (places, more = "") => {
    const flat = places.map(project);
    strokes.push(flat);
    return `<path d="${path(flat)}" fill="none" stroke="var(--c)" stroke-width="${WIDTH}" stroke-linecap="round" stroke-linejoin="round" ${more}/>`;
  };
  const dashes = (shape) => (shape.imaginary ? 'stroke-dasharray="6 5"' : "");
  const disc = (p, radius = 5) => { const [x, y] = project(p); return `<circle cx="${x.toFixed(2)}" cy="${y.toFixed(2)}" r="${radius}" fill="var(--c)"/>`; };
  const tip = (from, to) => {
    const [a, b] = [project(from), project(to)], angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
    const wing = (turn) => [b[0] - 11 * Math.cos(angle + turn), b[1] - 11 * Math.sin(angle + turn)];
    return `<path d="${path([wing(0.4), b, wing(-0.4)])}" fill="none" stroke="var(--c)" stroke-width="2.5" stroke-linecap="round" stroke-linejoin="round"/>`;
  };

  // Return the SVG text of a shape, its distance from the eye, and the place of its label.
  function drawn(shape) {
    const depth = (p) => (d === 3 ? turned(p)[2] : 0);
    switch (shape.type) {
      case "Points": return [shape.places.map((p) => disc(p, shape.places.length < 50 ? 5 : 2)).join(""), depth(shape.places[0]) - extent, shape.places[0]];
      case "Arrow": { const zero = middle.map(() => 0); return [stroke([zero, shape.direction]) + tip(zero, shape.direction), depth(shape.direction), shape.direction]; }
      case "Line": { const ends = clipped(shape, limits()); return ends && [stroke(ends), depth(shape.point), plus(scaled(ends[0], 0.14), ends[1], 0.86)]; }
      case "Plane": {
        const places = polygon(shape, limits());
        if (!places) return null;
        const corner = places.reduce((a, b) => (turned(a)[1] > turned(b)[1] ? a : b)), centre = scaled(places.reduce((a, b) => plus(a, b)), 1 / places.length);
        return [`<path d="${path(places.map(project), true)}" fill="var(--c)" fill-opacity="0.16" stroke="var(--c)" stroke-opacity="0.45"/>`, depth(centre) + extent, plus(scaled(centre, 0.2), corner, 0.8)];
      }
      case "PointPair": {
        const ends = [-1, 1].map((sign) => plus(shape.centre, shape.direction, sign * shape.radius));
        return [stroke(ends, `stroke-opacity="0.6" ${dashes(shape)}`) + ends.map((p) => disc(p)).join(""), depth(shape.centre) - extent, ends[1]];
      }
      case "Circle": {
        const frame = shape.normal ? across(shape.normal) : [[1, 0], [0, 1]], places = ring(shape.centre, shape.radius, ...frame);
        const seen = shape.normal ? places : places.filter((p) => p.every((x, k) => Math.abs(x - view.middle[k]) < 1e4 * extent));
        return [stroke(seen, dashes(shape)), depth(shape.centre), places[9]];
      }
      case "Sphere": {
        const [x, y, away] = project(shape.centre), radius = (shape.radius * 0.82 * unit()) / (1 + Math.max(-0.9, (0.3 * away) / extent));
        const axes = [[[1, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 1]], [[0, 0, 1], [1, 0, 0]]];
        const rings = axes.map(([u, v]) => stroke(ring(shape.centre, shape.radius, u, v), `stroke-opacity="0.3" ${dashes(shape)}`)).join("");
        return [`<circle cx="${x}" cy="${y}" r="${radius}" fill="var(--c)" fill-opacity="0.13" stroke="var(--c)" stroke-width="1.5" ${dashes(shape)}/>${rings}`, away, plus(shape.centre, [0, 0, shape.radius])];
      }
      case "Chain": return [stroke(shape.places) + shape.places.map((p) => disc(p)).join(""), depth(shape.places[0]), shape.places.at(-1)];
      case "Body": {
        // A convex body: faces towards the eye, which are clockwise on a screen whose y points down, the lighter the more they face up.
        const flat = shape.places.map(project), middle = scaled(shape.places.reduce((a, b) => plus(a, b)), 1 / shape.places.length);
        const area = (face) => face.reduce((sum, k, n) => { const a = flat[k], b = flat[face[(n + 1) % face.length]]; return sum + a[0] * b[1] - b[0] * a[1]; }, 0);
        const seen = shape.faces.filter((face) => area(face) < 0).map((face) => {
          const [a, b, c] = face.map((k) => shape.places[k]), normal = cross(plus(b, a, -1), plus(c, a, -1));
          const light = 62 + 26 * (dot(normal, [0.3, -0.4, 0.87]) / (length(normal) || 1));
          const fill = `color-mix(in oklab, var(--c) ${light.toFixed(0)}%, var(--ground))`;
          return `<path d="${path(face.map((k) => flat[k]), true)}" style="fill:${fill};stroke:${fill};stroke-width:.6"/>`;
        });
        return [seen.join(""), depth(middle), middle];
      }
      case "Frame": {
        const [origin, ...ends] = shape.places, colours = ["#d62728", "#2ca02c", "#1f77b4"];
        const arrows = ends.map((p, k) => `<g style="--c:color-mix(in oklab, ${colours[k]} var(--part), var(--mix))">${stroke([origin, p])}${tip(origin, p)}</g>`);
        return [arrows.join(""), depth(origin), origin];
      }
    }
    return null;
  }

  function step(size) {
    const rough = size / 8, power = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map((x) => x * power).find((x) => x >= rough);
  }
  const text = (x, y, word, more = "") => `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" ${more}>${word}</text>`;
  const number = (x) => String(Number(x.toPrecision(6)));
  function grid() {
    const box = limits(), size = Math.min(...box.map(([a, b]) => b - a)), gap = step(d === 2 ? size : extent);
    const line = (a, b, colour) => `<path d="${path([project(a), project(b)])}" stroke="var(--${colour})" fill="none"/>`;
    const marks = ([a, b]) => { const found = []; for (let k = Math.ceil(a / gap - 1e-9); k <= b / gap + 1e-9; k++) found.push(k * gap); return found; };
    const out = [];
    if (d === 2) {
      for (const x of marks(box[0])) out.push(line([x, box[1][0]], [x, box[1][1]], Math.abs(x) < gap / 2 ? "axis" : "grid"));
      for (const y of marks(box[1])) out.push(line([box[0][0], y], [box[0][1], y], Math.abs(y) < gap / 2 ? "axis" : "grid"));
      for (const x of marks(box[0])) { const sx = project([x, 0])[0]; if (sx > 40 && sx < width - 20) out.push(text(sx, height - 6, number(x), 'class="tick" text-anchor="middle"')); }
      for (const y of marks(box[1])) { const sy = project([0, y])[1]; if (sy > 44 && sy < height - 24) out.push(text(6, sy + 4, number(y), 'class="tick"')); }
      return out.join("");
    }
    const floor = box[2][0];
    for (const x of marks(box[0])) out.push(line([x, box[1][0], floor], [x, box[1][1], floor], "grid"));
    for (const y of marks(box[1])) out.push(line([box[0][0], y, floor], [box[0][1], y, floor], "grid"));
    const corner = box.map(([a]) => a);
    ["x", "y", "z"].forEach((name, k) => {
      const end = corner.map((x, n) => (n === k ? box[k][0] + 0.3 * (box[k][1] - box[k][0]) : x)), [sx, sy] = project(end);
      out.push(line(corner, end, "axis"), text(sx + 4, sy + 4, name, 'class="tick"'));
    });
    return out.join("");
  }

  // The length of a segment inside of a box.
  function lengthIn([left, top, right, bottom], a, b) {
    if (Math.max(a[0], b[0]) < left || Math.min(a[0], b[0]) > right) return 0;
    if (Math.max(a[1], b[1]) < top || Math.min(a[1], b[1]) > bottom) return 0;
    let low = 0, high = 1;
    for (const [from, step, least, most] of [[a[0], b[0] - a[0], left, right], [a[1], b[1] - a[1], top, bottom]]) {
      if (step === 0) continue;
      const [s, t] = [(least - from) / step, (most - from) / step];
      low = Math.max(low, Math.min(s, t));
      high = Math.min(high, Math.max(s, t));
    }
    return Math.max(0, high - low) * Math.hypot(b[0] - a[0], b[1] - a[1]);
  }

  // Labels are placed where they cover the least area of points, lines and one another; the previous side is preferred.
  const measure = document.createElement("canvas").getContext("2d"), sides = new Map();
  measure.font = "600 15px system-ui, sans-serif";
  const CANDIDATES = [12, 24, 38, 54].flatMap((far) => [[1, -1], [1, 1], [-1, -1], [-1, 1], [0, -1], [0, 1], [1, 0], [-1, 0]].map(([x, y]) => [x * far, y * far * 0.9]));
  function labelled(wanted, taken) {
    const boxes = [...taken], overlap = (a, b) => Math.max(0, Math.min(a[2], b[2]) - Math.max(a[0], b[0])) * Math.max(0, Math.min(a[3], b[3]) - Math.max(a[1], b[1]));
    return wanted.map(({ k, place, label }) => {
      const [x, y] = project(place), wide = measure.measureText(label).width;
      const boxOf = ([dx, dy]) => { const left = x + dx - (dx < 0 ? wide : dx ? 0 : wide / 2); return [left - 2, y + dy - 9, left + wide + 2, y + dy + 9]; };
      const cost = (n) => {
        const box = boxOf(CANDIDATES[n]);
        const outside = box[0] < 4 || box[2] > width - 4 || box[1] < 4 || box[3] > height - 22;
        let lines = 0;
        for (const each of strokes) for (let m = 1; m < each.length; m++) lines += lengthIn(box, each[m - 1], each[m]);
        return boxes.reduce((sum, b) => sum + overlap(box, b), WIDTH * lines + (outside ? 1e5 : 0));
      };
      let best = sides.get(k) ?? 0;
      let least = cost(best);
      for (let n = 0; least > 0 && n < CANDIDATES.length; n++) {
        const own = cost(n);
        if (own < least) [best, least] = [n, own];
      }
      sides.set(k, best);
      const box = boxOf(CANDIDATES[best]);
      boxes.push(box);
      return `<g class="c${k}">${text(box[0] + 2, y + CANDIDATES[best][1] + 5, label.replace(/[<&]/g, (c) => (c === "<" ? "&lt;" : "&amp;")), 'style="fill:var(--c)"')}</g>`;
    }).join("");
  }

  // The places of a shape that labels leave free.
  function marked(shape) {
    if (shape.type === "PointPair") return [-1, 1].map((sign) => plus(shape.centre, shape.direction, sign * shape.radius));
    return shape.type === "Points" && shape.places.length < 50 ? shape.places : [];
  }

  const grips = data.points.map((_, k) => {
    const grip = document.createElementNS("http://www.w3.org/2000/svg", "g"), item = data.items.findIndex((each) => each.point === k);
    grip.setAttribute("class", `handle c${Math.max(item, 0)}`);
    grip.setAttribute("tabindex", "0");
    grip.setAttribute("role", "button");
    grip.setAttribute("aria-label", `point ${data.items[item]?.label || k + 1}`);
    grip.innerHTML = '<circle r="22" fill="transparent"/><circle r="11" fill="var(--c)" fill-opacity="0.22"/><circle r="6" fill="var(--c)" stroke="var(--ground)" stroke-width="1.5"/>';
    return handles.appendChild(grip);
  });

  function redraw() {
    waiting = false;
    const all = shapesOf(data, kernel, state.points, state.values), parts = [], wanted = [], missing = [];
    strokes.length = 0;
    const taken = state.points.map((p) => { const [x, y] = project(p); return [x - 12, y - 12, x + 12, y + 12]; });
    all.forEach((shapes, k) => {
      const item = data.items[k];
      if (!shapes) missing.push(item.label || `object ${k + 1}`);
      (shapes ?? []).forEach((shape, n) => {
        const found = drawn(shape);
        if (!found) return;
        if (item.point === undefined) parts.push([found[1], `<g class="c${k}">${found[0]}</g>`]);
        for (const p of marked(shape)) { const [x, y] = project(p); taken.push([x - 7, y - 7, x + 7, y + 7]); }
        if (n === 0 && item.label) wanted.push({ k, place: found[2], label: item.label });
      });
    });
    parts.sort((a, b) => b[0] - a[0]);
    const below = grid();
    if (below !== floor) ground.innerHTML = floor = below; // unless the view changes, the browser keeps what it painted
    drawing.innerHTML = parts.map((part) => part[1]).join("");
    grips.forEach((grip, k) => { const [x, y] = project(state.points[k]); grip.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`); });
    wanted.sort((a, b) => (data.items[b.k].point !== undefined) - (data.items[a.k].point !== undefined));
    words.innerHTML = labelled(wanted, taken);
    note.textContent = missing.length ? `Undefined here: ${missing.join(", ")}` : "";
    inputs.forEach((input, k) => { if (document.activeElement !== input || input.value !== String(state.values[k])) input.value = state.values[k]; outputs[k].textContent = state.values[k].toFixed(2); });
  }
  const changed = () => { if (!waiting) { waiting = true; requestAnimationFrame(redraw); } };

  // Sliders, which play as an animation
  const inputs = [], outputs = [], playing = new Map();
  for (const [k, slider] of data.sliders.entries()) {
    const label = document.createElement("label");
    label.innerHTML = '<button type="button"></button><span class="name"></span><input type="range" step="any"><output></output>';
    const [button, name, input, output] = label.children;
    name.textContent = slider.name;
    button.textContent = "▶";
    button.setAttribute("aria-label", `Play ${slider.name}`);
    Object.assign(input, { min: slider.low, max: slider.high, value: slider.start });
    input.addEventListener("input", () => { state.values[k] = input.valueAsNumber; changed(); });
    button.addEventListener("click", (event) => {
      event.preventDefault();
      if (playing.has(k)) playing.delete(k); else playing.set(k, { way: 1, time: performance.now() });
      button.textContent = playing.has(k) ? "❚❚" : "▶";
      requestAnimationFrame(tick);
    });
    inputs.push(input);
    outputs.push(output);
    document.getElementById("sliders").appendChild(label);
  }
  const TURN = 2 * Math.PI, SECONDS = 5;
  function tick(now) {
    for (const [k, play] of playing) {
      const { low, high } = data.sliders[k], span = high - low, turns = Math.abs(span - TURN) < 0.05;
      let value = state.values[k] + (play.way * span * Math.min(100, now - play.time)) / (1000 * SECONDS);
      if (turns && value > high) value -= span;
      if (value > high || value < low) { play.way = value > high ? -1 : 1; value = Math.min(high, Math.max(low, value)); }
      play.time = now;
      state.values[k] = value;
    }
    if (playing.size) { redraw(); requestAnimationFrame(tick); }
  }

  // Pointers: a point is dragged, two pointers zoom, and the background moves the picture or turns it.
  const pointers = new Map();
  const position = (event) => { const box = svg.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
  svg.addEventListener("pointerdown", (event) => {
    const grip = grips.indexOf(event.target.closest(".handle"));
    pointers.set(event.pointerId, { grip, at: position(event) });
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const at = position(event), [dx, dy] = plus(at, pointer.at, -1);
    const others = [...pointers.values()].filter((each) => each !== pointer && each.grip < 0);
    if (pointer.grip >= 0) state.points[pointer.grip].set(placeAt(...at, state.points[pointer.grip]));
    else if (others.length) view.zoom *= length(plus(at, others[0].at, -1)) / Math.max(1, length(plus(pointer.at, others[0].at, -1)));
    else if (d === 2) { view.middle[0] -= dx / unit(); view.middle[1] += dy / unit(); }
    else { view.yaw -= dx * 0.008; view.pitch = Math.min(1.5, Math.max(-1.5, view.pitch + dy * 0.008)); }
    pointer.at = at;
    changed();
  });
  for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, (event) => pointers.delete(event.pointerId));
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey && window.frameElement) return; // a page that contains the scene scrolls
    event.preventDefault();
    view.zoom *= Math.exp(-0.002 * event.deltaY);
    changed();
  }, { passive: false });
  grips.forEach((grip, k) => grip.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way) return;
    event.preventDefault();
    state.points[k].set(placeAt(...plus(project(state.points[k]).slice(0, 2), way, event.shiftKey ? 20 : 4), state.points[k]));
    changed();
  }));

  document.getElementById("reset").addEventListener("click", () => { state = fresh(); view = facing(); playing.clear(); document.querySelectorAll("#sliders button").forEach((each) => { each.textContent = "▶"; }); changed(); });
  document.getElementById("export").addEventListener("click", () => {
    const copy = svg.cloneNode(true), names = ["--ground", "--text", "--faint", "--grid", "--axis", "--mix", "--part"], own = getComputedStyle(document.documentElement);
    copy.setAttribute("viewBox", `0 0 ${width} ${height}`);
    copy.setAttribute("style", names.map((name) => `${name}:${own.getPropertyValue(name)}`).join(";") + ";font:600 15px sans-serif");
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([new XMLSerializer().serializeToString(copy)], { type: "image/svg+xml" }));
    link.download = "scene.svg";
    link.click();
  });

  // Dark where the page around the scene is dark, or else where the system is.
  const system = matchMedia("(prefers-color-scheme: dark)");
  function theme() {
    let outer = null;
    try { outer = window.parent !== window ? window.parent.document.body : null; } catch { outer = null; }
    const named = outer?.dataset.theme, jupyter = outer?.dataset.jpThemeLight;
    const dark = named === "dark" || named === "light" ? named === "dark" : jupyter ? jupyter === "false" : system.matches;
    document.documentElement.classList.toggle("dark", dark);
  }
  theme();
  system.addEventListener("change", theme);
  try { if (window.parent !== window) new MutationObserver(theme).observe(window.parent.document.body, { attributes: true }); } catch { /* another origin */ }
  new ResizeObserver(() => { const box = svg.getBoundingClientRect(); [width, height] = [box.width, box.height]; redraw(); }).observe(svg);
  window.liveScene = { state: () => state, project, redraw, shapes: () => shapesOf(data, kernel, state.points, state.values) };
}
