"use strict";
(() => {
  const part = (id) => document.getElementById(id);
  const data = JSON.parse(part("data").textContent);
  const sliders = data.sliders || [];
  const removed = sliders.map(() => 0);
  const off = { test: new Set(), run: new Set(), direction: new Set() };
  const fit = { on: false };

  const unpack = (packed) => {
    const bytes = atob(packed.d);
    const values = new Float64Array(bytes.length / 2);
    for (let i = 0; i < values.length; i++) {
      const whole = ((bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8)) << 16) >> 16;
      values[i] = packed.o + packed.s * whole;
    }
    return values;
  };
  // A column is unpacked when it is first asked for.
  const column = (holder, key) => {
    const value = holder[key];
    if (value && !(value instanceof Float64Array)) holder[key] = unpack(value);
    return holder[key];
  };
  // The linear model: a column less the shares that are removed.
  const values = (stretch, name) => {
    const whole = column(stretch, name).slice();
    if (name === "deviation") {
      removed.forEach((share, k) => {
        if (!share) return;
        const of = column(stretch.shares, k);
        for (let i = 0; i < whole.length; i++) whole[i] -= share * of[i];
      });
    }
    if (data.coordinates === 1) return whole;
    const lengths = new Float64Array(stretch.n);
    for (let i = 0; i < stretch.n; i++) lengths[i] = Math.hypot(whole[3 * i], whole[3 * i + 1], whole[3 * i + 2]);
    return lengths;
  };
  const roundUp = (value) => {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].find((step) => step * power >= value * (1 - 1e-9)) * power;
  };
  const written = (value, step) => {
    const places = Math.min(9, Math.max(0, Math.ceil(-Math.log10(Math.abs(step)) - 1e-9)));
    const text = Math.abs(value).toFixed(places);
    return value < 0 && Number(text) ? "\u2212" + text : text;
  };
  const shown = (stretch) =>
    !off.run.has(stretch.run) && !off.direction.has(stretch.forward === null ? "none" : String(stretch.forward));

  const plots = [...document.querySelectorAll("svg[data-live]")].map((svg) => {
    const live = JSON.parse(svg.dataset.live);
    return { svg, live, um: live.um, test: data.tests[live.test], points: null };
  }).filter((plot) => plot.test);

  const place = (plot, stretch, along, value) => {
    const { live } = plot;
    const away = (value / plot.um) * live.px;
    if (live.kind === "polar") {
      const radius = Math.max(0, live.r + away);
      const angle = (along * Math.PI) / 180;
      return [live.x0 + radius * Math.cos(angle), live.y0 - radius * Math.sin(angle)];
    }
    return [live.x0 + live.kx * along, live.y0 - away];
  };
  const scales = ({ live }) => live.column === "deviation" && (live.kind === "polar" || live.scaled);
  const compute = (plot) => {
    const paths = [...plot.svg.querySelectorAll("path[data-run]")];
    const columns = paths.map((path) => {
      const stretch = plot.test.stretches[path.dataset.run];
      const name = path.dataset.column || plot.live.column;
      return { path, stretch, name, values: values(stretch, name), along: column(stretch.along, plot.live.along) };
    });
    plot.um = plot.live.um;
    if (fit.on && scales(plot)) {
      let most = 0;
      for (const c of columns) if (shown(c.stretch)) for (const v of c.values) most = Math.max(most, Math.abs(v));
      plot.um = roundUp(most / 4);
    }
    plot.points = columns.map((c) => ({ ...c, at: Array.from(c.values, (v, i) => place(plot, c.stretch, c.along[i], v)) }));
  };
  // Readings that lie far apart are joined along the arc, as in the drawing that came with the page.
  const way = (plot, { stretch, along, values, at }) => {
    if (plot.live.kind !== "polar") return at;
    const joined = at.slice(0, 1);
    for (let i = 1; i < at.length; i++) {
      const parts = Math.max(1, Math.ceil(Math.abs(along[i] - along[i - 1]) / 4));
      for (let k = 1; k <= parts; k++) {
        const between = (list) => list[i - 1] + (k / parts) * (list[i] - list[i - 1]);
        joined.push(k === parts ? at[i] : place(plot, stretch, between(along), between(values)));
      }
    }
    return joined;
  };
  const number = (value) => String(Math.round(value * 10) / 10);
  const draw = (plot) => {
    compute(plot);
    for (const points of plot.points) {
      const { path, stretch, at } = points;
      const dots = path.classList.contains("dots");
      path.setAttribute("d", way(plot, points).map(([x, y], i) => (dots || !i ? "M" : "L") + number(x) + " " + number(y) + (dots ? "h0" : "")).join(""));
      const signs = plot.svg.querySelectorAll(`.start[data-run="${path.dataset.run}"],.end[data-run="${path.dataset.run}"]`);
      for (const sign of signs) {
        const [x, y] = sign.classList.contains("start") ? at[0] : at[at.length - 1];
        if (sign.tagName === "circle") { sign.setAttribute("cx", number(x)); sign.setAttribute("cy", number(y)); }
        else { sign.setAttribute("x", number(x - 3)); sign.setAttribute("y", number(y - 3)); }
      }
      for (const element of [path, ...signs]) element.style.display = shown(stretch) ? "" : "none";
    }
    for (const span of plot.svg.querySelectorAll(".division")) span.textContent = written(plot.um, plot.um);
    if (plot.live.scaled) {
      plot.svg.querySelectorAll(".tick").forEach((tick, i) => { tick.textContent = written((i - 4) * plot.um, plot.um); });
    }
  };
  let waiting = false;
  const redraw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; plots.forEach(draw); });
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
  const flip = (set, key) => (on) => { if (on) set.delete(key); else set.add(key); };

  const controls = part("controls");
  if (controls) {
    const runs = new Set(), directions = new Set();
    for (const test of data.tests) for (const s of test.stretches) {
      runs.add(s.run);
      directions.add(s.forward === null ? "none" : String(s.forward));
    }
    const tests = data.tests.map((test, k) => box(test.name, (on) => {
      for (const plot of plots) if (plot.live.test === k) plot.svg.closest("figure").hidden = !on;
      for (const path of document.querySelectorAll(`path.of-test-${k}`)) path.style.display = on ? "" : "none";
    }));
    const words = { true: "forward", false: "backward", none: "no direction" };
    controls.append(
      ...group("Tests", tests),
      ...group("Runs", [...runs].sort((a, b) => a - b).map((run) => box(String(run + 1), flip(off.run, run)))),
      ...group("Directions", [...directions].sort().reverse().map((d) => box(words[d], flip(off.direction, d)))),
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
      return { input, label: make("label", { title: slider.words }, make("span", { textContent: slider.words }), input, output) };
    });
    const all = (value) => () => inputs.forEach(({ input }) => { input.value = value; input.dispatchEvent(new Event("input")); });
    const button = (textContent, pressed) => {
      const made = make("button", { type: "button", textContent });
      made.addEventListener("click", pressed);
      return made;
    };
    if (inputs.length) {
      controls.append(make("fieldset", {},
        make("legend", { textContent: "With this much of" }),
        button("all errors", all(100)), button("none", all(0)),
        ...(plots.some(scales) ? [box("magnify what is left", (on) => { fit.on = on; }, false)] : []),
        make("div", { className: "sliders" }, ...inputs.map((i) => i.label))));
    }
  }
  for (const element of document.querySelectorAll(".needs-script")) element.hidden = false;

  const tip = part("tip");
  const hide = () => { tip.hidden = true; };
  const look = (plot) => (event) => {
    const matrix = plot.svg.getScreenCTM();
    if (!matrix) return;
    if (!plot.points) compute(plot);
    const pointer = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    let best = null, nearest = 16 * 16;
    for (const c of plot.points) {
      if (!shown(c.stretch)) continue;
      c.at.forEach(([x, y], i) => {
        const far = (x - pointer.x) ** 2 + (y - pointer.y) ** 2;
        if (far < nearest) { nearest = far; best = { c, i }; }
      });
    }
    if (!best) return hide();
    const { c, i } = best, s = c.stretch;
    const direction = s.forward === null ? "" : s.forward ? ", forward" : ", backward";
    const lines = [`${plot.test.name}, run ${s.number}${direction}`];
    const over = plot.live.along === "x" ? plot.test.over : plot.live.along;
    const keys = Object.keys(s.along);
    const unit = plot.test.units[Math.max(0, keys.indexOf(plot.live.along))];
    lines.push(`${over} ${c.along[i].toFixed(2)} ${unit}`, `${c.name} ${written(c.values[i], 0.01)} µm`);
    for (const name of ["before", "after"]) if (name !== c.name) lines.push(`residual ${name} ${written(values(s, name)[i], 0.01)} µm`);
    if (s.line) lines.push(`line ${Math.round(column(s, "line")[i])} of its file`);
    tip.textContent = lines.join("\n");
    tip.hidden = false;
    const right = event.pageX + 16 + tip.offsetWidth > document.documentElement.clientWidth + scrollX;
    tip.style.left = Math.max(4, right ? event.pageX - tip.offsetWidth - 12 : event.pageX + 16) + "px";
    tip.style.top = event.pageY + 14 + "px";
  };
  for (const plot of plots) {
    plot.svg.addEventListener("pointermove", look(plot));
    plot.svg.addEventListener("pointerdown", look(plot));
    plot.svg.addEventListener("pointerleave", hide);
  }

  const download = part("download");
  if (download) download.addEventListener("click", async () => {
    const bytes = Uint8Array.from(atob(part("table").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const address = URL.createObjectURL(await new Response(stream).blob());
    make("a", { href: address, download: "readings.csv" }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  });
})();
