// One problem: its runs on a grid of theta and friction in both roles, step by step.
nd.onPage("explore", (figure) => {
  "use strict";
  const data = ndData.explore, f = ndFormulas, plane = data.dimension === 2;
  const STATES = ["stick", "slip", "open"];
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const bodies = data.bodies.map((body) => ({ ...body, lift: new Int16Array(bytes(body.lift).buffer) }));
  const roles = data.roles.map((role) => ({ ...role, frames: new Int8Array(bytes(role.frames).buffer) }));
  const number = (value) => String(Number(value.toPrecision(4)));

  const widget = { name: "explore", sliders: {}, buttons: {}, controls: nd.html("div", { class: "controls" }), update: draw };
  const says = nd.html("p", { class: "answer", "aria-live": "polite" });
  const pictures = nd.html("div", { class: "pictures" });
  const table = nd.html("table"), link = nd.html("a", { href: "#" }, "link to this state");
  figure.replaceChildren(says, widget.controls, pictures, nd.html("details", {}, nd.html("summary", {}, "The numbers of this run"), table),
    nd.html("p", { class: "link" }, link));

  const slider = (name, label, values, value) => nd.slider(widget, { name, label, low: 0, high: values.length - 1, step: 1, value,
    show: (i) => `${name === "friction" ? "k" : name} = ${number(values[i])}` });
  const theta = slider("theta", "theta", data.theta, data.own[0]);
  const friction = slider("friction", "friction k", data.friction, data.own[1]);
  const exchanged = nd.button(widget, "roles", roles.length > 1 ? "exchange the roles of the bodies" : "roles cannot be exchanged", () => {});
  if (roles.length < 2) widget.controls.lastChild.disabled = true;
  const step = nd.slider(widget, { name: "step", label: "step", low: 0, high: 60, step: 1, value: 60, show: () => "" });
  const stepInput = widget.sliders.step, stepText = stepInput.nextSibling;
  const play = nd.html("button", { type: "button", onclick: () => (timer ? stop() : start()) }, "play");
  widget.controls.append(play);
  let timer = null;
  function stop() { clearInterval(timer); timer = null; play.textContent = "play"; }
  function start() {
    stepInput.value = 0; play.textContent = "stop"; widget.update();
    timer = setInterval(() => {
      if (Number(stepInput.value) >= Number(stepInput.max)) stop();
      else { stepInput.value = Number(stepInput.value) + 1; draw(); }
    }, 450);
  }

  const panel = (title, ...nodes) => { const div = nd.html("div", {}, nd.html("h3", {}, title), ...nodes); pictures.append(div); return div; };
  const stage = nd.svg("svg", { class: "bodies", role: "img", "aria-label": "Both bodies deformed" });
  const stageTitle = panel("", stage).firstChild;
  const legend = nd.html("p", { class: "legend" });
  stage.parentNode.append(legend);
  const residuals = new nd.Chart({ width: 360, height: 260, label: "Residual over the steps", x: { low: 0, high: 1, name: "step" }, y: { low: 1e-9, high: 1, log: true, name: "relative residual" } });
  panel("The residual", residuals.root);
  const most = Math.max(...data.friction);
  const map = new nd.Chart({ width: 360, height: 260, label: "The runs over theta and friction",
    x: { low: 0, high: 1, name: "theta" }, y: { low: -0.06 * (most || 1), high: 1.06 * (most || 1), name: "friction k" } });
  panel("All runs: theta and friction", map.root, nd.html("p", { class: "legend" },
    "Circle: converged, the larger the fewer steps; cross: not. Filled region: a bound proves that one step contracts."));
  const factors = new nd.Chart({ width: 360, height: 260, label: "Error per step over theta", x: { low: 0, high: 1, name: "theta" }, y: { low: 0, high: 1.5, name: "error per step" } });
  panel("Error per step at this friction", factors.root, nd.html("p", { class: "legend" },
    "Points: observed, of runs that converged. Dashed: predicted from rho, not a bound. Line: bound in energy norms, where it applies."));

  // Displacements of all drawn nodes from a trace on the interface.
  function moved(body, trace) {
    const count = trace.length, share = body.size / 32767;
    return body.still.map((still, i) => {
      let sum = 0;
      for (let j = 0; j < count; j += 1) sum += body.lift[i * count + j] * trace[j];
      return still + share * sum;
    });
  }

  // One shown step of a run: traces of both bodies, pressure, shear, states.
  function frame(role, run, i) {
    const traces = bodies.map((body) => (plane ? 2 : 1) * body.contact.length), n = role.contactNodes;
    const width = traces[0] + traces[1] + 3 * n, at = run.first + i, begin = at * width;
    const [length, stress] = role.scales[at], row = role.frames.subarray(begin, begin + width);
    const part = (from, count, size) => Array.from(row.subarray(from, from + count), (v) => v * size / 127);
    return {
      traces: [part(0, traces[0], length), part(traces[0], traces[1], length)],
      pressure: part(traces[0] + traces[1], n, stress), shear: part(traces[0] + traces[1] + n, n, stress),
      states: Array.from(row.subarray(width - n), (v) => STATES[v]),
    };
  }

  // Enlargement: the largest displacement of the problem's own run is 6 % of the picture; a gap that varies is not enlarged.
  const xs = (body) => body.points.filter((_, i) => !plane || i % 2 === 0), ys = (body) => (plane ? body.points.filter((_, i) => i % 2) : [0]);
  const spread = (values) => Math.max(...values) - Math.min(...values);
  const size = plane ? Math.max(...bodies.map((b) => spread(xs(b)))) : spread(bodies.flatMap(xs));
  const own = roles[0].runs[data.own[1]][data.own[0]];
  const largest = Math.max(...bodies.flatMap((body, b) => moved(body, frame(roles[0], own, own.shown.length - 1).traces[b]).map(Math.abs)));
  const round = (value) => { const p = 10 ** Math.floor(Math.log10(value)); return Math.max(...[1, 2, 5].filter((q) => q * p <= value * (1 + 1e-12))) * p; };
  const scale = data.gap.flat && largest > 0 ? Math.max(1, round(0.06 * size / largest)) : 1;
  const heights = bodies.map((body) => (plane ? body.points[2 * body.contact[0] + 1] : body.points[body.contact[0]]));
  const lift = data.gap.flat && data.gap.upright ? scale * data.gap.size - (heights[1] - heights[0]) : 0;  // a gap is enlarged like displacements

  function positions(body, b, displacement) {
    const place = [];
    if (plane) for (let i = 0; i < body.points.length; i += 2) place.push([body.points[i] + scale * displacement[i], body.points[i + 1] + scale * displacement[i + 1] + (b ? lift : 0)]);
    else for (let i = 0; i < body.points.length; i += 1) place.push([body.points[i] + scale * displacement[i] + (b ? lift : 0), 0]);
    return place;
  }

  const all = bodies.flatMap((body, b) => positions(body, b, body.points.map(() => 0)));
  const margin = 0.12 * size, left = Math.min(...all.map((p) => p[0])) - margin, top = Math.max(...all.map((p) => p[1])) + margin;
  const width = Math.max(...all.map((p) => p[0])) + margin - left, height = top - Math.min(...all.map((p) => p[1])) + margin;
  stage.setAttribute("viewBox", `0 0 1000 ${Math.max(1000 * height / width, 160).toFixed(0)}`);
  const unit = 1000 / width, X = (x) => ((x - left) * unit).toFixed(1), Y = (y) => ((top - y) * unit).toFixed(1);
  const stresses = roles[0].scales.slice(own.first, own.first + own.shown.length).map((s) => s[1]);
  const arrow = stresses.length && Math.max(...stresses) > 0 ? 0.1 * size / stresses[stresses.length - 1] : 0;

  function drawBodies(role, run, i) {
    stage.replaceChildren();
    if (i < 0) return;
    const now = frame(role, run, i);
    const places = bodies.map((body, b) => positions(body, b, moved(body, now.traces[b])));
    bodies.forEach((body, b) => {
      const point = (k) => `${X(places[b][k][0])},${Y(places[b][k][1])}`;
      const d = body.cells.filter((cell) => cell.length > 1).map((cell) => `M${cell.map(point).join("L")}${cell.length > 2 ? "Z" : ""}`).join("");
      stage.append(nd.svg("path", { d, class: `mesh${b + 1}${plane ? "" : " bar"}` }));
    });
    const carrier = role.neumann === 1 ? 1 : 0, marks = nd.svg("g");  // the contact body carries the nodes
    const every = Math.max(1, Math.ceil(now.pressure.length / 60));
    now.pressure.forEach((pressure, j) => {
      const [x, y] = places[carrier][bodies[carrier].contact[j]];
      const [nx, ny] = plane ? role.normals[j] : [1, 0], shear = plane ? now.shear[j] : 0;
      const dx = (pressure * nx + shear * ny) * arrow, dy = (pressure * ny - shear * nx) * arrow, length = Math.hypot(dx, dy) * unit;
      if (length > 3 && j % every === 0) {
        const head = Math.min(9, length / 2), angle = Math.atan2(-dy, dx), tip = [Number(X(x + dx)), Number(Y(y + dy))];
        const barb = (turn) => `M${tip[0]},${tip[1]}l${(-head * Math.cos(angle + turn)).toFixed(1)},${(-head * Math.sin(angle + turn)).toFixed(1)}`;
        marks.append(nd.svg("path", { d: `M${X(x)},${Y(y)}L${tip[0]},${tip[1]}${barb(0.45)}${barb(-0.45)}`, class: "traction" }));
      }
    });
    now.states.forEach((state, j) => {
      const [x, y] = places[carrier][bodies[carrier].contact[j]].map((v, k) => Number(k ? Y(v) : X(v)));
      if (state === "stick") marks.append(nd.svg("rect", { x: x - 5, y: y - 5, width: 10, height: 10, class: "stick" }));
      else if (state === "slip") marks.append(nd.svg("path", { d: `M${x},${y - 7}l7,12h-14z`, class: "slip" }));
      else marks.append(nd.svg("circle", { cx: x, cy: y, r: 5, class: "open" }));
    });
    stage.append(marks);
    const count = (name) => now.states.filter((state) => state === name).length;
    const frictionless = data.friction[friction.value] === 0;
    legend.textContent = (frictionless ? `Triangles are closed (${count("slip") + count("stick")}), circles open (${count("open")}). `
      : `Squares stick (${count("stick")}), triangles slip (${count("slip")}), circles are open (${count("open")}). `)
      + `Blue: body 1, orange: body 2; the ${role.name} one is the Neumann body. Displacements times ${scale}.`;
  }

  function drawResiduals(run, i) {
    const seen = run.residuals.filter((r) => r > 0), low = Math.min(data.tolerance / 10, ...seen), high = Math.max(1, ...seen) * 2;
    residuals.axes({ low: 0, high: 1.04 * Math.max(run.shown[run.shown.length - 1] || 1, 1), name: "step" }, { low, high, log: true, name: "relative residual" });
    residuals.clear();
    const points = run.shown.map((s, j) => [s, Math.max(run.residuals[j], low)]);
    residuals.line([[0, data.tolerance], [1e6, data.tolerance]], { stroke: nd.COLOURS.grey, "stroke-dasharray": "4 3" });
    if (points.length > 1) residuals.line(points, { stroke: nd.COLOURS.blue });
    points.forEach(([x, y], j) => residuals.dot(x, y, j === i ? { class: "here", r: 6 } : { fill: nd.COLOURS.blue, r: 2.5 }));
  }

  function drawMap(role) {
    map.clear();
    role.regions.forEach((corners, b) => {
      const { name, colour } = data.bounds[b], ends = corners.length ? [[0, corners[0][1], corners[0][2]], ...corners] : [];
      map.area([...ends.map(([k, low]) => [low, k]), ...ends.map(([k, , high]) => [high, k]).reverse()], { class: "area region", fill: colour, stroke: colour, "data-region": name });
    });
    role.runs.forEach((line, k) => line.forEach((run, t) => {
      const done = run.outcome === "converged", r = done ? Math.max(2, 8 - 1.6 * Math.log10(1 + run.steps) * 1.3) : 3.5;
      const [x, y] = [map.toX(data.theta[t]), map.toY(data.friction[k])];
      const mark = done ? nd.svg("circle", { cx: x, cy: y, r, fill: nd.COLOURS.blue }) : nd.svg("path", { d: `M${x - r},${y - r}l${2 * r},${2 * r}m${-2 * r},0l${2 * r},${-2 * r}`, stroke: nd.COLOURS.red, "stroke-width": 2 });
      mark.classList.add("run");
      mark.addEventListener("click", () => { theta.value = t; friction.value = k; });
      map.marks.append(mark);
    }));
    map.dot(data.theta[theta.value], data.friction[friction.value], { class: "here", r: 9 });
  }

  function drawFactors(role, k) {
    factors.clear();
    const line = Array.from({ length: 199 }, (_, i) => (i + 1) / 200), at = data.friction[k];
    factors.line([[0, 1], [1, 1]], { stroke: nd.COLOURS.grey, "stroke-width": 1 });
    if (role.rho !== null) {
      factors.line(line.map((t) => [t, f.predictedFactor(t, role.rho)]), { stroke: nd.COLOURS.orange, "stroke-dasharray": "5 3" });
      const kappa = role.kappa ? role.kappa.map((each) => each * at) : at === 0 ? [0, 0] : null;
      if (kappa) {
        const proved = line.map((t) => [t, Math.sqrt(Math.max(0, 1 - f.energyOneMinusSquare(t, role.rho, ...kappa)))]);
        factors.line(proved.filter(([, q]) => q < 1), { stroke: nd.COLOURS.green, "data-curve": "energy" });
      }
    }
    role.runs[k].forEach((run, t) => { if (run.rate !== null && run.outcome === "converged") factors.dot(data.theta[t], run.rate, { fill: nd.COLOURS.blue, r: t === theta.value ? 6 : 3 }); });
  }

  function ended(run) {
    if (run.steps === null) return `did not run: ${run.outcome}`;
    if (run.outcome === "converged") return `converged after ${run.steps} steps`;
    return `${run.outcome === "limit" ? "did not converge" : run.outcome} after ${run.steps} steps`;
  }

  function draw() {
    if (!widget.ready) return;
    const role = roles[exchanged.on && roles.length > 1 ? 1 : 0], k = friction.value, t = theta.value, run = role.runs[k][t];
    const last = run.shown.length - 1;
    stepInput.max = Math.max(last, 0);
    const i = Math.min(step.value, last);
    stepText.textContent = last < 0 ? "none" : `${run.shown[i]} of ${run.steps}`;
    stepInput.setAttribute("aria-valuetext", `step ${stepText.textContent}`);
    const best = data.bounds.map(({ name }, b) => [name, run.factors[b]]).filter(([, factor]) => factor !== null).sort((a, b) => a[1] - b[1])[0];
    const rate = run.rate === null || run.outcome !== "converged" ? "" : `, each leaving ${number(run.rate)} of the error`;
    says.textContent = `theta = ${number(data.theta[t])}, k = ${number(data.friction[k])}, Neumann body ${role.neumann} (${role.name}): ${ended(run)}${rate}. `
      + (best ? `Bound for any loads (${best[0]}, in doubles): at most ${number(best[1])} of the error is left by a step.` : "No bound proves that a step contracts here.");
    stageTitle.textContent = last < 0 ? "The bodies" : `The bodies at step ${run.shown[i]}`;
    drawBodies(role, run, i);
    drawResiduals(run, i);
    drawMap(role);
    drawFactors(role, k);
    nd.fill(table, ["step", "relative residual"], run.shown.map((s, j) => [s, nd.digits(run.residuals[j])]));
    const state = Object.entries(widget.sliders).map(([name, input]) => `explore.${name}=${input.value}`);
    link.href = `#${[...state, `explore.roles=${exchanged.on ? 1 : 0}`].join("&")}`;
  }
  widget.ready = true;
  draw();
});
