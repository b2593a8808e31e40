// Puts the page together from the data in it.
"use strict";

(function () {
  const data = JSON.parse(document.getElementById("report-data").textContent);
  const byId = (id) => document.getElementById(id);
  const runs = data.runs.map(unpackRun);
  const evaluated = runs.filter((run) => run.evaluation);
  const view = new DeepUav.View(runs.length);
  const truthColor = DeepUav.cssVariable("--truth");
  const unit = evaluated.length === runs.length ? "m" : evaluated.length ? "m or map units" : "map units";
  const end = Math.max(...runs.map((run) => Math.max(run.path.t[run.path.t.length - 1] || 0, run.evaluation ? run.evaluation.truth.t[run.evaluation.truth.t.length - 1] : 0)), 1e-3);
  const worlds = worldsOf(runs);

  function unpackPath(path) {
    return { t: DeepUav.unpack(path.t), p: DeepUav.unpack(path.p) };
  }

  function unpackRun(run, index) {
    const unpacked = { ...run, index, color: DeepUav.runColor(index), path: unpackPath(run.path), keyframes: unpackPath(run.keyframes) };
    unpacked.keyframes.q = DeepUav.unpack(run.keyframes.q);
    unpacked.points = DeepUav.unpackPoints(run.cloud);
    unpacked.growth = { t: DeepUav.unpack(run.growth.t), landmarks: DeepUav.unpack(run.growth.landmarks) };
    unpacked.stages = run.stages.map((stage) => ({ name: stage.name, ms: DeepUav.unpack(stage.ms) }));
    if (run.evaluation) {
      const { relative } = run.evaluation;
      unpacked.evaluation = {
        ...run.evaluation, truth: unpackPath(run.evaluation.truth), matched: unpackPath(run.evaluation.matched),
        matched_truth: unpackPath(run.evaluation.matched_truth), error_m: DeepUav.unpack(run.evaluation.error_m),
        relative: relative && { t: DeepUav.unpack(relative.t), translation_m: DeepUav.unpack(relative.translation_m), rotation_deg: DeepUav.unpack(relative.rotation_deg) },
      };
    }
    return unpacked;
  }

  // Runs that were compared with the same truth lie in one world, any other in one of its own.
  function worldsOf(all) {
    const worlds = new Map();
    all.forEach((run) => {
      const key = run.evaluation ? `truth ${run.evaluation.source}` : `run ${run.index}`;
      if (!worlds.has(key)) worlds.set(key, []);
      worlds.get(key).push(run);
    });
    return [...worlds.values()];
  }

  function makeHeader() {
    const datasets = [...new Set(runs.map((run) => (run.summary.dataset || {}).path || ""))].map((path) => path.replace(/\/+$/, "").split("/").pop());
    byId("subtitle").textContent = runs.length === 1 ? `${datasets[0]} · run ${runs[0].name}` : `${runs.length} runs · ${datasets.join(", ")}`;
    document.title = `${runs.map((run) => run.name).join(", ")}: Deep-UAV SLAM`;
    byId("made-by").textContent = `Written by deepuav report ${data.version}. Everything is inside this file; nothing was fetched.`;
    for (const section of document.querySelectorAll("main section:not([hidden])")) {
      const link = DeepUav.element("a", section.dataset.title);
      link.href = `#${section.id}`;
      byId("contents").append(link);
    }
    byId("runs").hidden = runs.length === 1;
    for (const run of runs) {
      const chip = DeepUav.element("button", "", "chip");
      chip.type = "button";
      chip.style.setProperty("--run", run.color);
      chip.append(DeepUav.element("i"), run.name);
      const press = () => chip.setAttribute("aria-pressed", view.shown[run.index]);
      chip.addEventListener("click", () => view.set("shown", view.shown.map((shown, i) => (i === run.index ? !shown : shown))));
      view.listen((what) => what === "shown" && press());
      press();
      byId("runs").append(chip);
    }
  }

  function makeSummary() {
    if (runs.length === 1) {
      DeepUav.keyFigures(runs[0]).forEach((figure, i) => {
        byId("summary-tiles").append(DeepUav.tile({ label: figure.label, value: figure.text, unit: figure.unit, detail: figure.detail, lead: i === 0 && evaluated.length > 0 }));
      });
    } else {
      byId("summary-table").append(DeepUav.summaryTable(runs));
    }
    byId("summary-lost").hidden = !runs.some((run) => run.lost.length);
    byId("summary-lost").append(DeepUav.lostTable(runs));
    for (const run of runs) {
      const name = runs.length > 1 ? `${run.name}: ` : "";
      if (run.problem) byId("summary-notes").append(DeepUav.element("p", `${name}not compared with a truth: ${run.problem}`, "note"));
      if (run.summary.stopped_early) byId("summary-notes").append(DeepUav.element("p", `${name}the run was stopped before its end.`, "note"));
    }
  }

  function makeComponents() {
    for (let axis = 0; axis < 3; ++axis) {
      const series = [];
      const pick = (path) => path.t.map((_, i) => path.p[3 * i + axis]);
      worlds.forEach((world) => world[0].evaluation && series.push({ label: worlds.length > 1 ? `truth of ${world[0].name}` : "truth", run: worlds.length > 1 ? world[0].index : null, t: world[0].evaluation.truth.t, y: pick(world[0].evaluation.truth), color: truthColor, width: 3.4, isTruth: true }));
      for (const run of runs) series.push({ label: runs.length > 1 ? run.name : "estimate", run: run.index, t: run.path.t, y: pick(run.path), color: run.color });
      new DeepUav.TimeChart(byId("components"), view, { title: "xyz"[axis], unit, series, end, xTitle: axis === 2 ? "time, s" : "" });
    }
  }

  function makeErrors() {
    byId("errors").hidden = !evaluated.length;
    if (!evaluated.length) return;
    const chart = (title, unitText, values) => {
      const series = evaluated.map((run) => ({ label: runs.length > 1 ? run.name : "", run: run.index, color: runs.length > 1 ? run.color : DeepUav.runColor(1), width: 1.4, ...values(run) })).filter((one) => one.t && one.y.length);
      if (series.length) new DeepUav.TimeChart(byId("error-charts"), view, { title, unit: unitText, series, fromZero: true, end });
    };
    const { rpe, horizontal } = evaluated[0].evaluation.figures;
    const step = rpe ? DeepUav.stepName(rpe) : "";
    chart(horizontal ? "Absolute error, horizontal" : "Absolute error", "m", (run) => ({ t: run.evaluation.matched_truth.t, y: run.evaluation.error_m }));
    chart(`Relative error over ${step}: ${rpe && rpe.rotation_deg ? "translation" : "distance"}`, "m", (run) => (run.evaluation.relative ? { t: run.evaluation.relative.t, y: run.evaluation.relative.translation_m } : {}));
    chart(`Relative error over ${step}: rotation`, "°", (run) => (run.evaluation.relative ? { t: run.evaluation.relative.t, y: run.evaluation.relative.rotation_deg } : {}));
    byId("error-table").append(DeepUav.errorTable(evaluated));
    for (const run of evaluated) {
      const f = run.evaluation.figures;
      const parts = [`truth ${run.evaluation.source}`, `${f.associated_poses} of ${f.truth_poses} moments`, `alignment ${f.alignment.kind}, scale ${DeepUav.number(f.alignment.scale, 4)}`];
      if (f.time_offset_s) parts.push(`time offset ${f.time_offset_s.toFixed(4)} s`);
      if (f.interpolated) parts.push("estimate interpolated");
      byId("error-table").append(DeepUav.element("p", `${runs.length > 1 ? run.name + ": " : ""}${parts.join("; ")}.`, "hint"));
    }
    DeepUav.distributionChart(byId("error-distribution"), view, evaluated.map((run) => ({ run: run.index, values: run.evaluation.error_m, color: run.color })), "absolute error, m");
  }

  function makeGrowth() {
    const grown = runs.filter((run) => run.growth.t.length);
    byId("map").hidden = !grown.length;
    const chart = (title, values) => new DeepUav.TimeChart(byId("growth-charts"), view, { title, unit: "", fromZero: true, steps: true, end, height: "220px",
      series: grown.map((run) => ({ label: runs.length > 1 ? run.name : "", run: run.index, color: run.color, t: run.growth.t, y: values(run), width: 1.8 })) });
    if (!grown.length) return;
    chart("Keyframes", (run) => run.growth.t.map((_, i) => i + 1));
    chart("Landmarks", (run) => run.growth.landmarks);
  }

  function makeSurvey() {
    const surveys = runs.filter((run) => run.survey);
    for (const run of surveys) DeepUav.addSurvey(byId("survey-pictures"), run.survey, runs.length > 1 ? run.name : "");
    byId("survey").hidden = !surveys.length;
  }

  function makePictures() {
    const settings = { points: true, matches: true };
    const pairs = [];
    for (const run of runs) {
      for (const pair of run.pictures) {
        const [first, second] = pair.views;
        const seconds = (second.time_s - first.time_s).toFixed(2);
        const title = `${runs.length > 1 ? run.name + ": " : ""}keyframes ${first.keyframe} and ${second.keyframe}, ${seconds} s apart: ${pair.shared} landmarks in both`;
        pairs.push(new DeepUav.PicturePair(byId("picture-list"), pair, title, settings));
      }
    }
    byId("pictures").hidden = !pairs.length;
    for (const what of ["points", "matches"]) {
      byId(`pictures-${what}`).addEventListener("change", (event) => {
        settings[what] = event.target.checked;
        pairs.forEach((pair) => pair.draw());
      });
    }
  }

  function makeTimings() {
    const timed = runs.filter((run) => run.stages.length);
    byId("timings").hidden = !timed.length;
    if (!timed.length) return;
    byId("timing-table").append(DeepUav.timingTable(runs));
    const names = [...new Set(timed.flatMap((run) => run.stages.filter((stage) => stage.ms.length > 1).map((stage) => stage.name)))];
    const longest = (name) => Math.max(...timed.map((run) => ((run.summary.stages || {})[name] || {}).total_s || 0));
    names.sort((a, b) => longest(b) - longest(a));
    DeepUav.choose(byId("timing-stage"), names.map((name) => [name, name]), draw);
    if (names.includes("track")) byId("timing-stage").value = "track";
    const options = DeepUav.chartBase("call", "ms");
    options.scales.x.min = 0;
    options.scales.y.beginAtZero = true;
    const chart = new Chart(byId("timing-chart"), { type: "line", data: { datasets: [] }, options });
    function draw() {
      chart.data.datasets = timed.map((run) => {
        const ms = (run.stages.find((stage) => stage.name === byId("timing-stage").value) || { ms: [] }).ms;
        return { data: DeepUav.linePoints(ms.map((_, i) => i), ms), borderColor: run.color, borderWidth: 1.2, hidden: !view.shown[run.index] };
      });
      chart.update("none");
    }
    view.listen((what) => what === "shown" && draw());
    draw();
  }

  function makeOptions() {
    const draw = () => byId("options-table").replaceChildren(DeepUav.optionsTable(runs, byId("options-search").value.trim(), byId("options-differing").checked));
    byId("options-differing-label").hidden = runs.length === 1;
    byId("options-search").addEventListener("input", draw);
    byId("options-differing").addEventListener("change", draw);
    draw();
  }

  makeSummary();
  byId("trajectory").hidden = !runs.some((run) => run.path.t.length);
  if (!byId("trajectory").hidden) {
    DeepUav.showTrajectory({ runs, evaluated, worlds, view, end, truthColor });
    makeComponents();
  }
  makeErrors();
  makeGrowth();
  makeSurvey();
  makePictures();
  makeTimings();
  makeOptions();
  makeHeader();
  document.documentElement.dataset.ready = "yes";
})();
