// The plane of theta and friction for Section 6. The constants scale with the moduli as the library's do; the unit of
// stress changes the numbers alone, and with them the printed region.
nd.onPage("plane", (figure) => {
  "use strict";
  const f = ndFormulas, base = ndData.plane;
  const LOW = 1e-52, HIGH = 10, LEAST = 1e-18, ZOOM = 0.6, ROWS = 140;

  // The three digits of a number that its slider shows, with which the page computes.
  const decimal = (v) => Number((10 ** v).toPrecision(3)), shown = (v) => nd.short(decimal(v));

  const widget = nd.build(figure, {
    name: "plane",
    question: "Which region moves when stresses are written in GPa instead of MPa?",
    answers: ["all of them", "the printed one", "none"],
    right: "the printed one",
    wrong: { "all of them": "the other two compare stresses with stresses alone, which no unit changes.",
      none: "a formula that adds a number to a stress changes with the unit." },
    reveal: () => "only the printed one, because it adds the number 1 to stresses. The unit is now 1000 MPa, which is 1 GPa: the dashed region "
      + "has moved from the dotted one. The bodies have not changed, so no true threshold can.",
    show: () => { unit.value = 3; },
    draw,
  });
  const theta = nd.slider(widget, { name: "theta", label: "theta", low: -18, high: -0.001, step: 0.001, value: Math.log10(0.6), show: shown });
  const friction = nd.slider(widget, { name: "k", label: "friction k", low: -52, high: 0.9, step: 0.001, value: Math.log10(0.2), show: shown });
  const ratio = nd.slider(widget, { name: "ratio", label: "E1/E2", low: -1.7, high: 1.7, step: 0.001, value: Math.log10(3.5), show: shown });
  const unit = nd.slider(widget, { name: "unit", label: "unit of stress", low: -3, high: 6, step: 0.1, value: 0, show: (v) => `${shown(v)} MPa` });
  const zoom = nd.button(widget, "zoom", "zoom in, linear", () => {});
  const X = { low: LEAST, high: 1, log: true, name: "theta" };
  const Y = { low: LOW, high: HIGH, log: true, name: "friction k" };
  const chart = new nd.Chart({ ...(figure.closest(".slide") ? {} : { width: 440, height: 300 }), label: "Where each form of the theorem proves contraction", x: X, y: Y });
  const legend = nd.html("p", { class: "legend" });
  widget.pictures.append(chart.root, legend);

  // The constants at a ratio of the moduli and a unit of stress (MPa).
  function constants(u) {
    const rate = decimal(ratio.value), E1 = base.E2 * rate, E2 = base.E2;
    const [m, M, scale] = f.constants(E1, E2, u, base.m1, base.m2, base.M1, base.M2, base.Cs1, base.Cs2, base.Ctr);
    return {
      m, M, CR: base.CR, scale,
      rho: base.rho / rate, kappa1: base.CsEnergy * base.Ct1 * Math.sqrt(rate), kappa2: base.CsEnergy * base.Ct2,
    };
  }

  // The thetas that an edition of Section 5 proves at friction k, or null.
  function section5(c, printed, k) {
    const m = printed ? f.readPrinted(c.m) : c.m, u = printed ? 1 : c.m, x = k * c.scale;
    if (!(f.G(x, m, c.M, c.CR, u) < m ** 5 / (c.M * c.CR) ** 2 + m ** 3)) return null;
    const P = f.P(x, m, c.M, c.CR, u), D = f.D(x, m, c.M, c.CR, u), Q = f.Q(x, m, c.M, c.CR);
    const low = f.lowerEnd(P), high = f.C1(D, Q);
    return low < high ? [low, high, (t) => Math.min(f.oneMinusH1(t, D, Q), f.oneMinusH2(t, P))] : null;
  }

  function energy(c, k) {
    const [low, high, there] = f.energyEnds(c.rho, k * c.kappa1, k * c.kappa2);
    return there && low < high ? [low, high, (t) => f.energyOneMinusSquare(t, c.rho, k * c.kappa1, k * c.kappa2)] : null;
  }

  // C2, the friction below which an edition proves something: halving, as the condition is monotone in k.
  function threshold(region) {
    let no = HIGH, yes = 1e-40;
    if (region(no)) return no;
    for (let i = 0; i < 80; i += 1) {
      const middle = Math.sqrt(yes * no);
      if (region(middle)) yes = middle; else no = middle;
    }
    return yes;
  }

  // Factor and 1 - factor in words; 1 - factor where the factor rounds to 1.
  function factor(gain) {
    const q = Math.sqrt(Math.max(1 - gain, 0)), rest = gain / (1 + q);
    return rest < 1e-3 ? `1 - ${nd.short(rest)}` : q.toFixed(4);
  }

  function draw() {
    const c = constants(decimal(unit.value)), inMPa = constants(1), k = decimal(friction.value), t = decimal(theta.value), close = zoom.on;
    if (close) chart.axes({ low: 0, high: 1, name: "theta" }, { low: 0, high: ZOOM, name: "friction k" });
    else chart.axes(X, Y);
    chart.clear();
    legend.textContent = `Green: in energy norms. Blue: repaired. Dashed orange: printed${widget.revealed ? " (dotted: in MPa)" : ""}.`;
    const top = close ? ZOOM : HIGH, bottom = close ? 1e-9 : LOW;
    const kinds = [
      ["in energy norms", (at) => energy(c, at), { fill: nd.COLOURS.green, "fill-opacity": 0.35, stroke: nd.COLOURS.green }],
      ["repaired", (at) => section5(c, false, at), { fill: nd.COLOURS.sky, "fill-opacity": 0.6, stroke: nd.COLOURS.blue }],
      ["printed", (at) => section5(c, true, at), { fill: "none", stroke: nd.COLOURS.red, "stroke-width": 2.5, "stroke-dasharray": "6 3" }],
    ];
    const rows = [], words = [];
    const outline = (region, end) => {
      const highest = Math.min(end, top), left = [], right = [];
      for (let i = 0; i <= ROWS && bottom < highest; i += 1) {
        const at = close ? bottom + (highest - bottom) * i / ROWS : bottom * (highest / bottom) ** (i / ROWS);
        const found = region(at * (1 - 1e-9));
        if (found) { left.push([Math.max(found[0], close ? 0 : LEAST), at]); right.push([found[1], at]); }
      }
      return [...left, ...right.reverse()];
    };
    for (const [name, region, look] of kinds) {
      const end = name === "in energy norms" ? f.energyLimit(c.rho, c.kappa1, c.kappa2) : threshold(region);
      chart.area(outline(region, end), { ...look, "data-region": name });
      if (!close && name !== "printed") chart.note(3 * LEAST, end / (name === "repaired" ? 1e6 : 1e3), name);
      const here = region(k), inside = here && here[0] < t && t < here[1];
      const said = inside ? `contraction by ${factor(here[2](t))} a step` : "no conclusion";
      rows.push([name, nd.digits(end), here ? `${nd.digits(here[0])} to ${nd.digits(here[1])}` : "none", said]);
      words.push(`${name}: ${said}`);
    }
    if (unit.value !== 0) {
      const before = (at) => section5(inMPa, true, at), end = threshold(before);
      chart.area(outline(before, end), { fill: "none", stroke: nd.COLOURS.red, "stroke-width": 1, "stroke-dasharray": "1 3" });
      if (!close && Math.abs(unit.value) > 1) chart.note(3 * LEAST, end / 1e3, "printed, in MPa");
    }
    if (!close) chart.note(3 * LEAST, 1e3 * LOW, unit.value === 0 ? "printed" : "printed, in this unit");
    chart.line([[t, bottom], [t, top]], { stroke: nd.COLOURS.grey, "stroke-width": 0.7 });
    if (k <= top) chart.dot(t, Math.max(k, bottom), { fill: "currentColor", class: "handle" });
    rows.push(["in energy norms, every small theta", nd.digits(f.energyMultiple(c.kappa1, c.kappa2)), "", ""]);
    const proof = c.m >= 1 ? "the printed proof goes through (m >= 1)" : "the printed proof does not go through here (m < 1)";
    widget.says.textContent = `theta = ${nd.short(t)}, k = ${nd.short(k)}: ${words.join("; ")}. In this unit m = ${nd.short(c.m)}: ${proof}.`;
    nd.fill(widget.table, ["theorem", "friction below", "theta at this friction", "at the point"], rows);
  }
  nd.start(widget, figure);
});
