// One problem: its runs on a grid of theta and friction in both roles, step by step; or its loading history by increments.
nd.onPage("explore", (figure) => {
  "use strict";
  const data = ndData.explore, f = ndFormulas, plane = data.dimension === 2, past = data.past;
  const STATES = ["stick", "slip", "open"];
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const bodies = data.bodies.map((body) => ({ ...body, lift: new Int16Array(bytes(body.lift).buffer) }));
  const roles = data.roles.map((role) => ({ ...role, frames: new Int8Array(bytes(role.frames).buffer) }));
  const number = (value) => String(Number(value.toPrecision(4))), { short } = nd;

  const widget = { name: "explore", sliders: {}, buttons: {}, controls: nd.html("div", { class: "controls" }), update: draw };
  const says = nd.html("p", { class: "answer", "aria-live": "polite" });
  const pictures = nd.html("div", { class: "pictures" });
  const table = nd.html("table"), link = nd.html("a", { href: "#" }, "link to this state");
  nd.fillWith(figure, says, widget.controls, pictures, nd.html("details", {}, nd.html("summary", {}, "The numbers of this run"), table),
    nd.html("p", { class: "link" }, link, " \u00b7 ", nd.saving(figure, "explore")));

  const slider = (name, label, values, value) => nd.slider(widget, { name, label, low: 0, high: values.length - 1, step: 1, value,
    show: (i) => `${name === "friction" ? "k" : name} = ${number(values[i])}` });
  const theta = past ? { value: 0 } : slider("theta", "theta", data.theta, data.own[0]);
  const friction = slider("friction", "friction k", data.friction, data.own[1]);
  const exchanged = past ? { on: false } : nd.button(widget, "roles", roles.length > 1 ? "exchange the roles of the bodies" : "roles cannot be exchanged", () => {});
  if (!past && roles.length < 2) widget.controls.lastChild.disabled = true;
  const stepName = past ? "increment" : "step", mostSteps = past ? past.planned : 60;
  const step = nd.slider(widget, { name: stepName, label: stepName, low: 0, high: mostSteps, step: 1, value: past ? sheared() : mostSteps, show: () => "" });
  const stepInput = widget.sliders[stepName], stepText = stepInput.nextSibling;
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

  const panel = (title, ...nodes) => { const div = nd.html("div", {}, nd.html("h2", {}, title), ...nodes); pictures.append(div); return div; };
  const stage = nd.svg("svg", { class: "bodies", role: "img", "aria-label": "Both bodies deformed" });
  const stageTitle = panel("", stage).firstChild;
  const legend = nd.html("p", { class: "legend" });
  stage.parentNode.append(legend);
  const showRun = past ? ofHistory() : ofGrid();

  // Displacements of all drawn nodes from a trace on the interface.
  function moved(body, trace, time = 0) {
    const count = trace.length, share = body.size / 32767, stills = [body.still, ...body.later];
    const before = stills[Math.floor(time)], after = stills[Math.ceil(time)], part = time - Math.floor(time);
    return before.map((value, i) => {
      const still = value + part * (after[i] - value);
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
  const time = (k, i) => (past ? past.told[k].time[i] : 0);
  const weighed = own.shown.map((_, i) => i).slice(past ? 0 : -1);  // of a history every increment
  const largest = Math.max(...weighed.flatMap((i) => bodies.map((body, b) =>
    moved(body, frame(roles[0], own, i).traces[b], time(data.own[1], i)).reduce((most, v) => Math.max(most, Math.abs(v)), 0))));
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
  const bar = round(0.25 * size), ground = Number(stage.getAttribute("viewBox").split(" ")[3]) - 8;
  const unit = 1000 / width, X = (x) => ((x - left) * unit).toFixed(1), Y = (y) => ((top - y) * unit).toFixed(1);
  const stresses = roles[0].scales.slice(own.first, own.first + own.shown.length).map((s) => s[1]);
  const arrow = stresses.length && Math.max(...stresses) > 0 ? 0.1 * size / (past ? Math.max(...stresses) : stresses[stresses.length - 1]) : 0;

  function mark(marks, state, x, y, r = 5) {
    if (state === "stick") marks.append(nd.svg("rect", { x: x - r, y: y - r, width: 2 * r, height: 2 * r, class: "stick" }));
    else if (state === "slip") marks.append(nd.svg("path", { d: `M${x},${y - 1.4 * r}l${1.4 * r},${2.4 * r}h${-2.8 * r}z`, class: "slip" }));
    else marks.append(nd.svg("circle", { cx: x, cy: y, r, class: "open" }));
  }

  function drawBodies(role, run, i) {
    stage.replaceChildren();
    if (i < 0) return;
    const now = frame(role, run, i);
    const places = bodies.map((body, b) => positions(body, b, moved(body, now.traces[b], time(friction.value, i))));
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
    now.states.forEach((state, j) => mark(marks, state, ...places[carrier][bodies[carrier].contact[j]].map((v, k) => Number(k ? Y(v) : X(v)))));
    stage.append(marks, nd.svg("path", { d: `M20,${ground}v-8m0,4h${(bar * unit).toFixed(1)}m0,-4v8`, class: "axis" }));
    const sizes = Math.max(0, ...now.pressure.map((pressure, j) => Math.hypot(pressure, plane ? now.shear[j] : 0)));
    const count = (name) => now.states.filter((state) => state === name).length;
    const frictionless = data.friction[friction.value] === 0;
    legend.textContent = (frictionless ? `Triangles are closed (${count("slip") + count("stick")}), circles open (${count("open")}). `
      : `Squares stick (${count("stick")}), triangles slip (${count("slip")}), circles are open (${count("open")}). `)
      + `Blue: body 1, orange: body 2; the ${role.name} one is the Neumann body. Displacements times ${scale}. `
      + `The bar is ${number(bar)} ${data.units.length} long` + (sizes > 0 ? `, the longest arrow ${number(sizes)} ${data.units.stress}.` : ".");
  }

  // Theta, friction and roles: the panels of a run.
  function ofGrid() {
    const residuals = new nd.Chart({ width: 360, height: 260, label: "Residual over the steps", x: { low: 0, high: 1, name: "step" }, y: { low: 1e-9, high: 1, log: true, name: "relative residual" } });
    panel("The residual", residuals.root);
    const most = Math.max(...data.friction);
    const map = new nd.Chart({ width: 360, height: 260, label: "The runs over theta and friction",
      x: { low: 0, high: 1, name: "theta" }, y: { low: -0.06 * (most || 1), high: 1.06 * (most || 1), name: "friction k" } });
    panel("All runs: theta and friction", map.root, nd.html("p", { class: "legend" },
      "Circle: the run converged; larger circles took fewer steps. Cross: it did not. Shaded: a bound proves that one step contracts; the printed bound only claims it."));
    const factors = new nd.Chart({ width: 360, height: 260, label: "Error per step over theta", x: { low: 0, high: 1, name: "theta" }, y: { low: 0, high: 1.5, name: "error per step" } });
    panel("Error per step at this friction", factors.root, nd.html("p", { class: "legend" },
      "Points: observed, of runs that converged. Dashed: predicted from rho, not a bound; its least value is marked. Line: bound in energy norms, in doubles, where it applies."));
    const ruler = new nd.Chart({ width: 360, height: 170, label: "Steps promised, predicted and taken", x: { low: 1, high: 1e4, log: true, name: `steps to ${short(data.tolerance)}` }, y: { low: 0, high: 4, bare: true, name: "" } });
    panel("How many steps?", ruler.root, nd.html("p", { class: "legend" },
      "Green: steps until the best bound promises the error to be that share of the first one, for any loads. Orange: steps predicted from rho, without friction. Blue: steps until the residual of this run was there."));

    function drawResiduals(run, i) {
      const seen = run.residuals.filter((r) => r > 0), low = Math.min(data.tolerance / 10, ...seen), high = Math.max(1, ...seen) * 2;
      residuals.axes({ low: 0, high: 1.04 * Math.max(run.residuals.length - 1, 1), name: "step" }, { low, high, log: true, name: "relative residual" });
      residuals.clear();
      const points = run.residuals.map((r, s) => [s, r === null ? null : Math.max(r, low)]).filter(([, r]) => r !== null);
      residuals.line([[0, data.tolerance], [1e6, data.tolerance]], { stroke: nd.COLOURS.grey, "stroke-dasharray": "4 3" });
      if (points.length > 1) residuals.line(points, { stroke: nd.COLOURS.blue });
      points.forEach(([s, r]) => residuals.dot(s, r, s === run.shown[i] ? { class: "here", r: 6 } : { fill: nd.COLOURS.blue, r: run.shown.includes(s) ? 2.5 : 2 }));
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
        factors.line([[role.best, 0], [role.best, f.predictedFactor(role.best, role.rho)]], { stroke: nd.COLOURS.orange, "data-theta": role.best });
        factors.note(role.best, 1.4, `best ${number(role.best)}`, { "text-anchor": role.best > 0.5 ? "end" : "start" });
        const kappa = role.kappa ? role.kappa.map((each) => each * at) : at === 0 ? [0, 0] : null;
        if (kappa) {
          const proved = line.map((t) => [t, Math.sqrt(Math.max(0, 1 - f.energyOneMinusSquare(t, role.rho, ...kappa)))]);
          factors.line(proved.filter(([, q]) => q < 1), { stroke: nd.COLOURS.green, "data-curve": "energy" });
        }
      }
      role.runs[k].forEach((run, t) => { if (run.rate !== null && run.outcome === "converged") factors.dot(data.theta[t], run.rate, { fill: nd.COLOURS.blue, r: t === theta.value ? 6 : 3 }); });
    }

    // Steps to the tolerance, on one axis: a bar for each number that there is.
    function drawRuler(role, run, best) {
      const t = data.theta[theta.value], to = (factor) => (factor < 1 ? Math.ceil(Math.log(data.tolerance) / Math.log(factor) - 1e-9) : null);
      const found = [["promised", best ? to(best[1]) : null, nd.COLOURS.green], ["predicted", role.rho === null ? null : to(f.predictedFactor(t, role.rho)), nd.COLOURS.orange],
        ["taken", run.outcome === "converged" ? run.steps : null, nd.COLOURS.blue]];
      ruler.axes({ ...ruler.x, high: Math.max(1e3, ...found.map(([, steps]) => 20 * (steps ?? 1))) }, ruler.y);
      ruler.clear();
      found.forEach(([name, steps, stroke], j) => {
        const y = 3.3 - j;
        if (steps !== null) { ruler.line([[1, y], [steps, y]], { stroke }); ruler.dot(steps, y, { fill: stroke, "data-steps": name }); }
        ruler.note(steps === null ? 1.2 : 1.25 * steps, y - 0.12, steps === null ? `${name}: none` : `${name}${j ? "" : " at most"} ${steps}`);
      });
      return found[0][1];
    }

    return (role, run, i) => {
      const k = friction.value, last = run.shown.length - 1;
      const best = data.bounds.map(({ name }, b) => [name, run.factors[b]]).filter(([, factor]) => factor !== null).sort((a, b) => a[1] - b[1])[0];
      const rate = run.rate === null || run.outcome !== "converged" ? "" : `, at the end a step leaves ${number(run.rate)} of the error`;
      const most = drawRuler(role, run, best);
      says.textContent = `theta = ${number(data.theta[theta.value])}, k = ${number(data.friction[k])}, Neumann body ${role.neumann} (${role.name}): ${ended(run)}${rate}. `
        + (best ? `For any loads a step leaves at most ${number(best[1])} of the error${most === null ? "" : `, so that ${short(data.tolerance)} of the first error is left after at most ${most} steps`}.` : "No bound says that a step contracts here.")
        + (run.leftOut ? ` The bodies leave the picture: ${run.leftOut} of ${run.leftOut + run.shown.length} drawings of this run are left out.` : "");
      stageTitle.textContent = last < 0 ? "The bodies" : `The bodies at step ${run.shown[i]}`;
      stepText.textContent = last < 0 ? "none" : `${run.shown[i]} of ${run.steps}`;
      drawResiduals(run, i);
      drawMap(role);
      drawFactors(role, k);
      nd.fill(table, ["step", "relative residual"], run.residuals.map((r, s) => [s, r === null ? "too large for a number" : nd.digits(r)]));
    };
  }

  // The increment of the problem's own history with the largest shear.
  function sheared() {
    const sizes = past.told[data.own[1]].tangential.map(Math.abs);
    return sizes.indexOf(Math.max(...sizes));
  }

  // A loading history: the panels of an increment.
  function ofHistory() {
    const { told, position: x, driven, axis } = past, { length, stress } = data.units;
    const ends = (rows) => { const all = rows.flat(); const [low, high] = [Math.min(0, ...all), Math.max(0, ...all)], room = 0.08 * (high - low || 1); return { low: low - room, high: high + room }; };
    const room = 0.04 * (x[x.length - 1] - x[0] || 1), along = { low: x[0] - room, high: x[x.length - 1] + room, name: `position along the contact line [${length}]` };
    const chart = (title, label, words, xs, ys) => {
      const made = new nd.Chart({ width: 360, height: 260, label, x: xs, y: ys });
      panel(title, made.root, nd.html("p", { class: "legend" }, words));
      return made;
    };
    const force = axis ? "normal" : "tangential", unit = plane ? `${stress} ${length}` : stress;  // per unit thickness, of bars per unit area
    const loop = chart("Force and displacement", "Force against displacement",
      "Each point is an increment; the area that the curve goes round is work that friction took.",
      { ...ends(told.map((each) => each.along)), name: `${driven} [${length}]` }, { ...ends(told.map((each) => each[force])), name: `${force} force [${unit}]` });
    const tractions = plane && chart("Shear against the friction bound", "Shear and friction bound along the contact line",
      "Grey: within the friction bound. Points: shear on body 2.", along, { low: -1, high: 1, name: `stress [${stress}]` });
    const map = chart("What sticks, slips and is open", "States over position and increment",
      "One row an increment, one column a node: green sticks, orange slips, empty is open. Line: this increment.",
      along, { low: 0, high: past.planned + 1, name: "increment" });
    const edges = x.length > 1 ? [x[0], ...x.slice(1).map((v, j) => (v + x[j]) / 2), x[x.length - 1]] : [x[0] - room, x[0] + room];
    const cell = (j, i) => [[edges[j], i + 0.5], [edges[j + 1], i + 0.5], [edges[j + 1], i + 1.5], [edges[j], i + 1.5]].map(([a, b]) => `${map.toX(a).toFixed(1)},${map.toY(b).toFixed(1)}`);

    return (role, run, i) => {
      const k = friction.value, each = told[k], at = { stick: "", slip: "" };
      const signed = (value) => number(Math.abs(value) < 1e-9 * Math.max(...told[k].normal) ? 0 : value);
      says.textContent = `k = ${number(data.friction[k])}, increment ${i + 1} of ${past.planned}, time ${number(each.time[i])} (${each.name[i]}): theta = ${number(data.theta[0])} took ${each.iterations[i]} steps. `
        + `Force on body 2: normal ${signed(each.normal[i])}, tangential ${signed(each.tangential[i])} ${unit}.`
        + (plane ? ` Friction took ${signed(each.dissipated[i])} ${unit}\u00b2 so far.` : "")
        + (run.outcome === "converged" ? "" : ` The history ends early: ${run.outcome}.`);
      stageTitle.textContent = `The bodies at time ${number(each.time[i])}`;
      stepText.textContent = `${i + 1} of ${past.planned}`;
      loop.clear();
      const points = each.along.map((a, j) => [a, j ? each[force][j - 1] : 0]);
      loop.line(points, { stroke: nd.COLOURS.blue });
      points.forEach(([a, b], j) => loop.dot(a, b, j === i + 1 ? { class: "here", r: 6 } : { fill: nd.COLOURS.blue, r: 2.5 }));
      if (plane) drawShear(each, i);
      map.clear();
      each.status.forEach((row, n) => row.forEach((state, j) => { if (state !== "open") at[state] += `M${cell(j, n).join("L")}Z`; }));
      Object.entries(at).forEach(([state, d]) => map.marks.append(nd.svg("path", { d, class: `${state} cells` })));
      map.line([[edges[0], i + 1], [edges[x.length], i + 1]], { class: "here" });
      nd.fill(table, [past.positionName, "pressure", "shear", "bound", "slip", "state"],
        x.map((a, j) => [...[a, each.pressure[i][j], each.shear[i][j], each.bound[i][j], each.slip[i][j]].map(nd.digits), each.status[i][j]]));
    };

    function drawShear(each, i) {
      const { high } = ends([...each.bound, ...each.shear].map((row) => row.map(Math.abs)));
      tractions.axes(along, { low: -high, high, name: `stress [${stress}]` });
      tractions.clear();
      const bound = each.bound[i].map((b, j) => [x[j], b]);
      tractions.area([...bound, ...bound.map(([a, b]) => [a, -b]).reverse()], { class: "area region", fill: nd.COLOURS.grey, stroke: nd.COLOURS.grey });
      tractions.line(x.map((a, j) => [a, each.shear[i][j]]), { stroke: nd.COLOURS.blue });
      each.status[i].forEach((state, j) => mark(tractions.marks, state, tractions.toX(x[j]), tractions.toY(each.shear[i][j]), 3.5));
    }
  }

  function ended(run) {
    if (run.steps === null) return `did not run: ${run.outcome}`;
    if (run.outcome === "converged") return `converged after ${run.steps} steps`;
    return `${run.outcome === "limit" ? "did not converge" : run.outcome} after ${run.steps} steps`;
  }

  function draw() {
    if (!widget.ready) return;
    const role = roles[exchanged.on && roles.length > 1 ? 1 : 0], run = role.runs[friction.value][theta.value];
    const last = run.shown.length - 1;
    stepInput.max = Math.max(last, 0);
    const i = Math.min(step.value, last);
    showRun(role, run, i);
    stepInput.setAttribute("aria-valuetext", `${stepName} ${stepText.textContent}`);
    drawBodies(role, run, i);
    const state = Object.entries(widget.sliders).map(([name, input]) => `explore.${name}=${input.value}`);
    link.href = `#${[...state, `explore.roles=${exchanged.on ? 1 : 0}`].join("&")}`;
  }
  widget.ready = true;
  draw();
});
