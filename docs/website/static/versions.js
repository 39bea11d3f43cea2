// Offers the same page of other versions, if the folder beside this site lists them (website/versions.py).
addEventListener("DOMContentLoaded", () => {
  const root = new URL(document.documentElement.dataset.content_root ?? "./", location.href);
  const list = document.createElement("script");
  list.src = new URL("../versions.js", root);
  list.onload = () => offer(root, window.siteVersions ?? []);
  document.head.append(list);
});

function offer(root, versions) {
  const place = document.querySelector(".sidebar-brand");
  if (!place || versions.length < 2) return;
  const own = decodeURIComponent(root.pathname.split("/").at(-2));
  const page = location.href.slice(root.href.length);
  const choice = document.createElement("select");
  choice.className = "versions";
  choice.ariaLabel = "Version";
  choice.append(...versions.map((version) => new Option(version, version, false, version === own)));
  choice.onchange = async () => {
    const start = new URL(`../${encodeURIComponent(choice.value)}/`, root);
    const same = new URL(page, start);
    // Files cannot be looked up; a page that another version has not is reported by the browser.
    const exists = location.protocol === "file:" || (await fetch(same, { method: "HEAD" })).ok;
    location.href = exists ? same : new URL("index.html", start);
  };
  place.after(choice);
}
