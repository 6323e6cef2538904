"use strict";
/* Folded parts that a link leads to, sorting of the table, and every chart: hover and zoom. */
(() => {
  const root = document.documentElement;
  root.classList.add("js");

  const open = () => {
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let part = target || null; part; part = part.parentElement) if (part.tagName === "DETAILS") part.open = true;
    if (target) target.scrollIntoView();
  };
  addEventListener("hashchange", open);
  open();

  for (const table of document.querySelectorAll("table.joints")) {
    const rows = table.tBodies[0];
    table.querySelectorAll("th[data-sort]").forEach((head) => {
      const column = head.cellIndex, button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        table.querySelectorAll("th[aria-sort]").forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const value = (row) => parseFloat(row.cells[column].dataset.value ?? "NaN");
        const last = (x) => (Number.isNaN(x) ? 1 : 0);
        const sorted = [...rows.rows].sort((one, other) => {
          const a = value(one), b = value(other);
          return last(a) - last(b) || (down ? b - a : a - b) || 0;
        });
        rows.append(...sorted);
      });
    });
  }

  const store = document.getElementById("charts");
  if (!store || typeof uPlot === "undefined") return;
  const charts = JSON.parse(store.textContent);
  const places = [...document.querySelectorAll("[data-chart]")];
  const plots = new Map(); // those that are drawn, by their place

  for (const chart of Object.values(charts)) {
    const [first, ...others] = charts[chart.residual]?.lines ?? []; // measured, and what explains it
    for (const line of others)
      chart.lines.push({ ...line, y: first.y.map((value, k) => (value == null || line.y[k] == null ? null : value - line.y[k])) });
  }
  for (const chart of Object.values(charts))
    for (const line of chart.lines)
      if (line.step) line.x = line.y.map((_, k) => line.x[0] + k * line.step);

  /* Numbers, and the room that labels take */
  const FONT = "12px system-ui, sans-serif";
  const canvas = document.createElement("canvas").getContext("2d");
  const width = (texts) => {
    canvas.font = FONT;
    return Math.max(0, ...(texts ?? []).map((text) => canvas.measureText(text ?? "").width));
  };
  const signed = (text) => text.replace("-", "\u2212");
  const number = (value) => (value == null ? "" : signed(String(Number(value.toPrecision(3)))));
  const tick = (value, step) => {
    if (value == null) return "";
    const size = Math.max(Math.abs(value), step);
    if (size >= 1e5 || size < 1e-4) return signed(value.toExponential(1).replace(".0e", "e").replace("e+", "e"));
    return signed(value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))));
  };

  const style = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const shade = (name, opacity = 1) => style(name) + Math.round(255 * opacity).toString(16).padStart(2, "0");

  /* An axis with its grid, numbers or names, and label; `across` is the horizontal one. */
  const axis = (spec, across, small, wide) => {
    const names = spec.names?.map((name) => (name.length > 22 ? name.slice(0, 21) + "\u2026" : name));
    const upright = names && across && width(names) > wide / names.length;
    return {
      font: FONT, labelFont: FONT, stroke: style("muted"), gap: 4,
      grid: { stroke: style("grid"), width: 1 }, ticks: { show: false },
      ...(small || !spec.label ? {} : { label: spec.label, labelSize: 18, labelGap: 0 }),
      rotate: upright ? -90 : 0,
      space: small ? (across ? 36 : 28) : across ? 60 : 26,
      size: (_, texts) => Math.ceil((across && !upright ? 16 : width(texts)) + (across ? 4 : 8)),
      ...(names
        ? { splits: () => spec.at ?? names.map((_, k) => k), values: () => names }
        : { incrs: STEPS, values: (_, splits, k, space, step) => splits.map((value) => tick(value, step)) }),
      ...(small && { splits: symmetric, values: (_, splits) => splits.map(number) }),
    };
  };
  const STEPS = Array.from({ length: 99 }, (_, k) => Number([1, 2, 5][k % 3] + "e" + (Math.floor(k / 3) - 16)));
  const symmetric = (plot, k, low, high) => {
    const half = (high - low) / 2, power = 10 ** Math.floor(Math.log10(half));
    const step = [5, 2, 1].find((each) => each * power <= half * (1 + 1e-9)) * power;
    const first = Math.ceil(low / step), count = Math.floor(high / step) - first + 1;
    return Array.from({ length: count }, (_, n) => (first + n) * step);
  };

  /* Series and data of lines, each with an x of its own */
  const series = (line) => {
    const colour = shade(line.colour, line.opacity), hidden = { width: 0, points: { show: false }, pxAlign: 0 };
    const curve = {
      label: line.name, stroke: colour, width: line.width ?? 2, dash: line.dash, points: { show: false }, pxAlign: 0,
      ...(line.steps && { paths: uPlot.paths.stepped({ align: 1 }), fill: colour, fillTo: () => line.base, width: 0 }),
    };
    return line.low ? [curve, hidden, hidden] : [curve];
  };

  /* The value of a line at x, between its points */
  const valueAt = (line, values, x) => {
    const k = line.x.findLastIndex((each) => each <= x);
    if (k < 0 || k === line.x.length - 1) return null;
    if (line.steps) return values[k];
    const [a, b] = [values[k], values[k + 1]], share = (x - line.x[k]) / (line.x[k + 1] - line.x[k]);
    return a == null || b == null ? null : a + share * (b - a);
  };
  const reading = (place, text) => {
    const output = place.closest("figure").querySelector("output") ?? document.getElementById("reading");
    output.textContent = text;
    if (output.id) document.getElementById("hint").hidden = text !== "";
  };
  const say = (plot, place, chart) => {
    if (!plot.cursor.event || !plot.over.matches(":hover") || plot.cursor.left < 0) return;
    const x = plot.posToVal(plot.cursor.left, "x"), [across, up] = [chart.x, chart.y];
    const unit = (spec) => spec.label.match(/\[(.*)\]/)?.[1] ?? "";
    const found = [];
    for (const line of chart.lines) {
      const value = valueAt(line, line.y, x);
      if (value == null || (up.names && (!line.name || value - line.base < 0.3))) continue;
      const band = line.low && ` (${number(valueAt(line, line.low, x))} to ${number(valueAt(line, line.high, x))})`;
      found.push(up.names ? line.name : `${line.name} ${number(value)}${band ?? ""}`.trim());
    }
    if (!found.length) return reading(place, "");
    const title = place.closest(".curve")?.querySelector("a").textContent;
    const where = across.names ? across.names[Math.round(x)] : `${number(x)} ${unit(across)}`;
    reading(place, `${title ? title + ": " : ""}${found.join(", ")} ${up.names ? "" : unit(up)} at ${where ?? ""}`);
  };

  /* Shaded spans, images and lines at zero beneath the curves; marks above them */
  const around = (plot, chart, images, above) => {
    const { ctx, bbox } = plot, ratio = devicePixelRatio;
    const X = (value) => plot.valToPos(value, "x", true), Y = (value) => plot.valToPos(value, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.fillStyle = above ? shade("ground", chart.residual ? 0.7 : 0) : shade("muted", 0.16);
    for (const [start, end] of chart.spans ?? []) ctx.fillRect(X(start), bbox.top, Math.max(X(end) - X(start), 1), bbox.height);
    for (const { picture, x, y, smooth } of above ? [] : images) {
      ctx.imageSmoothingEnabled = !!smooth;
      if (picture.complete) ctx.drawImage(picture, X(x[0]), Y(y[1]), X(x[1]) - X(x[0]), Y(y[0]) - Y(y[1]));
    }
    const stroke = (colour, thickness, dash, ...points) => {
      ctx.beginPath();
      points.forEach(([x, y], k) => ctx[k ? "lineTo" : "moveTo"](x, y));
      ctx.strokeStyle = colour;
      ctx.lineWidth = thickness * ratio;
      ctx.setLineDash(dash.map((each) => each * ratio));
      ctx.stroke();
    };
    const { top, left, height, width: wide } = bbox;
    const upright = (x, colour, thickness, dash) => stroke(colour, thickness, dash, [X(x), top], [X(x), top + height]);
    if (!chart.equal && !above) {
      if (!chart.x.names) upright(0, shade("muted"), 0.7, []);
      if (!chart.y.names) stroke(shade("muted"), 0.7, [], [left, Y(0)], [left + wide, Y(0)]);
    }
    for (const mark of (above && chart.marks) || []) upright(mark, shade("law"), 1.2, [3, 2]);
    ctx.restore();
  };

  const draw = (place) => {
    plots.get(place)?.destroy();
    const name = place.dataset.chart, chart = charts[name], small = place.closest(".curve") !== null;
    const range = (k) => chart[k].range;
    const lines = chart.lines, sync = chart.sync ?? name;
    const tables = lines.map((line) => [line.x, line.y, ...(line.low ? [line.low, line.high] : [])]);
    const data = tables.length ? uPlot.join(tables) : [range("x"), range("y")];
    const nothing = { paths: () => null, points: { show: false } };
    const all = [{}, ...(tables.length ? lines.flatMap(series) : [nothing])];
    const bands = [];
    for (let k = 1, n = 0; n < lines.length; k += lines[n++].low ? 3 : 1)
      if (lines[n].low) bands.push({ series: [k + 2, k + 1], fill: shade(lines[n].colour, 0.26) });
    const images = (chart.images ?? []).map((image) => {
      const picture = new Image();
      picture.onload = () => plots.get(place)?.redraw(false);
      picture.src = image.source;
      return { ...image, picture };
    });
    let ready = false; // then zooming sets the ranges
    const scale = (k) => ({ time: false, auto: false,
      range: (_, low, high) => (ready && low != null ? [low, high] : range(k)) });
    const plot = new uPlot(
      {
        width: place.clientWidth, height: place.clientHeight, padding: [8, 14, small ? 0 : 2, 0],
        legend: { show: false },
        cursor: { y: false, drag: { x: !chart.equal, y: false }, points: { show: false },
          bind: { dblclick: () => null }, sync: { key: sync, scales: ["x", null] } },
        scales: { x: scale("x"), y: scale("y") },
        axes: [axis(chart.x, true, small, place.clientWidth), axis(chart.y, false, small)],
        series: all,
        bands,
        hooks: {
          drawAxes: [(self) => around(self, chart, images, false)],
          draw: [(self) => around(self, chart, images, true)],
          setCursor: [(self) => say(self, place, chart)],
        },
      },
      data,
      place,
    );
    plots.set(place, plot);
    plot.group = sync;
    plot.whole = () => {
      let [x, y] = [range("x"), range("y")];
      if (chart.equal) {
        const { width: wide, height } = plot.over.getBoundingClientRect();
        const metres = Math.max((x[1] - x[0]) / wide, (y[1] - y[0]) / height); // of a pixel, both ways
        [x, y] = [[x, wide], [y, height]].map(([[a, b], size]) => [(a + b - metres * size) / 2, (a + b + metres * size) / 2]);
      }
      plot.batch(() => {
        plot.setScale("x", { min: x[0], max: x[1] });
        plot.setScale("y", { min: y[0], max: y[1] });
      });
    };
    ready = true;
    if (chart.equal) queueMicrotask(plot.whole); // when uPlot has laid it out
    else plot.whole();
    const whole = () => group(sync).forEach((each) => each.whole());
    plot.over.addEventListener("dblclick", whole);
    plot.over.addEventListener("mouseleave", () => reading(place, ""));
    if (!chart.equal) touch(plot, whole);
  };
  const apart = (place) => { // an error of one chart is reported, and does not stop the others
    try {
      draw(place);
    } catch (error) {
      console.error(place.dataset.chart, error);
    }
  };
  const group = (sync) => [...plots.values()].filter((plot) => plot.group === sync);

  /* Two fingers zoom and shift all charts of a group; two taps show them whole; one finger scrolls the page. */
  const touch = (plot, whole) => {
    let held = null, moved = false, tapped = 0;
    const pixels = ({ touches }) => {
      const { left } = plot.over.getBoundingClientRect();
      return [...touches].map((finger) => finger.clientX - left).sort((a, b) => a - b);
    };
    const start = (event) => {
      moved = false;
      held = event.touches.length === 2 ? pixels(event).map((x) => plot.posToVal(x, "x")) : null;
    };
    const move = (event) => {
      moved = true;
      if (!held) return;
      event.preventDefault();
      const [a, b] = pixels(event), slope = (held[1] - held[0]) / Math.max(b - a, 20);
      const min = held[0] - a * slope, max = min + plot.over.clientWidth * slope;
      if (max > min) group(plot.group).forEach((each) => each.setScale("x", { min, max }));
    };
    const end = (event) => {
      const still = !moved && event.touches.length === 0, now = event.timeStamp;
      if (still && now - tapped < 300) whole();
      tapped = still ? now : 0;
      if (event.touches.length < 2) held = null;
    };
    plot.over.addEventListener("touchstart", start, { passive: true });
    plot.over.addEventListener("touchmove", move, { passive: false });
    plot.over.addEventListener("touchend", end);
    plot.over.addEventListener("touchcancel", () => (held = null));
  };

  /* A chart is drawn when it is about to be seen, and again where colours or sizes change. */
  const seen = new IntersectionObserver(
    (found) => found.forEach(({ isIntersecting, target }) => isIntersecting && !plots.has(target) && apart(target)),
    { rootMargin: "300px" },
  );
  const resized = new ResizeObserver((found) => found.forEach(({ target }) => {
    const plot = plots.get(target), { clientWidth: wide, clientHeight: height } = target;
    if (!plot || !wide || (wide === plot.width && height === plot.height)) return;
    plot.setSize({ width: wide, height });
    if (charts[target.dataset.chart].equal) plot.whole();
  }));
  for (const place of places) {
    const { height } = charts[place.dataset.chart];
    if (height) place.style.height = height + "px";
    seen.observe(place);
    resized.observe(place);
  }
  const again = () => [...plots.keys()].forEach(apart);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  matchMedia("print").addEventListener("change", again);
  addEventListener("beforeprint", () => places.filter((place) => place.clientWidth && !plots.has(place)).forEach(apart));
})();
