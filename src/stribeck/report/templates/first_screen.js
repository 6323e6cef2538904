"use strict";
/* Live curves (hover, zoom, common or own scales), sorting of the table, and folded parts that a link leads to. */
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

  const store = document.getElementById("curves");
  if (!store || typeof uPlot === "undefined") return;
  const curves = JSON.parse(store.textContent);
  const places = [...document.querySelectorAll(".curve .plot")];
  const names = places.map((place) => place.closest("figure").querySelector("a").textContent);
  const toggle = document.getElementById("scales"), reading = document.getElementById("reading");
  const number = (value) => (value == null ? "" : String(Number(value.toPrecision(3))).replace("-", "\u2212"));
  const splits = (plot, axis, low, high) => {
    const half = (high - low) / 2, power = 10 ** Math.floor(Math.log10(half));
    const step = [5, 2, 1].find((each) => each * power <= half * (1 + 1e-9)) * power;
    const first = Math.ceil(low / step), count = Math.floor(high / step) - first + 1;
    return Array.from({ length: count }, (_, k) => (first + k) * step);
  };
  const hint = document.getElementById("hint"), grid = document.querySelector(".curves");
  const tell = (text) => {
    reading.textContent = text;
    hint.hidden = text !== "";
  };
  grid.addEventListener("mouseleave", () => tell(""));
  let plots = [];

  const say = (index, plot) => {
    const at = plot.cursor.idx, { units } = curves[index];
    if (at == null) return;
    const [x, y, low, high] = plot.data.map((line) => line && line[at]);
    const band = low == null ? "" : ` (${number(low)} to ${number(high)})`;
    tell(`${names[index]}: ${number(y)}${band} ${units[1]} at ${number(x)} ${units[0]}`);
  };

  /* Two fingers zoom and shift all curves of a unit; two taps show them whole; one finger scrolls the page. */
  const touch = (plot, unit, whole) => {
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
      if (max > min) plots.forEach((each, k) => curves[k].units[0] === unit && each.setScale("x", { min, max }));
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

  const draw = () => {
    plots.forEach((plot) => plot.destroy());
    const own = toggle.getAttribute("aria-pressed") === "true";
    const style = getComputedStyle(root);
    const colour = (name) => style.getPropertyValue(name).trim();
    const font = "12px system-ui, sans-serif", rules = { stroke: colour("--grid"), width: 1 };
    const ticks = { show: false };
    plots = places.map((place, index) => {
      const { lines, scale, own: fitting, units } = curves[index];
      const [reach, most] = own ? fitting : scale;
      const band = lines[2] && lines[3];
      const line = (show) => ({ stroke: colour("--law"), width: show ? 2 : 0, pxAlign: 0, points: { show: false } });
      const values = (_, splits) => splits.map(number);
      const plot = new uPlot(
        {
          width: place.clientWidth,
          height: place.clientHeight,
          padding: [6, 8, 0, 0],
          legend: { show: false },
          cursor: {
            y: false,
            drag: { x: true, y: false },
            points: { size: 7 },
            sync: { key: units[0], scales: ["x", null] },
          },
          scales: { x: { time: false, range: (_, low, high) => (plots[index] ? [low, high] : [-reach, reach]) },
            y: { range: [-most, most] } },
          axes: [
            { font, stroke: colour("--muted"), grid: rules, ticks, size: 20, gap: 2, space: 36, values, splits },
            { font, stroke: colour("--muted"), grid: rules, ticks, size: 38, gap: 4, space: 28, values, splits },
          ],
          series: [{}, line(true), ...(band ? [line(false), line(false)] : [])],
          bands: band ? [{ series: [3, 2], fill: colour("--band") }] : [],
          hooks: { setCursor: [(self) => self.cursor.event && self.over.matches(":hover") && say(index, self)] },
        },
        band ? lines : lines.slice(0, 2),
        place,
      );
      plot.setScale("x", { min: -reach, max: reach });
      const whole = () => plots.forEach((each, k) => reset(each, k, own));
      plot.over.addEventListener("dblclick", whole);
      touch(plot, units[0], whole);
      return plot;
    });
  };

  const reset = (plot, index, own) => {
    const [reach] = own ? curves[index].own : curves[index].scale;
    plot.setScale("x", { min: -reach, max: reach });
  };

  toggle.addEventListener("click", () => {
    toggle.setAttribute("aria-pressed", String(toggle.getAttribute("aria-pressed") !== "true"));
    draw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  new ResizeObserver(() => plots.forEach((plot, index) => {
    const { clientWidth: width, clientHeight: height } = places[index];
    if (width && height && (width !== plot.width || height !== plot.height)) plot.setSize({ width, height });
  })).observe(grid);
  draw();
})();
