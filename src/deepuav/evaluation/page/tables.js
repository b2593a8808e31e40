// Tables and tiles.
"use strict";

DeepUav.element = function (name, text = "", className = "") {
  const element = document.createElement(name);
  if (text !== "") element.textContent = text;
  if (className) element.className = className;
  return element;
};

// `columns`: texts; `rows`: arrays of texts or nodes; options.rowClass(i) and options.cellClass(i, j).
DeepUav.table = function (columns, rows, { rowClass = () => "", cellClass = () => "" } = {}) {
  const table = DeepUav.element("table");
  const head = table.createTHead().insertRow();
  for (const column of columns) {
    const cell = DeepUav.element("th");
    cell.append(column);
    head.append(cell);
  }
  const body = table.createTBody();
  rows.forEach((row, i) => {
    const line = body.insertRow();
    line.className = rowClass(i);
    row.forEach((content, j) => {
      const cell = line.insertCell();
      cell.className = cellClass(i, j);
      cell.append(content);
    });
  });
  return table;
};

DeepUav.runLabel = function (run) {
  const label = DeepUav.element("span");
  const swatch = DeepUav.element("i", "", "swatch");
  swatch.style.setProperty("--run", run.color);
  label.append(swatch, run.name);
  return label;
};

DeepUav.tile = function ({ label, value, unit = "", detail = "", lead = false }) {
  const tile = DeepUav.element("div", "", lead ? "tile lead" : "tile");
  const number = DeepUav.element("div", value, "value");
  if (unit) number.append(" ", DeepUav.element("small", unit));
  tile.append(DeepUav.element("div", label, "label"), number, DeepUav.element("div", detail, "detail"));
  return tile;
};

// The step of a relative error: "1 frame", "2 s".
DeepUav.stepName = ({ delta, unit }) => `${delta} ${unit === "frames" && delta === 1 ? "frame" : unit}`;

// The figures of a run: {label, value (a number or null), text, unit, detail, better: -1 less, 1 more, 0 neither}.
DeepUav.keyFigures = function (run) {
  const summary = run.summary, frames = summary.frames || {}, maps = summary.maps || [];
  const main = maps.find((map) => map.id === summary.main_map) || {};
  const figures = run.evaluation ? run.evaluation.figures : null;
  const rows = [];
  const add = (label, value, text, unit, detail, better) => rows.push({ label, value, text, unit, detail, better });
  if (figures) {
    const ate = figures.ate_m, path = figures.compared_path_m;
    add(figures.horizontal ? "Horizontal error (ATE)" : "Absolute error (ATE)", ate.rmse, DeepUav.number(ate.rmse), "m",
      `rmse; ${DeepUav.number((100 * ate.rmse) / path, 2)} % of ${DeepUav.number(path)} m flown`, -1);
    if (figures.rpe) {
      const turn = figures.rpe.rotation_deg ? `${DeepUav.number(figures.rpe.rotation_deg.rmse)}° of turn` : "of distance";
      add("Relative error (RPE)", figures.rpe.translation_m.rmse, DeepUav.number(figures.rpe.translation_m.rmse), "m", `rmse over ${DeepUav.stepName(figures.rpe)}; ${turn}`, -1);
    }
  }
  if (frames.processed) {
    add("Frames located", frames.located / frames.processed, `${((100 * frames.located) / frames.processed).toFixed(frames.located === frames.processed ? 0 : 1)}`, "%",
      `${frames.located} of ${frames.processed}; ${frames.tracked_online} at once`, 1);
  }
  const inMaps = ["no map was started", "all located frames in one"][maps.length] || `${main.frames} frames in the largest`;
  add("Maps", maps.length, String(maps.length), "", inMaps, -1);
  if (main.keyframes) add("Keyframes", main.keyframes, String(main.keyframes), "", `${main.landmarks} landmarks`, 0);
  if (frames.processed && summary.wall_s) {
    add("Speed", frames.processed / summary.wall_s, DeepUav.number(frames.processed / summary.wall_s), "frames/s", `${summary.wall_s.toFixed(1)} s, ${summary.schedule}`, 1);
  }
  for (const [name, key] of [["Loops closed", "closed_loops"], ["Relocalisations", "relocalisations"], ["Maps merged", "merged_maps"],
    ["Landmarks set aside", "landmarks_set_aside"]]) {
    const count = Array.isArray(summary[key]) ? summary[key].length : summary[key];
    if (count) add(name, count, String(count), "", "", 0);
  }
  if (summary.peak_resident_mb) add("Peak memory", summary.peak_resident_mb, summary.peak_resident_mb.toFixed(0), "MB", "", -1);
  return rows;
};

DeepUav.summaryTable = function (runs) {
  const figures = runs.map(DeepUav.keyFigures);
  const labels = [...new Set(figures.flat().map((figure) => figure.label))];
  const best = new Map();
  for (const label of labels) {
    const values = figures.map((list) => list.find((figure) => figure.label === label)).filter(Boolean);
    if (values.length < 2 || !values[0].better) continue;
    const target = values[0].better > 0 ? Math.max(...values.map((one) => one.value)) : Math.min(...values.map((one) => one.value));
    if (values.some((one) => one.value !== target)) best.set(label, target);
  }
  const cell = (run, label) => figures[run].find((figure) => figure.label === label);
  return DeepUav.table(["", ...runs.map(DeepUav.runLabel)],
    labels.map((label) => [label, ...runs.map((_, i) => (cell(i, label) ? `${cell(i, label).text} ${cell(i, label).unit}` : "–"))]),
    { cellClass: (i, j) => (j > 0 && cell(j - 1, labels[i]) && cell(j - 1, labels[i]).value === best.get(labels[i]) ? "best" : "") });
};

DeepUav.errorTable = function (runs) {
  const columns = ["rmse", "mean", "median", "std", "min", "max"];
  const rows = [];
  for (const run of runs) {
    const figures = run.evaluation.figures;
    const add = (label, statistics) => {
      const name = DeepUav.element("span");
      name.append(runs.length > 1 ? DeepUav.runLabel(run) : "", runs.length > 1 ? `: ${label}` : label);
      rows.push([name, ...columns.map((column) => DeepUav.number(statistics[column], 4))]);
    };
    add(figures.horizontal ? "ATE horizontal, m" : "ATE, m", figures.ate_m);
    if (!figures.rpe) continue;
    add(figures.rpe.rotation_deg ? "RPE, m" : "RPE of distances, m", figures.rpe.translation_m);
    if (figures.rpe.rotation_deg) add("RPE, °", figures.rpe.rotation_deg);
  }
  return DeepUav.table(["", ...columns], rows);
};

DeepUav.timingTable = function (runs) {
  const names = [...new Set(runs.flatMap((run) => Object.keys(run.summary.stages || {})))];
  const entries = names.flatMap((name) => runs.map((run) => ({ name, run, times: (run.summary.stages || {})[name] })).filter((one) => one.times));
  const total = (name) => Math.max(...entries.filter((one) => one.name === name).map((one) => one.times.total_s));
  entries.sort((a, b) => total(b.name) - total(a.name) || (a.name < b.name ? -1 : a.name > b.name ? 1 : 0));
  const longest = Math.max(...entries.map((one) => one.times.total_s), 1e-9);
  const rows = entries.map(({ name, run, times }) => {
    const bar = DeepUav.element("span", "", "bar");
    bar.style.width = `${Math.max(0.5, (100 * times.total_s) / longest)}%`;
    bar.style.setProperty("--run", run.color);
    const label = runs.length > 1 ? DeepUav.runLabel({ ...run, name }) : name;
    return [label, String(times.count), DeepUav.number(times.median_ms), DeepUav.number(times.p95_ms), times.total_s.toFixed(2), bar];
  });
  return DeepUav.table(["stage", "calls", "median", "95 %", "total, s", ""], rows, { cellClass: (i, j) => (j === 5 ? "bar-cell" : "") });
};

// Why frames have no pose, of each run.
DeepUav.lostTable = function (runs) {
  const rows = runs.flatMap((run) => run.lost.map((lost) => [
    ...(runs.length > 1 ? [DeepUav.runLabel(run)] : []), lost.reason, String(lost.frames), lost.first === lost.last ? String(lost.first) : `${lost.first} to ${lost.last}`]));
  return DeepUav.table([...(runs.length > 1 ? ["run"] : []), "frames without a pose, for", "frames", "numbers"], rows);
};

// {name: text} of all that was set and used.
DeepUav.facts = function (run) {
  const { options = {}, dataset = {}, version, schedule, features, matcher } = run.summary;
  return { version, dataset: dataset.path, "dataset kind": dataset.kind, schedule, features, matcher, ...options };
};

DeepUav.optionsTable = function (runs, filter, onlyDiffering) {
  const facts = runs.map(DeepUav.facts);
  const names = [...new Set(facts.flatMap(Object.keys))];
  const text = (i, name) => (facts[i][name] === undefined ? "–" : String(facts[i][name]));
  const differs = (name) => runs.some((_, i) => text(i, name) !== text(0, name));
  const kept = names.filter((name) => (!onlyDiffering || differs(name)) &&
    (!filter || name.includes(filter) || runs.some((_, i) => text(i, name).includes(filter))));
  return DeepUav.table(["", ...runs.map(DeepUav.runLabel)], kept.map((name) => [name, ...runs.map((_, i) => text(i, name))]),
    { rowClass: (i) => (differs(kept[i]) ? "differs" : "") });
};
