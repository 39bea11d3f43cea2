// The compiler in a worker: Pyodide, with the packages of packages.zip, runs report.py.

const FOLDER = "/packages";

/** Return a function from the text of a spec to the object that report.py describes. */
export async function compiler(loadPyodide, options, archive, program, say) {
  say("starting Python");
  const python = await loadPyodide(options);
  say("unpacking the compiler");
  python.FS.mkdirTree(FOLDER);
  python.unpackArchive(archive, "zip", { extractDir: FOLDER });
  python.runPython(`import sys; sys.path.insert(0, "${FOLDER}")`);
  say("importing the compiler");
  python.runPython(program);
  const report = python.globals.get("report");
  return (text) => JSON.parse(report(text));
}

async function fetched(path, kind) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`${path}: ${answer.status} ${answer.statusText}`);
  return answer[kind]();
}

if (typeof WorkerGlobalScope !== "undefined") {
  const say = (status) => postMessage({ status });
  const ready = (async () => {
    const { pyodide } = await fetched("places.json", "json");
    say("loading Pyodide");
    const base = new URL(pyodide, location.href).href;
    const [{ loadPyodide }, archive, program] = await Promise.all([
      import(`${base}pyodide.mjs`), fetched("packages.zip", "arrayBuffer"), fetched("report.py", "text"),
    ]);
    const found = await compiler(loadPyodide, { indexURL: base }, archive, program, say);
    say("ready");
    return found;
  })();
  ready.catch((error) => postMessage({ failed: String(error.message ?? error) }));
  addEventListener("message", async ({ data }) => {
    const compile = await ready.catch(() => null);
    if (!compile) return;
    try {
      postMessage({ id: data.id, report: compile(data.text) });
    } catch (error) {
      const lines = String(error.message).split("\n").filter((line) => /^\w*(Error|Exception|Interrupt)\b/.test(line));
      postMessage({ id: data.id, report: { error: lines.at(-1) ?? String(error.message) } });
    }
  });
}
