// The map of the proof: a box opens its statement; an edge is as wide as what its step loses at the values of the sliders.
// Losses that are eigenvalues follow from formulas; those found by search are known at the problem's own values only.
(() => {
  "use strict";
  const CHAINS = { links: "the inequality by itself", friction: "the friction term to (5.30)", lipschitz: "the change of T to (5.38)" };
  const INEQUALITIES = { "(5.13)": "friction by displacements", "(5.11)": "one displacement by the other", "(5.19)": "displacement by force", "(5.23)": "dual by energy norm" };
  const PARTS = { claims: "Statement", wrong: "What is wrong", repair: "Repaired", proof: "Proof", reading: "Rests on", note: "Note" };

  // Text with formulas between dollar signs, for MathJax.
  const tex = (text) => text.split("$").map((part, i) => (i % 2 ? nd.html("span", { class: "math notranslate nohighlight" }, `\\(${part}\\)`) : part));

  function make(figure, name) {
    const f = ndFormulas, data = ndData[name], { base, own, steps, width } = data;
    const unitStep = data.losses.friction.find((loss) => loss.only_unit);
    const links = data.losses.friction.filter((loss) => loss !== unitStep), largest = links.reduce((a, b) => (a.decades > b.decades ? a : b));
    const option = ({ label }) => `${label}, ${INEQUALITIES[label]}`, noLink = "none of these: the unit of stress";
    const widget = nd.build(figure, {
      name,
      question: "On the way from the largest friction term found to its printed bound (5.30): which step adds the most powers of ten?",
      answers: [...links.map(option), noLink],
      right: largest.decades < unitStep.decades ? noLink : option(largest),
      wrong: Object.fromEntries(links.map((loss) => [option(loss), loss === largest ? "no inequality adds more, but another step does."
        : `it adds ${loss.decades.toFixed(1)}, and another inequality adds more.`])),
      reveal: () => `in MPa the unit of stress adds ${unitStep.decades.toFixed(1)}, although no inequality loses anything there. `
        + `Of the inequalities ${largest.label} loses most: ${largest.decades.toFixed(1)}.`,
      show: () => centre(),
      draw,
    });
    const log = { ratio: Math.log10(own.ratio), k: Math.log10(own.k) };
    const ratio = nd.slider(widget, { name: "ratio", label: "E1/E2", low: log.ratio - 2, high: log.ratio + 2, step: 0.05, value: log.ratio, show: (v) => nd.short(10 ** v) });
    const friction = nd.slider(widget, { name: "k", label: "friction k", low: log.k - 4, high: log.k + 1, step: 0.05, value: log.k, show: (v) => nd.short(10 ** v) });
    const unit = nd.slider(widget, { name: "unit", label: "unit of stress", low: -3, high: 6, step: 0.1, value: 0, show: (v) => `${nd.short(10 ** v)} MPa` });
    widget.controls.append(nd.html("button", { type: "button", name: "own",
      onclick: () => { ratio.value = log.ratio; friction.value = log.k; unit.value = 0; } }, "the problem's own values"));

    // Break the proof: a step of the friction term without its loss, and the threshold that the rest would give.
    const breaks = data.losses.friction.map(({ label }, i) => [label, nd.button(widget, `without${i}`, label === unitStep.label ? "without the unit of stress" : `${label} without its loss`, () => {})]);
    const broke = nd.html("p", { class: "legend broke", "aria-live": "polite" });
    widget.controls.append(broke);
    const replaced = () => breaks.filter(([, toggle]) => toggle.on).map(([label]) => label);
    const threshold = (labels) => nd.digits(data.broken[labels.join(" ")]);

    const frame = nd.html("div", { class: "map-frame" }), panel = nd.html("div", { class: "panel", tabindex: "-1", "aria-live": "polite" }, "Choose a box: its statement opens here.");
    frame.innerHTML = data.svg;
    widget.pictures.append(frame, panel);
    const edges = [...frame.querySelectorAll("[data-edge]")], boxes = {};
    for (const box of frame.querySelectorAll(".node")) {
      const { id } = box.dataset, node = data.nodes[id];
      boxes[id] = box;
      box.setAttribute("tabindex", "0");
      box.setAttribute("role", "button");
      const lines = [...box.querySelectorAll("text")];
      lines.forEach((line) => line.append(" ")); // what is seen is a part of what is read out, word by word
      box.setAttribute("aria-label", `${lines.map((line) => line.textContent).join("").trim()}: ${node.verdict}`);
      box.addEventListener("click", () => open(id));
      box.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); open(id); } });
    }

    function open(id) {
      const node = data.nodes[id], site = figure.dataset.site;
      for (const [other, box] of Object.entries(boxes)) box.classList.toggle("open", other === id);
      for (const edge of edges) edge.classList.toggle("near", edge.dataset.edge.split(" ").includes(id));
      const list = nd.html("dl");
      const say = (term, ...content) => list.append(nd.html("dt", {}, term), nd.html("dd", {}, ...content));
      say("Verdict", node.verdict);
      for (const [part, term] of Object.entries(PARTS)) if (node[part]) say(term, ...tex(node[part]));
      if (node.leans.length) {
        say("Leans on", ...node.leans.map((other) => (boxes[other]
          ? nd.html("button", { type: "button", onclick: () => { boxes[other].scrollIntoView({ block: "nearest", inline: "nearest" }); open(other); } }, data.nodes[other].name)
          : nd.html("code", {}, other))));
      }
      say("On this site", nd.html("a", { href: `${site}generated/equations.html#${node.at}` }, "code, tests and pages"), ", ",
        nd.html("a", { href: `${site}generated/ledger.html` }, "the ledger with all evidence"));
      panel.replaceChildren(nd.html("p", { class: "name" }, `${node.name}: `, ...tex(node.title)), list);
      panel.onkeydown = (event) => { if (event.key === "Escape") boxes[id].focus(); };
      panel.focus({ preventScroll: true });
      panel.scrollIntoView({ block: "nearest" });
      if (window.MathJax && window.MathJax.typesetPromise) window.MathJax.typesetPromise([panel]);
    }

    // The decades of each chain that follow from formulas, by label.
    function known() {
      const E1 = base.E2 * 10 ** ratio.value, { E2 } = base, u = 10 ** unit.value;
      const [m, M, scale] = f.constants(E1, E2, u, base.m1, base.m2, base.M1, base.M2, base.Cs1, base.Cs2, base.Ctr);
      const suprema = Object.values(data.suprema).map(([value, a, b]) => value * (E2 / u) ** a * (E1 / u) ** b);
      const q = f.lossQuotients(m, M, base.CR, ...suprema).map(Math.log10), x = 10 ** friction.value * scale;
      const repaired = f.P(x, m, M, base.CR, m), printed = f.P(x, f.readPrinted(m), M, base.CR, 1);
      const links = Object.fromEntries(data.exact.map((label, i) => [label, label === "(5.29)" ? q[i] : q[i] / 2]));
      return { m, repaired, printed, links, lipschitz: { "(5.19)": q[5] / 2, "(5.23)": q[3] / 2 },
        friction: { "(5.19)": q[5], "(5.23)": q[3], [unitStep.label]: Math.log10(printed / repaired) } };
    }

    function draw() {
      const now = known(), here = Math.abs(ratio.value - log.ratio) + Math.abs(friction.value - log.k) < 1e-9;
      // The decades of a loss, null where they are not known.
      const off = replaced(), at = (chain, { label, decades }) => (chain === "friction" && off.includes(label) ? 0 : now[chain][label] ?? (here ? decades : null));
      const more = Math.max(at("friction", unitStep), 0), pixels = (decades) => Math.min(width.thin + width.decade * Math.max(decades, 0), width.most);
      for (const edge of edges.filter((each) => steps[each.dataset.edge])) {
        const [chain, labels] = steps[edge.dataset.edge];
        const lost = data.losses[chain].filter((loss) => labels.includes(loss.label)).map((loss) => at(chain, loss));
        const sum = lost.includes(null) ? null : lost.reduce((a, b) => a + b, 0), printed = edge.classList.contains("printed");
        edge.classList.toggle("unknown", sum === null && !printed);
        edge.setAttribute("stroke-width", pixels(widget.revealed ? (sum ?? 0) + (printed ? more : 0) : 0).toFixed(1));
        edge.dataset.decades = (printed ? at("friction", unitStep) : sum) ?? "";
      }
      const rows = Object.entries(CHAINS).flatMap(([chain, words]) => data.losses[chain].map((loss) => {
        const value = at(chain, loss);
        return [words, loss.label, value === null ? "not known here" : value.toFixed(2), loss.only_unit ? "the unit of stress" : loss.searched ? "search: may be less" : "eigenvalue"];
      }));
      nd.fill(widget.table, ["from", "inequality", "powers of ten lost", "found by"], rows);
      broke.textContent = `As printed the proof gives contraction for every small theta where k < ${threshold([])}, in MPa and at the problem's own values`
        + (off.length ? `; without the loss of ${off.map((label) => (label === unitStep.label ? "the unit" : label)).join(", ")} it would be k < ${threshold(off)}. `
          + (off.some((label) => label !== unitStep.label) ? "That is no proof: the values stand for the estimates, and were found at one friction." : "") : ".");
      widget.says.textContent = `Section 6 with E1/E2 = ${nd.short(10 ** ratio.value)}, k = ${nd.short(10 ** friction.value)}, m = ${nd.short(now.m)}: `
        + `the bound (5.30) of the friction term is ${nd.digits(now.repaired)} as repaired, ${nd.digits(now.printed)} as printed. `
        + (now.m < 1 ? "As m < 1, the printed proof does not reach its bound. " : "")
        + (here ? "All widths belong to these values. Losses found by search may be less."
          : `Dotted edges belong to pairs that were searched only at E1/E2 = ${nd.short(own.ratio)}, k = ${nd.short(own.k)}: their loss is not known here.`);
    }

    nd.start(widget, figure);
    // The boxes of the question in the middle of the frame, or after the answer the edge behind (5.30); where they do not
    // fit, the bound (5.30).
    const asked = ["5.30", ...Object.keys(steps).filter((edge) => edge.endsWith(" 5.30")).map((edge) => edge.split(" ")[0])];
    function centre() {
      const view = frame.getBoundingClientRect();
      const off = (ids, start, end, size) => {
        const places = ids.map((id) => boxes[id].getBoundingClientRect());
        const [low, high] = [Math.min(...places.map((one) => one[start])), Math.max(...places.map((one) => one[end]))];
        return (high - low <= size ? low + high : places[0][start] + places[0][end]) / 2 - view[start] - size / 2;
      };
      frame.scrollBy(off(asked, "left", "right", view.width), off(widget.revealed ? ["5.30", "5.31"] : asked, "top", "bottom", view.height));
    }
    new ResizeObserver(centre).observe(frame);
    figure.addEventListener("zoomed", centre); // a deck makes its letters larger
    centre();
  }

  for (const name of ["map", "chain"]) nd.onPage(name, (figure) => make(figure, name));
})();
