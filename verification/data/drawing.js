// What the widgets share: charts in SVG, sliders with their number, a question, a table, a link that keeps the state.
window.nd = (() => {
  "use strict";
  const SVG = "http://www.w3.org/2000/svg";
  const GREEK = { theta: "\u03b8", rho: "\u03c1", kappa: "\u03ba", lambda: "\u03bb" }, LETTERS = /\b(theta|rho|kappa|lambda)\b/g;
  const COLOURS = { blue: "#0072b2", red: "#d55e00", green: "#009e73", orange: "#e69f00", grey: "#777777", sky: "#56b4e9" };

  function html(tag, attributes = {}, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
      else if (value !== null) node.setAttribute(name, value);
    }
    node.append(...children);
    return node;
  }

  function svg(tag, attributes = {}, content = null) {
    const node = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    if (content === null) return node;
    const lower = 3;
    let shifted = 0;
    for (const part of mathematics(String(content).replace(LETTERS, (name) => GREEK[name]), (words) => svg("tspan", { "font-size": "85%", dy: lower }, words))) {
      node.append(shifted && typeof part === "string" && part ? svg("tspan", { dy: -lower }, part) : part);
      shifted = typeof part !== "string";
    }
    return node;
  }

  // A text with the mathematics between its dollar signs set: $\Gamma_c$ has a Greek letter and an index.
  function mathematics(text, index) {
    return String(text).split("$").flatMap((part, i) => (i % 2 === 0 ? [part]
      : part.replace("\\Gamma", "\u0393").split("_").map((words, j) => (j ? index(words) : words))));
  }

  // The same as words only.
  const words = (text) => mathematics(text, (part) => part).join("");

  // Five to seven round numbers between two ends; powers of ten on a logarithmic axis.
  function ticks(low, high, logarithmic) {
    if (logarithmic) {
      const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
      const step = Math.max(1, Math.ceil((last - first) / 6));
      return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, i) => 10 ** (first + i * step));
    }
    const raw = (high - low) / 5, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999) * power;
    const first = Math.ceil(low / step - 1e-9);
    return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => (first + i) * step);
  }

  const short = (value) => (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e5)
    ? value.toExponential(0).replace("e+", "e") : String(Number(value.toPrecision(3))));

  // Four digits, for tables.
  const digits = (value) => (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e5)
    ? value.toExponential(3).replace("e+", "e") : String(Number(value.toPrecision(4))));

  // A chart with two axes. draw(chart) is called again at every change; what it adds replaces what was there.
  class Chart {
    constructor({ width = 340, height = 250, x, y, label }) {
      this.width = width; this.height = height;
      this.box = { left: 52, right: width - 10, top: 10, bottom: height - 40 };
      this.root = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": words(label), class: "chart" });
      this.frame = svg("g"); this.marks = svg("g");
      this.clip = `nd-clip-${Math.random().toString(36).slice(2)}`;
      const clip = svg("clipPath", { id: this.clip });
      const { left, right, top, bottom } = this.box;
      clip.append(svg("rect", { x: left, y: top, width: right - left, height: bottom - top }));
      this.marks.setAttribute("clip-path", `url(#${this.clip})`);
      this.root.append(clip, this.frame, this.marks);
      this.axes(x, y);
    }

    axes(x, y) {
      this.x = x; this.y = y;
      this.frame.replaceChildren();
      const { left, right, top, bottom } = this.box;
      this.frame.append(svg("path", { d: `M${left},${top}V${bottom}H${right}`, class: "axis" }));
      for (const value of ticks(x.low, x.high, x.log)) {
        this.frame.append(svg("path", { d: `M${this.toX(value)},${bottom}v4`, class: "axis" }),
          svg("text", { x: this.toX(value), y: bottom + 15, "text-anchor": "middle" }, short(value)));
      }
      for (const value of y.bare ? [] : ticks(y.low, y.high, y.log)) {
        this.frame.append(svg("path", { d: `M${left},${this.toY(value)}h-4`, class: "axis" }),
          svg("text", { x: left - 6, y: this.toY(value) + 3.5, "text-anchor": "end" }, short(value)));
      }
      this.frame.append(svg("text", { x: (left + right) / 2, y: this.height - 8, "text-anchor": "middle" }, x.name),
        svg("text", { transform: `translate(11,${(top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, y.name));
    }

    static share(value, axis) {
      return axis.log ? Math.log(value / axis.low) / Math.log(axis.high / axis.low) : (value - axis.low) / (axis.high - axis.low);
    }

    toX(value) { return this.box.left + Chart.share(value, this.x) * (this.box.right - this.box.left); }

    toY(value) {
      const at = this.box.bottom - Chart.share(value, this.y) * (this.box.bottom - this.box.top);
      return Math.min(1e5, Math.max(-1e5, at));
    }

    // The x of a pointer event.
    at(event) {
      const { left, width } = this.root.getBoundingClientRect();
      const pixel = (event.clientX - left) * this.width / width;
      const share = Math.min(1, Math.max(0, (pixel - this.box.left) / (this.box.right - this.box.left)));
      return this.x.low + share * (this.x.high - this.x.low);
    }

    clear() { this.marks.replaceChildren(); }

    line(points, attributes = {}) {
      const d = points.map(([x, y], i) => `${i ? "L" : "M"}${this.toX(x).toFixed(2)},${this.toY(y).toFixed(2)}`).join("");
      this.marks.append(svg("path", { d, class: "curve", ...attributes }));
    }

    area(points, attributes = {}) {
      if (points.length) this.line([...points, points[0]], { class: "area", ...attributes });
    }

    dot(x, y, attributes = {}) { this.marks.append(svg("circle", { cx: this.toX(x), cy: this.toY(y), r: 4, ...attributes })); }

    note(x, y, text, attributes = {}) { this.marks.append(svg("text", { x: this.toX(x), y: this.toY(y), ...attributes }, text)); }
  }

  // The state of all widgets lives behind the # of the address: widget.name=value, joined by &.
  function remembered(widget) {
    const found = {};
    for (const part of location.hash.slice(1).replace(/%(3D|26|2B)/gi, decodeURIComponent).split("&")) {
      const match = part.match(/^(\w+)\.(\w+)=([-\w.+]+)$/);
      if (match && match[1] === widget) found[match[2]] = match[3];
    }
    return found;
  }

  // A slider: name and value on the left, the value as text beside it. `show` turns the number into that text.
  function slider(widget, { name, label, low, high, step, value, show = (v) => String(v) }) {
    const given = Number(remembered(widget.name)[name]);
    const start = Number.isFinite(given) && remembered(widget.name)[name] !== undefined ? Math.min(high, Math.max(low, given)) : value;
    const output = html("output"), input = html("input", { type: "range", min: low, max: high, step, value: start, name, "aria-label": label,
      oninput: () => { if (widget.answered) widget.told.dataset.past = ""; say(); widget.update(); } });
    const say = () => { output.textContent = show(Number(input.value)); input.setAttribute("aria-valuetext", output.textContent); };
    say(); // of the step next to the value that was given
    widget.controls.append(html("label", {}, html("span", {}, label), input, output));
    widget.sliders[name] = input;
    return {
      get value() { return Number(input.value); },
      set value(v) { input.value = v; input.dispatchEvent(new Event("input")); },
    };
  }

  function button(widget, name, text, pressed) {
    const node = html("button", { type: "button", name, "aria-pressed": "false",
      onclick: () => { toggle.on = !toggle.on; } }, text);
    const toggle = {
      get on() { return node.getAttribute("aria-pressed") === "true"; },
      set on(value) { node.setAttribute("aria-pressed", String(value)); pressed(value); widget.update(); },
    };
    if (remembered(widget.name)[name] === "1") node.setAttribute("aria-pressed", "true");
    widget.buttons[name] = toggle;
    widget.controls.append(node);
    return toggle;
  }

  // What a frame shows on a screen; its still picture stays, for paper.
  function fillWith(figure, ...parts) {
    figure.dataset.live = "";
    figure.replaceChildren(...parts, ...figure.querySelectorAll(".still"));
  }

  // What style sheets say of a drawing.
  const STYLES = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "opacity", "font-size", "font-family",
    "font-weight", "text-anchor", "display", "vector-effect"];

  // The drawings of a widget beside each other as one SVG, which needs no style sheet.
  function drawing(figure) {
    const shown = [...figure.querySelectorAll("svg")].filter((one) => one.getClientRects().length), whole = svg("svg", { xmlns: SVG });
    let right = 0, bottom = 0;
    for (const one of shown) {
      const box = one.viewBox.baseVal, width = box.width || one.clientWidth, height = box.height || one.clientHeight, copy = one.cloneNode(true);
      const parts = [one, ...one.querySelectorAll("*")];
      [copy, ...copy.querySelectorAll("*")].forEach((part, i) => {
        const style = getComputedStyle(parts[i]);
        for (const name of STYLES) part.style.setProperty(name, style.getPropertyValue(name));
      });
      for (const [name, value] of Object.entries({ x: right, y: 0, width, height, overflow: "hidden" })) copy.setAttribute(name, value);
      whole.append(copy);
      right += width; bottom = Math.max(bottom, height);
    }
    whole.setAttribute("viewBox", `0 0 ${right} ${bottom}`);
    whole.prepend(svg("rect", { width: right, height: bottom, fill: getComputedStyle(document.body).backgroundColor }));
    return new XMLSerializer().serializeToString(whole);
  }

  const saving = (figure, name) => html("a", { href: "#", download: `${name}.svg`,
    onclick: (event) => { event.target.href = `data:image/svg+xml,${encodeURIComponent(drawing(figure))}`; } }, "save as SVG");

  // A frame for a widget: a question to answer first, controls, pictures, what they say, the numbers, a link.  Where the
  // right answer is given, the outcome is hidden until somebody answers: what is not in `pictures` waits, and draw() leaves
  // out what `revealed` is for. Then the words say why, and show() moves the widget to the state that shows it.
  function build(figure, { name, question, answers, right = null, wrong = {}, reveal, show = () => {}, draw }) {
    const given = right !== null && Object.keys(remembered(name)).length > 0; // a link to a state was made after the answer
    const widget = { name, sliders: {}, buttons: {}, revealed: given, controls: html("div", { class: "controls" }),
      pictures: html("div", { class: "pictures" }), says: html("p", { class: "says", "aria-live": "polite" }),
      table: html("table"), link: html("a", { href: "#" }, "link to this state") };
    const told = html("p", { class: "told", hidden: "", tabindex: "-1" }); // takes the focus, which has it read
    widget.told = told;
    const ask = html("fieldset", { class: "ask" }, html("legend", {}, `Predict first. ${question}`));
    const outcome = [widget.controls, widget.says, html("details", {}, html("summary", {}, "The numbers of this picture"), widget.table),
      html("p", { class: "link" }, widget.link, " \u00b7 ", saving(figure, name))];
    const answered = () => { figure.dataset.answered = ""; figure.dispatchEvent(new CustomEvent("answered")); };
    if (given) answered();
    const open = (words) => {
      told.textContent = words; told.hidden = false; widget.revealed = true; ask.hidden = true;
      for (const part of outcome) part.hidden = false;
      show(); widget.update();
      widget.answered = true;
      answered();
      told.focus({ preventScroll: true }); // the button that had it is gone
    };
    const verdict = (answer) => (right === null ? `You said: ${answer}.` : answer === right ? "Right:" : `Not quite: ${wrong[answer]}`);
    const capital = (sentence) => sentence[0].toUpperCase() + sentence.slice(1);
    for (const answer of answers) {
      ask.append(html("button", { type: "button", onclick: () => open(`${verdict(answer)} ${right === null || answer === right ? reveal() : capital(reveal())}`) }, answer));
    }
    ask.append(html("button", { type: "button", class: "reveal", onclick: () => open(`${right === null ? "" : "Answer: "}${reveal()}`) }, "Just show me"));
    ask.hidden = given;
    for (const part of outcome) part.hidden = right !== null && !given;
    fillWith(figure, ask, told, outcome[0], widget.pictures, ...outcome.slice(1));
    widget.update = () => {
      if (!widget.ready) return;
      draw(widget);
      const state = Object.entries(widget.sliders).map(([key, input]) => `${name}.${key}=${input.value}`)
        .concat(Object.entries(widget.buttons).map(([key, toggle]) => `${name}.${key}=${toggle.on ? 1 : 0}`));
      widget.link.href = `#${state.join("&")}`;
    };
    return widget;
  }

  // A link that holds a state of this widget leads to the widget.
  function start(widget, figure) {
    widget.ready = true;
    widget.update();
    const show = () => figure.scrollIntoView({ behavior: "instant" });
    if (Object.keys(remembered(widget.name)).length) window.addEventListener("load", show);
  }

  function fill(table, head, rows) {
    const cells = (tag, values) => html("tr", {}, ...values.map((value) => html(tag, {}, String(value))));
    table.replaceChildren(html("thead", {}, cells("th", head)), html("tbody", {}, ...rows.map((row) => cells("td", row))));
  }

  function onPage(name, make) {
    const begin = () => document.querySelectorAll(`[data-widget="${name}"]`).forEach(make);
    if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin); else begin();
  }

  return { COLOURS, Chart, build, button, digits, fill, fillWith, html, onPage, saving, short, slider, start, svg };
})();
