// Two bars: the map of one step as a cobweb, and its two slopes over theta; theta is one handle for both.
nd.onPage("cobweb", (figure) => {
  "use strict";
  const { S1, S2, moved } = ndData.cobweb, rho = S1 / S2, best = ndFormulas.predictedTheta(rho);
  const T = (g) => Math.max(0, S1 * moved - rho * g);
  const most = S1 * moved * 1.05, steps = 24;

  const widget = nd.build(figure, {
    name: "cobweb",
    question: "The blue line gives the next force for each force g, without relaxation (theta = 1). Start at 0: up to the "
      + "blue line, sideways to the dashed one, and again. Where does this end?",
    answers: ["at the star, where the lines cross", "nowhere: it goes round for ever", "nowhere: the force grows without limit"],
    right: "nowhere: it goes round for ever",
    wrong: { "at the star, where the lines cross": "at the star the blue line is steeper than the diagonal, so a step from beside it leads away.",
      "nowhere: the force grows without limit": "where the bars part the force is zero, and there it starts again." },
    reveal: () => `it goes round between 0 and ${nd.short(T(0))}. In contact the blue line is steeper than the diagonal (rho = ${rho}), so each `
      + "step leads further from the star, until the bars part; then the force is 0 again. Now move theta: the dot of the larger "
      + "factor must come below 1. Where is it lowest?",
    show: () => { theta.value = 1; },
    draw,
  });
  const theta = nd.slider(widget, { name: "theta", label: "theta", low: 0.01, high: 1, step: 0.01, value: 1, show: (v) => v.toFixed(2) });
  const web = new nd.Chart({ label: "Cobweb of the forces", x: { low: 0, high: most, name: "force g" }, y: { low: 0, high: most, name: "next force" } });
  const v = new nd.Chart({ label: "Factor of a step over theta", x: { low: 0, high: 1, name: "theta" }, y: { low: 0, high: 3, name: "factor a step" } });
  widget.pictures.append(web.root, v.root);
  const fixed = S1 * moved / (1 + rho);
  const drag = (event) => { theta.value = Math.max(0.01, v.at(event)); };
  v.root.addEventListener("pointerdown", (event) => { v.root.setPointerCapture(event.pointerId); drag(event); });
  v.root.addEventListener("pointermove", (event) => { if (event.buttons) drag(event); });

  function draw() {
    const t = theta.value, next = (g) => t * T(g) + (1 - t) * g;
    const path = [0];
    while (path.length <= steps) path.push(next(path[path.length - 1]));
    web.clear();
    web.line([[0, 0], [most, most]], { stroke: nd.COLOURS.grey, "stroke-dasharray": "4 3" });
    const kink = S1 * moved / rho;
    web.line([0, kink, most].map((g) => [g, next(g)]), { stroke: nd.COLOURS.blue });
    web.note(0.03 * most + kink, next(kink) + 0.05 * most, "one step", { fill: nd.COLOURS.blue });
    web.note(0.55 * most, 0.45 * most, "next force = g");
    web.note(fixed, fixed, "★", { "text-anchor": "middle", dy: 4 });
    v.root.toggleAttribute("hidden", !widget.revealed);
    if (!widget.revealed) { web.dot(0, 0, { fill: nd.COLOURS.red }); return; }
    web.line(path.slice(1).flatMap((to, i) => [[path[i], to], [to, to]]), { stroke: nd.COLOURS.red, "stroke-width": 1 });
    web.dot(path[steps], path[steps], { fill: nd.COLOURS.red });

    const line = Array.from({ length: 101 }, (_, i) => i / 100), open = Math.abs(1 - t), closed = Math.abs(1 - t * (1 + rho));
    v.clear();
    v.line([[0, 1], [1, 1]], { stroke: nd.COLOURS.grey, "stroke-width": 1 });
    v.line(line.map((x) => [x, Math.abs(1 - x)]), { stroke: nd.COLOURS.grey, "stroke-dasharray": "2 3" });
    v.line(line.map((x) => [x, Math.abs(1 - x * (1 + rho))]), { stroke: nd.COLOURS.blue });
    v.line([[t, 0], [t, 3]], { stroke: nd.COLOURS.red, "stroke-width": 1 });
    v.dot(t, open, { fill: "none", stroke: nd.COLOURS.grey, "stroke-width": 2 });
    v.dot(t, closed, { fill: nd.COLOURS.blue, class: "handle" });
    v.note(0.68, Math.abs(1 - 0.7 * (1 + rho)), "in contact", { "text-anchor": "end", fill: nd.COLOURS.blue });
    v.note(0.7, 0.38, "apart");
    if (Math.abs(t - best) < 0.005) v.dot(best, ndFormulas.predictedFactor(best, rho), { fill: nd.COLOURS.orange, r: 5 });

    const worst = ndFormulas.predictedFactor(t, rho);
    const error = Math.abs(path[steps] - fixed), lowest = Math.abs(t - best) < 0.005 ? " This is theta = 2/(2 + rho), where it is least." : "";
    widget.says.textContent = `theta = ${t.toFixed(2)}: in contact each step multiplies the error by ${nd.short(closed)}, apart by `
      + `${nd.short(open)}. ${worst < 1 - 1e-9 ? `The larger one is below 1: every start converges.${lowest}` : worst > 1 + 1e-9 ? "The larger one is above 1: the iteration cycles." : "The larger one is 1: an error in contact keeps its size."} `
      + `After ${steps} steps the force is ${nd.short(path[steps])}, off by ${nd.short(error)}.`;
    nd.fill(widget.table, ["step", "force g", "error"], path.slice(0, 13).map((g, i) => [i, nd.digits(g), nd.digits(Math.abs(g - fixed))]));
  }
  nd.start(widget, figure);
});
