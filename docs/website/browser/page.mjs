// The page of the playground: it sends text to the worker, and shows and runs what comes back.

const EXAMPLES = {
  "a screw": `"""A point on a screw."""

from gacompiler import SCALAR, exp, kernel, sandwich
from gacompiler.algebra.catalog import PGA3

E1, E2, E3, E0 = PGA3.basis()


@kernel(angle=SCALAR, pitch=SCALAR, p=PGA3.POINT)
def screw(angle, pitch, p):
    """Turn \`p\` about the third axis, and move it along."""
    turn = exp(-angle / 2 * E1 * E2)
    move = 1 - pitch * angle / 2 * E0 * E3
    return sandwich(move * turn, p)
`,
  "two mirrors": `"""Reflections."""

from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3


@kernel(first=PGA3.UNIT_PLANE, second=PGA3.UNIT_PLANE, p=PGA3.POINT)
def reflect_twice(first, second, p):
    """The reflection of \`p\` in \`first\` and then in \`second\`."""
    return sandwich(second * first, p)
`,
  "an arm": `"""A planar arm, whose links have the length one."""

from gacompiler import SCALAR, array, cos, fold, kernel, sin
from gacompiler.algebra.catalog import VGA2

E1, E2 = VGA2.basis()


@kernel(q=array(SCALAR, "n"))
def direction(q):
    """The direction of the last link."""
    return fold(lambda r, angle: r * (cos(angle / 2) - sin(angle / 2) * E1 * E2), 1, q)
`,
};
const COLOURS = ["#2f7de1", "#d9822b", "#2e9e5b", "#c2416b", "#7d5bd0", "#008b8b", "#a0722a", "#6b7785"];
const STEPS = 240;
const get = (id) => document.getElementById(id);
let worker = null, sent = 0, found = null, program = null, tab = "Counts";

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function say(text, isBad = false) {
  get("status").textContent = text;
  get("status").classList.toggle("bad", isBad);
}

function compile() {
  if (!worker) {
    worker = new Worker("worker.mjs", { type: "module" });
    worker.onmessage = ({ data }) => receive(data);
    worker.onerror = (event) => stop(event.message ?? "the worker did not start; open this page from a server");
  }
  get("compile").textContent = "Compile";
  get("compile").disabled = true;
  say("compiling ...");
  worker.postMessage({ id: ++sent, text: get("spec").value });
}

function stop(text) {
  say(text, true);
  get("compile").disabled = false;
  worker?.terminate();
  worker = null;
}

function receive(data) {
  if (data.status) return say(`${data.status} ...`);
  if (data.failed) return stop(`cannot load: ${data.failed}`);
  if (data.id !== sent) return undefined;
  get("compile").disabled = false;
  if (data.report.error) return say(data.report.error, true);
  return show(data.report);
}

async function show(report) {
  found = report;
  say(`compiled and proved in ${report.seconds.toFixed(1)} s`);
  get("results").hidden = false;
  const names = ["Counts", "Stages", ...Object.keys(report.files)];
  get("tabs").replaceChildren(...names.map((name) => {
    const button = element("button", { role: "tab" }, name);
    button.onclick = () => { tab = name; showTab(); };
    return button;
  }));
  showTab();
  const url = URL.createObjectURL(new Blob([report.files.JavaScript], { type: "text/javascript" }));
  program = await import(url);
  URL.revokeObjectURL(url);
  const runnable = report.kernels.filter((kernel) => kernel.inputs?.some((part) => part.blades.length));
  get("run").hidden = !runnable.length;
  get("unrun").hidden = report.kernels.every((kernel) => kernel.inputs);
  get("kernel").replaceChildren(...runnable.map(({ name }) => element("option", {}, name)));
  if (runnable.length) chooseKernel();
}

function showTab() {
  for (const button of get("tabs").children) button.setAttribute("aria-selected", button.textContent === tab);
  if (tab === "Counts") {
    const rows = found.kernels.map((each) => element("tr", {}, element("td", {}, each.name), element("td", {}, each.cost)));
    const head = element("tr", {}, element("th", {}, "kernel"), element("th", {}, "operations"));
    get("shown").replaceChildren(element("table", {}, head, ...rows));
  } else if (tab === "Stages") {
    const texts = found.kernels.flatMap((each) => each.stages.map(([name, text]) => `${each.name}: ${name}\n\n${text}`));
    get("shown").replaceChildren(element("pre", { tabindex: "0" }, texts.join("\n\n\n")));
  } else {
    get("shown").replaceChildren(element("pre", { tabindex: "0" }, found.files[tab]));
  }
}

const chosen = () => found.kernels.find((kernel) => kernel.name === get("kernel").value);

function chooseKernel() {
  const kernel = chosen(), along = [];
  get("inputs").replaceChildren(...kernel.inputs.filter((part) => part.blades.length).map((part) => {
    const fields = part.blades.map((blade, k) => {
      along.push(element("option", { value: `${part.name} ${k}` }, blade ? `${part.name}.${blade}` : part.name));
      const start = part.unit ? Number(k === 0) : Number(k < 2);
      const input = element("input", { type: "number", step: "any", value: start, "data-part": part.name });
      input.oninput = draw;
      return element("label", {}, blade || "number", input);
    });
    return element("fieldset", {}, element("legend", {}, part.unit ? `${part.name}, of unit norm` : part.name), ...fields);
  }));
  get("along").replaceChildren(...along);
  draw();
}

/** The results of a kernel, flat, at one value of the number that changes. */
function results(kernel, value) {
  const [name, place] = get("along").value.split(" ");
  const given = kernel.inputs.map((part) => {
    const fields = [...get("inputs").querySelectorAll("input")].filter((input) => input.dataset.part === part.name);
    const numbers = fields.map((input) => Number(input.value));
    if (part.name === name) numbers[place] = value;
    return part.scalar ? numbers[0] : numbers;
  });
  const run = program[kernel.name] ?? program[`${kernel.name}_`];
  const made = run(...given);
  const several = kernel.outputs.length > 1 ? made : [made];
  return several.flatMap((one) => (typeof one === "number" ? [one] : [...one]));
}

function draw() {
  const kernel = chosen(), from = Number(get("from").value), to = Number(get("to").value);
  const labels = kernel.outputs.flatMap((part) => part.blades.map((blade) => (blade ? `${part.name}.${blade}` : part.name)));
  const values = Array.from({ length: STEPS + 1 }, (_, k) => results(kernel, from + (to - from) * k / STEPS));
  const finite = values.flat().filter(Number.isFinite);
  let low = Math.min(0, ...finite), high = Math.max(0, ...finite);
  if (high === low) [low, high] = [-1, 1];
  const { width, height } = get("plot").getBoundingClientRect();
  const x = (k) => 44 + (width - 56) * k / STEPS, y = (v) => height - 22 - (height - 36) * (v - low) / (high - low);
  const share = Number(get("at").value), t = from + (to - from) * share;
  const line = (x1, y1, x2, y2, stroke) => `<line x1="${x1}" y1="${y1}" x2="${x2}" y2="${y2}" stroke="${stroke}"/>`;
  const parts = [line(x(0), y(0), x(STEPS), y(0), "var(--axis)"), line(x(0), y(low), x(0), y(high), "var(--axis)"),
    line(x(STEPS * share), y(low), x(STEPS * share), y(high), "var(--grid)")];
  for (const v of new Set([low, 0, high])) parts.push(`<text x="40" y="${y(v) + 4}" text-anchor="end">${Number(v.toPrecision(3))}</text>`);
  parts.push(`<text x="${x(0)}" y="${height - 6}">${from}</text><text x="${x(STEPS)}" y="${height - 6}" text-anchor="end">${to}</text>`);
  labels.forEach((_, n) => {
    let path = "", isDown = false;
    values.forEach((row, k) => {
      if (Number.isFinite(row[n])) path += `${isDown ? "L" : "M"}${x(k).toFixed(1)} ${y(row[n]).toFixed(1)}`;
      isDown = Number.isFinite(row[n]);
    });
    parts.push(`<path d="${path}" fill="none" stroke="${COLOURS[n % COLOURS.length]}" stroke-width="2"/>`);
  });
  get("plot").innerHTML = parts.join("");
  get("t").textContent = t.toPrecision(4);
  const now = results(kernel, t);
  get("values").replaceChildren(...labels.flatMap((label, n) => {
    const swatch = element("span", { class: "swatch", style: `background: ${COLOURS[n % COLOURS.length]}` });
    return [swatch, `${label} = ${now[n].toPrecision(6)}`, element("br")];
  }));
}

get("examples").replaceChildren(...Object.keys(EXAMPLES).map((name) => element("option", {}, name)));
get("examples").onchange = () => { get("spec").value = EXAMPLES[get("examples").value]; };
get("spec").value = Object.values(EXAMPLES)[0];
get("compile").onclick = compile;
get("spec").addEventListener("keydown", (event) => {
  if (event.key === "Enter" && (event.ctrlKey || event.metaKey) && !get("compile").disabled) compile();
});
get("kernel").onchange = chooseKernel;
for (const id of ["along", "from", "to", "at"]) get(id).oninput = draw;
addEventListener("resize", () => { if (found && !get("run").hidden) draw(); });
fetch("places.json").then((answer) => answer.json()).then(({ pyodide, archive }) => {
  get("size").textContent = ` (${(archive / 1e6).toFixed(1)} MB)`;
  get("place").textContent = new URL(pyodide, location.href).host === location.host ? "this site" : new URL(pyodide).host;
}).catch(() => say("Open this page from a server, for example by python -m http.server; browsers do not run it from a file.", true));
