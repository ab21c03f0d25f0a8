"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const data = JSON.parse(byId("data").textContent);
  const sliders = data.sliders || [];
  const removed = sliders.map(() => 0);
  const off = { test: new Set(), run: new Set(), direction: new Set() };
  const magnified = { on: false };

  const decode = (packed) => {
    const bytes = atob(packed.d);
    const values = new Float64Array(bytes.length / 2);
    for (let i = 0; i < values.length; i++) {
      const whole = ((bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8)) << 16) >> 16;
      values[i] = packed.o + packed.s * whole;
    }
    return values;
  };
  // Columns are decoded on first use.
  const column = (holder, key) => {
    const value = holder[key];
    if (value && !(value instanceof Float64Array)) holder[key] = decode(value);
    return holder[key];
  };
  // Linear model: a column minus the removed shares.
  const values = (traversal, name) => {
    const whole = column(traversal, name).slice();
    if (name === "deviation") {
      removed.forEach((fraction, k) => {
        if (!fraction) return;
        const share = column(traversal.shares, k);
        for (let i = 0; i < whole.length; i++) whole[i] -= fraction * share[i];
      });
    }
    const channels = whole.length / traversal.n;
    if (channels === 1) return whole;
    const lengths = new Float64Array(traversal.n);
    for (let i = 0; i < traversal.n; i++) lengths[i] = Math.hypot(...whole.subarray(channels * i, channels * (i + 1)));
    return lengths;
  };
  const roundUp = (value) => {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].find((step) => step * power >= value * (1 - 1e-9)) * power;
  };
  const formatted = (value, step) => {
    const places = Math.min(9, Math.max(0, Math.ceil(-Math.log10(Math.abs(step)) - 1e-9)));
    const text = Math.abs(value).toFixed(places);
    return value < 0 && Number(text) ? "\u2212" + text : text;
  };
  const isShown = (traversal) =>
    !off.run.has(traversal.run) && !off.direction.has(traversal.forward === null ? "none" : String(traversal.forward));

  const plots = [...document.querySelectorAll("svg[data-interaction]")].map((svg) => {
    const interaction = JSON.parse(svg.dataset.interaction);
    return { svg, interaction, um: interaction.um, test: data.tests[interaction.test], points: null };
  }).filter((plot) => plot.test);

  const position = (plot, traversal, abscissa, value) => {
    const { interaction } = plot;
    const offset = (value / plot.um) * interaction.px;
    if (interaction.kind === "polar") {
      const radius = Math.max(0, interaction.r + offset);
      const angle = (abscissa * Math.PI) / 180;
      return [interaction.x0 + radius * Math.cos(angle), interaction.y0 - radius * Math.sin(angle)];
    }
    return [interaction.x0 + interaction.kx * abscissa, interaction.y0 - offset];
  };
  const isScalable = ({ interaction }) => interaction.column === "deviation" && (interaction.kind === "polar" || interaction.scaled);
  const compute = (plot) => {
    const paths = [...plot.svg.querySelectorAll("path[data-run]")];
    const columns = paths.map((path) => {
      const traversal = plot.test.traversals[path.dataset.run];
      const name = path.dataset.column || plot.interaction.column;
      return { path, traversal, name, values: values(traversal, name), abscissa: column(traversal.abscissa, plot.interaction.abscissa) };
    });
    plot.um = plot.interaction.um;
    if (magnified.on && isScalable(plot)) {
      let maximum = 0;
      for (const c of columns) if (isShown(c.traversal)) for (const v of c.values) maximum = Math.max(maximum, Math.abs(v));
      plot.um = roundUp(maximum / 4);
    }
    plot.points = columns.map((c) => ({ ...c, at: Array.from(c.values, (v, i) => position(plot, c.traversal, c.abscissa[i], v)) }));
  };
  // Distant readings are joined along the arc, as in the static plot.
  const joinedPath = (plot, { traversal, abscissa, values, at }) => {
    if (plot.interaction.kind !== "polar") return at;
    const joined = at.slice(0, 1);
    for (let i = 1; i < at.length; i++) {
      const parts = Math.max(1, Math.ceil(Math.abs(abscissa[i] - abscissa[i - 1]) / 4));
      for (let k = 1; k <= parts; k++) {
        const between = (list) => list[i - 1] + (k / parts) * (list[i] - list[i - 1]);
        joined.push(k === parts ? at[i] : position(plot, traversal, between(abscissa), between(values)));
      }
    }
    return joined;
  };
  const number = (value) => String(Math.round(value * 10) / 10);
  const draw = (plot) => {
    compute(plot);
    for (const points of plot.points) {
      const { path, traversal, at } = points;
      const dots = path.classList.contains("dots");
      path.setAttribute("d", joinedPath(plot, points).map(([x, y], i) => (dots || !i ? "M" : "L") + number(x) + " " + number(y) + (dots ? "h0" : "")).join(""));
      const symbols = plot.svg.querySelectorAll(`.start[data-run="${path.dataset.run}"],.end[data-run="${path.dataset.run}"]`);
      for (const symbol of symbols) {
        const [x, y] = symbol.classList.contains("start") ? at[0] : at[at.length - 1];
        if (symbol.tagName === "circle") { symbol.setAttribute("cx", number(x)); symbol.setAttribute("cy", number(y)); }
        else { symbol.setAttribute("x", number(x - 3)); symbol.setAttribute("y", number(y - 3)); }
      }
      for (const element of [path, ...symbols]) element.style.display = isShown(traversal) ? "" : "none";
    }
    for (const text of plot.svg.querySelectorAll(".division")) text.textContent = text.textContent.replace(/^\S+/, formatted(plot.um, plot.um));
    if (plot.interaction.scaled) {
      plot.svg.querySelectorAll(".tick").forEach((tick, i) => { tick.textContent = formatted((i - 4) * plot.um, plot.um); });
    }
  };
  let scheduled = false;
  const redraw = () => {
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame(() => { scheduled = false; plots.forEach(draw); });
  };

  const make = (name, settings, ...children) => {
    const element = Object.assign(document.createElement(name), settings);
    element.append(...children);
    return element;
  };
  const box = (label, changed, checked = true) => {
    const input = make("input", { type: "checkbox", checked });
    input.addEventListener("change", () => { changed(input.checked); redraw(); });
    return make("label", {}, input, " " + label);
  };
  const group = (title, boxes) => boxes.length > 1 ? [make("fieldset", {}, make("legend", { textContent: title }), ...boxes)] : [];
  const toggle = (set, key) => (on) => { if (on) set.delete(key); else set.add(key); };

  const controls = byId("controls");
  if (controls) {
    const runs = new Set(), directions = new Set();
    for (const test of data.tests) for (const s of test.traversals) {
      runs.add(s.run);
      directions.add(s.forward === null ? "none" : String(s.forward));
    }
    const tests = data.tests.map((test, k) => box(test.name, (on) => {
      for (const plot of plots) if (plot.interaction.test === k) plot.svg.closest("figure").hidden = !on;
      for (const path of document.querySelectorAll(`path.of-test-${k}`)) path.style.display = on ? "" : "none";
    }));
    const labels = { true: "forward", false: "backward", none: "no direction" };
    controls.append(
      ...group("Tests", tests),
      ...group("Runs", [...runs].sort((a, b) => a - b).map((run) => box(String(run + 1), toggle(off.run, run)))),
      ...group("Directions", [...directions].sort().reverse().map((d) => box(labels[d], toggle(off.direction, d)))),
    );
    const inputs = sliders.map((slider, k) => {
      const input = make("input", { type: "range", min: 0, max: 100, value: 100 });
      input.dataset.id = slider.id;
      const output = make("output", { textContent: "100 %" });
      input.addEventListener("input", () => {
        removed[k] = 1 - input.value / 100;
        output.textContent = input.value + " %";
        redraw();
      });
      return { input, label: make("label", { title: slider.label }, make("span", { textContent: slider.label }), input, output) };
    });
    const all = (value) => () => inputs.forEach(({ input }) => { input.value = value; input.dispatchEvent(new Event("input")); });
    const button = (textContent, pressed) => {
      const made = make("button", { type: "button", textContent });
      made.addEventListener("click", pressed);
      return made;
    };
    if (inputs.length) {
      controls.append(make("fieldset", {},
        make("legend", { textContent: "Contributions" }),
        button("all", all(100)), button("none", all(0)),
        ...(plots.some(isScalable) ? [box("magnify the remainder", (on) => { magnified.on = on; }, false)] : []),
        make("div", { className: "sliders" }, ...inputs.map((i) => i.label))));
    }
  }
  for (const element of document.querySelectorAll(".needs-script")) element.hidden = false;

  const tip = byId("tip");
  const hide = () => { tip.hidden = true; };
  const showTip = (plot) => (event) => {
    const matrix = plot.svg.getScreenCTM();
    if (!matrix) return;
    if (!plot.points) compute(plot);
    const pointer = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    let best = null, nearest = 16 * 16;
    for (const c of plot.points) {
      if (!isShown(c.traversal)) continue;
      c.at.forEach(([x, y], i) => {
        const far = (x - pointer.x) ** 2 + (y - pointer.y) ** 2;
        if (far < nearest) { nearest = far; best = { c, i }; }
      });
    }
    if (!best) return hide();
    const { c, i } = best, s = c.traversal;
    const direction = s.forward === null ? "" : s.forward ? ", forward" : ", backward";
    const lines = [`${plot.test.name}, run ${s.number}${direction}`];
    const abscissaName = plot.interaction.abscissa === "x" ? plot.test.over : plot.interaction.abscissa;
    const keys = Object.keys(s.abscissa);
    const unit = plot.test.units[Math.max(0, keys.indexOf(plot.interaction.abscissa))];
    lines.push(`${abscissaName} ${c.abscissa[i].toFixed(2)} ${unit}`, `${c.name} ${formatted(c.values[i], 0.01)} µm`);
    for (const name of ["before", "after"]) if (name !== c.name) lines.push(`residual ${name} ${formatted(values(s, name)[i], 0.01)} ${data.unit}`);
    if (s.line) lines.push(`line ${Math.round(column(s, "line")[i])} of its file`);
    tip.textContent = lines.join("\n");
    tip.hidden = false;
    const right = event.pageX + 16 + tip.offsetWidth > document.documentElement.clientWidth + scrollX;
    tip.style.left = Math.max(4, right ? event.pageX - tip.offsetWidth - 12 : event.pageX + 16) + "px";
    tip.style.top = event.pageY + 14 + "px";
  };
  for (const plot of plots) {
    plot.svg.addEventListener("pointermove", showTip(plot));
    plot.svg.addEventListener("pointerdown", showTip(plot));
    plot.svg.addEventListener("pointerleave", hide);
  }

  const download = byId("download");
  if (download) download.addEventListener("click", async () => {
    const bytes = Uint8Array.from(atob(byId("csv").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const address = URL.createObjectURL(await new Response(stream).blob());
    make("a", { href: address, download: "readings.csv" }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  });
})();
