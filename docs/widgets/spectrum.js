// Section 6 on a coarse mesh: the eigenvalues under the V of one theta, and a run of that theta step by step.
nd.onPage("spectrum", (figure) => {
  "use strict";
  const { roles, thetas } = ndData.spectrum, LEAST = 1e-10;
  const STATE = { s: ["stick", nd.COLOURS.green, "●"], l: ["slip", nd.COLOURS.orange, "▲"], o: ["open", "#dddddd", "○"] };

  const all = roles[1].eigenvalues, growing = all.filter((x) => ndFormulas.predictedFactor(0.6, x) > 1).length;

  const widget = nd.build(figure, {
    name: "spectrum",
    question: "theta = 0.6 works well with the lower, stiffer body as Neumann body. What happens if the roles are swapped?",
    answers: ["it works as well", "it is slower", "it does not converge"],
    right: "it does not converge",
    wrong: { "it works as well": "the other role has other eigenvalues.", "it is slower": "it would be, at a smaller theta." },
    reveal: () => `it does not converge. Swapping the roles turns each eigenvalue into its inverse. ${growing} of ${all.length} now exceed `
      + `2/theta - 1 = ${nd.short(2 / 0.6 - 1)}, where the factor is 1; the largest of them, rho, has the largest factor.`,
    show: () => { theta.value = thetas.indexOf(0.6); step.value = 39; swap.on = true; },
    draw,
  });
  const theta = nd.slider(widget, { name: "theta", label: "theta", low: 0, high: thetas.length - 1, step: 1,
    value: thetas.indexOf(0.6), show: (i) => thetas[i].toFixed(2) });
  const step = nd.slider(widget, { name: "step", label: "step", low: 0, high: 39, step: 1, value: 0 });
  const swap = nd.button(widget, "swap", "swap the roles", () => {});
  const v = new nd.Chart({ label: "Factor of each eigenvalue", x: { low: 0, high: 1, name: "eigenvalue" }, y: { low: 0, high: 2, name: "factor a step" } });
  const residuals = new nd.Chart({ label: "Residual over the steps", x: { low: 0, high: 40, name: "step" },
    y: { low: LEAST, high: 10, log: true, name: "relative residual" } });
  const strip = nd.html("div", { class: "strip", role: "img" });
  widget.pictures.append(v.root, residuals.root, strip);

  function draw() {
    const role = roles[swap.on ? 1 : 0], t = thetas[theta.value], run = role.runs[theta.value];
    const n = Math.min(step.value, run.residuals.length - 1), values = role.eigenvalues, rho = values[values.length - 1];
    const factor = (x) => Math.abs(1 - t * (1 + x)), most = 1.1 * rho, high = Math.max(1.2, Math.min(1.1 * factor(rho), 12));
    v.axes({ low: 0, high: most, name: "eigenvalue, contact body over Neumann body" }, { low: 0, high, name: "factor a step" });
    v.clear();
    v.line([[0, 1], [most, 1]], { stroke: nd.COLOURS.grey, "stroke-width": 1 });
    v.line(Array.from({ length: 121 }, (_, i) => [most * i / 120, factor(most * i / 120)]), { stroke: nd.COLOURS.blue });
    for (const x of values) v.line([[x, 0], [x, factor(x)]], { stroke: nd.COLOURS.red, "stroke-width": 1 });
    for (const x of values) v.dot(x, factor(x), { fill: nd.COLOURS.red, r: 2.5 });
    v.dot(0, factor(0), { fill: "none", stroke: nd.COLOURS.grey, "stroke-width": 2 });
    v.dot(rho, factor(rho), { fill: nd.COLOURS.orange, r: 4 });
    v.note(rho, factor(rho), "rho", { "text-anchor": "end", dx: -4, dy: -9, "font-style": "italic" });
    v.note(0.98 * most, 1 - 0.05 * high, "above 1: grows", { "text-anchor": "end", dy: -18 });
    v.note(0.03 * most, factor(0) + (swap.on ? 0.22 : 0.05) * high, "an open node"); // above the stems of the swapped roles

    residuals.clear();
    const seen = run.residuals.map((r, i) => [i, Math.max(r, LEAST)]);
    residuals.line(seen, { stroke: nd.COLOURS.blue });
    residuals.dot(...seen[n], { fill: nd.COLOURS.red });

    strip.replaceChildren(...run.states.slice(0, n + 1).slice(-12).map((states, i, shown) => nd.html("div", { class: i === shown.length - 1 ? "now" : "" },
      nd.html("span", { class: "count" }, String(n - shown.length + 1 + i)),
      ...[...states].map((s) => nd.html("span", { style: `background:${STATE[s][1]}`, title: STATE[s][0] }, STATE[s][2])))));
    const now = run.states[n], count = (s) => [...now].filter((c) => c === s).length;
    strip.setAttribute("aria-label", `States of the nodes up to step ${n}: ${count("s")} stick, ${count("l")} slip, ${count("o")} open at the end`);

    const worst = ndFormulas.predictedFactor(t, rho);
    widget.says.textContent = `${role.neumann} body Neumann, rho = ${nd.short(rho)}, theta = ${t.toFixed(2)}: the largest factor is ${nd.short(worst)}; `
      + `2/(2 + rho) = ${nd.short(ndFormulas.predictedTheta(rho))}. Step ${n}: residual ${run.residuals[n].toExponential(1)}; `
      + `${count("s")} node${count("s") === 1 ? " sticks" : "s stick"} ●, ${count("l")} slip ▲, ${count("o")} open ○.`;
    nd.fill(widget.table, ["step", "residual", "states"], run.residuals.map((r, i) => [i, r.toExponential(2), [...run.states[i]].map((s) => STATE[s][2]).join("")]));
  }
  nd.start(widget, figure);
});
