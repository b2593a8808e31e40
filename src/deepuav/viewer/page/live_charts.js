// Charts of what comes: the latest of a number over time, and bars of the stages.
"use strict";

DeepUav.liveSeconds = 60;
DeepUav.mostStages = 14;

// After light became dark, or dark light.
DeepUav.recolor = function (chart) {
  const fresh = DeepUav.chartBase("", "").scales.x;
  for (const axis of Object.values(chart.options.scales)) {
    axis.ticks.color = fresh.ticks.color;
    Object.assign(axis.grid, fresh.grid);
  }
  chart.update("none");
};

DeepUav.LatestChart = class {
  constructor(canvas, color) {
    const options = DeepUav.chartBase("", "");
    options.scales.y.beginAtZero = true;
    this.chart = new Chart(canvas, { type: "line", data: { datasets: [{ data: [], borderColor: color, borderWidth: 1.8 }] }, options });
    this.points = this.chart.data.datasets[0].data;
  }

  add(seconds, value) {
    this.points.push({ x: seconds, y: value });
    while (this.points[0].x < seconds - DeepUav.liveSeconds) this.points.shift();
    Object.assign(this.chart.options.scales.x, { min: Math.max(0, seconds - DeepUav.liveSeconds), max: Math.max(seconds, 10) });
  }

  draw() {
    this.chart.update("none");
  }
};

DeepUav.StagesChart = class {
  constructor(canvas) {
    const options = DeepUav.chartBase("", "");
    options.indexAxis = "y";
    options.parsing = true;
    options.scales.x.beginAtZero = true;
    options.scales.y.type = "category";
    options.scales.y.ticks.autoSkip = false;
    this.chart = new Chart(canvas, { type: "bar", data: { labels: [], datasets: [{ data: [], backgroundColor: DeepUav.cssVariable("--accent"), maxBarThickness: 16 }] }, options });
  }

  show(stages) {
    const longest = Object.entries(stages).sort((a, b) => b[1] - a[1]).slice(0, DeepUav.mostStages);
    this.chart.data.labels = longest.map(([name]) => name);
    this.chart.data.datasets[0].data = longest.map(([, ms]) => ms);
    this.chart.update("none");
  }
};
