// Widgets made of scenes: each position of the sliders shows what the library computed for it, and nothing in between.
for (const [name, data] of Object.entries(ndData).filter(([, one]) => one.scenes)) {
  nd.onPage(name, (figure) => {
    "use strict";
    const widget = nd.build(figure, {
      name, question: data.question, answers: data.answers,
      right: data.right, wrong: data.wrong,
      reveal: () => data.why,
      show: () => sliders.forEach((slider, i) => { slider.value = data.sliders[i].start; }),
      draw,
    });
    const sliders = data.sliders.map(({ name: key, label, values, start }) => nd.slider(widget, {
      name: key, label, low: 0, high: values.length - 1, step: 1, value: start, show: (i) => values[Math.round(i)] }));
    const charts = data.charts.map(({ label, x, y }) => new nd.Chart({ label, x, y }));
    widget.pictures.append(...charts.map((chart) => chart.root));

    const marks = {
      line: (chart, { points, colour, dashed }) => chart.line(points, { stroke: nd.COLOURS[colour], ...(dashed ? { "stroke-dasharray": "5 3" } : {}) }),
      dots: (chart, { points, colour, hollow }) => points.forEach(([x, y]) => chart.dot(x, y,
        hollow ? { fill: "none", stroke: nd.COLOURS[colour], "stroke-width": 1.5, r: 3.5 } : { fill: nd.COLOURS[colour], r: 3.5 })),
      crosses: (chart, { points, colour }) => points.forEach(([x, y]) => chart.marks.append(nd.svg("path", { class: "curve",
        d: `M${chart.toX(x) - 3},${chart.toY(y) - 3}l6,6m0,-6l-6,6`, stroke: nd.COLOURS[colour] }))),
      note: (chart, { points, text, colour, anchor }) => chart.note(...points[0], text,
        { "text-anchor": anchor, ...(colour ? { class: colour } : {}) }),
    };

    function draw() {
      const scene = data.scenes[sliders.map((slider) => Math.round(slider.value)).join(",")];
      charts.forEach((chart, i) => {
        const { fixed, before } = data.charts[i], shown = [...fixed, ...(widget.revealed ? scene.marks[i] : before)];
        chart.root.toggleAttribute("hidden", shown.length === 0);
        chart.clear();
        for (const mark of shown) marks[mark.kind](chart, mark);
      });
      widget.says.textContent = scene.says;
      nd.fill(widget.table, data.head, scene.rows);
    }
    nd.start(widget, figure);
  });
}
