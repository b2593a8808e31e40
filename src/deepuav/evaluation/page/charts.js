// Charts against time that share their range and the pointer's moment, the plan, and the distribution of errors. Chart.js
// draws; here is what joins the charts.
"use strict";

// What all pictures of the page share. Listeners are called with the name of what changed.
DeepUav.View = class {
  constructor(runCount) {
    this.shown = new Array(runCount).fill(true);
    this.range = null; // [from, to] seconds, or null for the whole
    this.moment = null; // seconds under the pointer, or null
    this.listeners = [];
  }

  listen(listener) {
    this.listeners.push(listener);
  }

  set(what, value) {
    this[what] = value;
    for (const listener of this.listeners) listener(what);
  }
};

// The index of the value nearest to `target` in growing values.
DeepUav.nearestIndex = function (values, target) {
  let low = 0, high = values.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] < target) low = middle + 1;
    else high = middle;
  }
  return low > 0 && target - values[low - 1] < values[low] - target ? low - 1 : low;
};

// Whether a line breaks before each moment: far longer without a value than usual.
DeepUav.breaks = function (times) {
  const intervals = [];
  for (let i = 1; i < times.length; ++i) intervals.push(times[i] - times[i - 1]);
  const longest = 4 * DeepUav.quantile(intervals, 0.5);
  return Array.from(times, (time, i) => i > 0 && longest > 0 && time - times[i - 1] > longest);
};

DeepUav.linePoints = function (xs, ys, breaks) {
  const points = [];
  for (let i = 0; i < xs.length; ++i) {
    if (breaks && breaks[i]) points.push({ x: NaN, y: NaN });
    points.push({ x: xs[i], y: ys[i] });
  }
  return points;
};

DeepUav.number = function (value, digits = 3) {
  const size = Math.abs(value);
  if (size < 1e-9) return "0"; // Rounding, in every unit of the page.
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1);
  return value.toFixed(Math.max(0, Math.min(6, digits - 1 - Math.floor(Math.log10(size)))));
};

DeepUav.chartBase = function (xTitle, yTitle) {
  const ink = DeepUav.cssVariable("--soft"), grid = DeepUav.cssVariable("--grid");
  const axis = (title) => ({
    type: "linear",
    title: { display: Boolean(title), text: title, color: ink, font: { size: 11 } },
    ticks: { color: ink, font: { size: 11 }, maxRotation: 0, autoSkipPadding: 16, includeBounds: false },
    grid: { color: grid, borderColor: DeepUav.cssVariable("--line"), tickColor: grid },
  });
  return {
    animation: false,
    normalized: true,
    parsing: false,
    maintainAspectRatio: false,
    events: [],
    elements: { point: { radius: 0 }, line: { borderJoinStyle: "round" } },
    plugins: { legend: { display: false }, tooltip: { enabled: false } },
    scales: { x: axis(xTitle), y: axis(yTitle) },
  };
};

// A card with a chart of values over time. `series`: {label, run (or null for all), t, y, color, width, isTruth}: a truth lies
// behind the others.
DeepUav.TimeChart = class {
  constructor(parent, view, { title, unit, series, fromZero = false, steps = false, height = null, xTitle = "", end = null }) {
    this.view = view;
    this.series = series;
    this.unit = unit;
    const card = document.createElement("figure");
    card.className = "card";
    card.innerHTML = `<div class="chart-head"><h3></h3><span class="readout"></span></div><div class="chart"><canvas></canvas><div class="cursor" hidden></div><div class="selection" hidden></div></div>`;
    card.querySelector("h3").textContent = unit ? `${title}, ${unit}` : title;
    parent.appendChild(card);
    this.readout = card.querySelector(".readout");
    this.frame = card.querySelector(".chart");
    if (height) this.frame.style.height = height;
    this.cursor = card.querySelector(".cursor");
    this.selection = card.querySelector(".selection");
    const options = DeepUav.chartBase(xTitle, "");
    if (fromZero) options.scales.y.beginAtZero = true;
    options.scales.y.afterFit = (scale) => { scale.width = 58; };
    options.scales.x.min = 0;
    if (end) options.scales.x.max = end;
    this.end = end;
    this.chart = new Chart(card.querySelector("canvas"), {
      type: "line",
      data: { datasets: series.map((one) => ({
        data: DeepUav.linePoints(one.t, one.y, steps ? null : DeepUav.breaks(one.t)),
        borderColor: one.color, borderWidth: one.width || 1.6, stepped: steps ? "before" : false, order: one.isTruth ? 1 : 0,
      })) },
      options,
    });
    this.followPointer();
    view.listen((what) => this.update(what));
    this.update("moment");
  }

  update(what) {
    if (what === "moment") {
      this.showMoment();
    } else if (what === "range") {
      const [from, to] = this.view.range || [0, this.end || undefined];
      Object.assign(this.chart.options.scales.x, { min: from, max: to });
      this.chart.update("none");
    } else if (what === "shown") {
      this.series.forEach((one, i) => this.chart.setDatasetVisibility(i, one.run === null || this.view.shown[one.run]));
      this.chart.update("none");
      this.showMoment();
    }
  }

  showMoment() {
    const moment = this.view.moment;
    const visible = this.series.filter((one) => one.t.length && (one.run === null || this.view.shown[one.run]));
    this.readout.innerHTML = "";
    for (const one of visible) {
      const label = document.createElement("span");
      label.innerHTML = `<b style="color:${one.color}"></b> `;
      label.firstChild.textContent = one.label;
      const value = moment === null ? "" : DeepUav.number(one.y[DeepUav.nearestIndex(one.t, moment)]) + (this.unit ? " " + this.unit : "");
      label.append(value, "\u2002");
      this.readout.append(label);
    }
    if (moment !== null) this.readout.append(`at ${moment.toFixed(2)} s`);
    const area = this.chart.chartArea, place = moment === null ? NaN : this.chart.scales.x.getPixelForValue(moment);
    this.cursor.hidden = !(place >= area.left && place <= area.right);
    Object.assign(this.cursor.style, { left: `${place}px`, top: `${area.top}px`, bottom: `${this.chart.height - area.bottom}px` });
  }

  followPointer() {
    const secondsAt = (event) => {
      const { left, right } = this.chart.chartArea;
      const place = event.clientX - this.frame.getBoundingClientRect().left;
      return this.chart.scales.x.getValueForPixel(Math.min(Math.max(place, left), right));
    };
    let start = null;
    this.frame.addEventListener("pointermove", (event) => {
      this.view.set("moment", secondsAt(event));
      if (start !== null) this.showSelection(start, secondsAt(event));
    });
    this.frame.addEventListener("pointerleave", () => this.view.set("moment", null));
    this.frame.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") return;
      this.frame.setPointerCapture(event.pointerId);
      start = secondsAt(event);
    });
    this.frame.addEventListener("pointerup", (event) => {
      const end = secondsAt(event), from = start;
      start = null;
      this.selection.hidden = true;
      if (from === null) return;
      const pixels = Math.abs(this.chart.scales.x.getPixelForValue(end) - this.chart.scales.x.getPixelForValue(from));
      if (pixels > 6) this.view.set("range", [Math.min(from, end), Math.max(from, end)]);
    });
    this.frame.addEventListener("dblclick", () => this.view.set("range", null));
  }

  showSelection(from, to) {
    const [left, right] = [from, to].map((value) => this.chart.scales.x.getPixelForValue(value)).sort((a, b) => a - b);
    const area = this.chart.chartArea;
    this.selection.hidden = right - left < 3;
    Object.assign(this.selection.style, { left: `${left}px`, width: `${right - left}px`, top: `${area.top}px`, height: `${area.bottom - area.top}px` });
  }
};

// Paths seen from above, with the same scale on both axes. `paths`: {run, label, t, p, color, width, shades: css colours or null}.
DeepUav.PlanChart = class {
  constructor(canvas, dot, view) {
    this.view = view;
    this.dot = dot;
    this.paths = [];
    const options = DeepUav.chartBase("", "");
    this.chart = new Chart(canvas, { type: "scatter", data: { datasets: [] }, options });
    new ResizeObserver(() => this.equalise()).observe(canvas.parentElement);
    view.listen((what) => (what === "moment" ? this.showMoment() : what === "shown" ? this.setPaths(this.paths, this.axes, this.unit) : null));
  }

  setPaths(paths, axes, unit) {
    Object.assign(this, { paths, axes, unit });
    this.chart.options.scales.x.title = { ...this.chart.options.scales.x.title, display: true, text: `${"xyz"[axes[0]]}, ${unit}` };
    this.chart.options.scales.y.title = { ...this.chart.options.scales.y.title, display: true, text: `${"xyz"[axes[1]]}, ${unit}` };
    this.visible = paths.filter((path) => path.run === null || this.view.shown[path.run]);
    this.chart.data.datasets = this.visible.map((path) => {
      const breaks = DeepUav.breaks(path.t);
      const xs = path.t.map((_, i) => path.p[3 * i + axes[0]]), ys = path.t.map((_, i) => path.p[3 * i + axes[1]]);
      const points = DeepUav.linePoints(xs, ys, breaks);
      const shades = [];
      breaks.forEach((isBreak, i) => {
        if (isBreak) shades.push(null);
        shades.push(path.shades ? path.shades[i] : path.color);
      });
      return {
        data: points, showLine: true, borderColor: path.color, borderWidth: path.width || 2, order: path.run === null ? 1 : 0,
        segment: path.shades ? { borderColor: (context) => shades[context.p1DataIndex] } : undefined,
      };
    });
    this.equalise();
  }

  // Grows the shorter range until both axes have the same scale.
  equalise() {
    const corners = this.visible && this.visible.length ? this.axes.map((axis) => {
      let low = Infinity, high = -Infinity;
      for (const path of this.visible) {
        for (let i = axis; i < path.p.length; i += 3) {
          low = Math.min(low, path.p[i]);
          high = Math.max(high, path.p[i]);
        }
      }
      return low <= high ? [low, high] : [0, 1];
    }) : [[0, 1], [0, 1]];
    const scales = this.chart.options.scales;
    for (let round = 0; round < 2; ++round) {
      const area = this.chart.chartArea || { left: 50, right: this.chart.width, top: 0, bottom: this.chart.height - 40 };
      const sizes = [area.right - area.left, area.bottom - area.top];
      const scale = Math.max(...corners.map(([low, high], i) => (1.08 * (high - low)) / Math.max(sizes[i], 1)), 1e-9);
      corners.forEach(([low, high], i) => {
        const middle = (low + high) / 2, half = (scale * sizes[i]) / 2;
        Object.assign(scales[i === 0 ? "x" : "y"], { min: middle - half, max: middle + half });
      });
      this.chart.update("none");
    }
    this.showMoment();
  }

  showMoment() {
    const path = this.visible && this.visible.filter((one) => one.run !== null && one.t.length)[0];
    const moment = this.view.moment;
    this.dot.hidden = !path || moment === null;
    if (this.dot.hidden) return;
    const i = DeepUav.nearestIndex(path.t, moment);
    this.dot.style.left = `${this.chart.scales.x.getPixelForValue(path.p[3 * i + this.axes[0]])}px`;
    this.dot.style.top = `${this.chart.scales.y.getPixelForValue(path.p[3 * i + this.axes[1]])}px`;
    this.dot.style.background = path.color;
  }
};

// The share of values up to each: `series`: {run, label, values, color}.
DeepUav.distributionChart = function (canvas, view, series, xTitle) {
  const options = DeepUav.chartBase(xTitle, "share");
  options.scales.x.min = 0;
  Object.assign(options.scales.y, { min: 0, max: 1 });
  const chart = new Chart(canvas, {
    type: "line",
    data: { datasets: series.map((one) => {
      const sorted = Float64Array.from(one.values).sort();
      const shares = sorted.map((_, i) => (i + 1) / sorted.length);
      return { data: DeepUav.linePoints(sorted, shares), borderColor: one.color, borderWidth: 1.8 };
    }) },
    options,
  });
  view.listen((what) => {
    if (what !== "shown") return;
    series.forEach((one, i) => chart.setDatasetVisibility(i, view.shown[one.run]));
    chart.update("none");
  });
};
