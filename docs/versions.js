// The choice of a version, on a site that .ci/publish.py has put beside others; nothing elsewhere, nor from disk.
(() => {
  const here = new URL("../", document.currentScript.src); // the folder of this version
  if (!location.protocol.startsWith("http")) return;
  const show = (names) => {
    const choice = document.createElement("select");
    choice.setAttribute("aria-label", "Version of the documentation");
    choice.className = "versions";
    for (const name of names) choice.add(new Option(name, name, false, here.pathname.endsWith(`/${name}/`)));
    choice.onchange = async () => {
      const there = new URL(`../${choice.value}/`, here);
      const page = new URL(location.href.slice(here.href.length), there);
      const found = await fetch(page, { method: "HEAD" }).catch(() => null);
      location.href = found && found.ok ? page : there;
    };
    const brand = document.querySelector(".sidebar-brand");
    if (brand) brand.after(choice);
  };
  document.addEventListener("DOMContentLoaded", async () => {
    const found = await fetch(new URL("../versions.json", here)).catch(() => null);
    if (found && found.ok) show(await found.json());
  });
})();
