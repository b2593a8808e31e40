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

  // How far the paths of a world reach along an axis.
  function reach(world, axis) {
    let low = Infinity, high = -Infinity;
    for (const run of world) {
      for (let i = axis; i < run.path.p.length; i += 3) {
        low = Math.min(low, run.path.p[i]);
        high = Math.max(high, run.path.p[i]);
      }
    }
    return high - low;
  }

  // Which way is up: z where the truth says so; else against the images' down or against the optical axes, which of the
  // two flights reach less far along, as cameras that always look the same way leave both open.
  function guessUp() {
    if (worlds[0].some((run) => run.evaluation && run.evaluation.z_is_up)) return [0, 0, 1];
    const sums = [[0, 0, 0], [0, 0, 0]];
    for (const run of worlds[0]) {
      for (let i = 0; 4 * i < run.keyframes.q.length; ++i) {
        const rotation = new THREE.Quaternion(...run.keyframes.q.subarray(4 * i, 4 * i + 4));
        [[0, -1, 0], [0, 0, -1]].forEach((axis, j) => new THREE.Vector3(...axis).applyQuaternion(rotation).toArray().forEach((value, k) => { sums[j][k] += value; }));
      }
    }
    const total = worlds[0].reduce((count, run) => count + run.keyframes.q.length / 4, 0) || 1;
    const found = sums.map((sum) => ({ sum, axis: sum.findIndex((value) => Math.abs(value) / total > 0.7) })).filter(({ axis }) => axis >= 0);
    found.sort((a, b) => reach(worlds[0], a.axis) - reach(worlds[0], b.axis));
    if (!found.length) return [0, 0, 1];
    const { sum, axis } = found[0];
    return [0, 1, 2].map((other) => (other === axis ? Math.sign(sum[axis]) : 0));
  }

  const errorLimit = DeepUav.quantile(evaluated.flatMap((run) => Array.from(run.evaluation.error_m)), 0.98) || 1;
  const errorShade = (error) => DeepUav.colorAt("error", error / errorLimit);

  // The path of a run and its colours: by error the compared poses, else all.
  function coloredPath(run, mode) {
    if (mode === "error" && run.evaluation) {
      const { matched, error_m } = run.evaluation;
      return { ...matched, shades: Array.from(error_m, errorShade) };
    }
    if (mode === "time") {
      return { ...run.path, shades: Array.from(run.path.t, (time) => DeepUav.colorAt("viridis", time / end)) };
    }
    return { ...run.path, shades: null };
  }

  function cloudColors(run, up) {
    const axis = up.findIndex((value) => value !== 0);
    if (run.cloud.rgb) return Float32Array.from(DeepUav.unpack(run.cloud.rgb), (value) => value / 255);
    const heights = [];
    for (let i = axis; i < run.points.length; i += 3) heights.push(up[axis] * run.points[i]);
    const low = DeepUav.quantile(heights, 0.03), high = DeepUav.quantile(heights, 0.97);
    const colors = new Float32Array(run.points.length);
    heights.forEach((height, i) => {
      const rgb = DeepUav.colorAt("viridis", 0.15 + (0.85 * (height - low)) / Math.max(high - low, 1e-9));
      for (let k = 0; k < 3; ++k) colors[3 * i + k] = 0.35 + 0.6 * rgb[k];
    });
    return colors;
  }

  // Around the paths and the bulk of the points.
  function worldBox(world) {
    const box = new THREE.Box3();
    for (const run of world) {
      const paths = [run.path.p, run.evaluation ? run.evaluation.truth.p : []];
      for (const points of paths) for (let i = 0; i < points.length; i += 3) box.expandByPoint(new THREE.Vector3(points[i], points[i + 1], points[i + 2]));
      const low = [], high = [];
      for (let axis = 0; axis < 3; ++axis) {
        const values = run.points.filter((_, i) => i % 3 === axis);
        low.push(DeepUav.quantile(values, 0.15));
        high.push(DeepUav.quantile(values, 0.85));
      }
      if (run.points.length) box.union(new THREE.Box3(new THREE.Vector3(...low), new THREE.Vector3(...high)));
    }
    return box.isEmpty() ? new THREE.Box3(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1)) : box;
  }

  function roundStep(length) {
    const power = 10 ** Math.floor(Math.log10(length));
    return power * [1, 2, 5, 10].find((factor) => factor * power >= length);
  }

  function choose(select, entries, change) {
    for (const [value, text] of entries) {
      const option = DeepUav.element("option", text);
      option.value = value;
      select.append(option);
    }
    select.addEventListener("change", change);
  }

  function makeTrajectory() {
    const modes = [["run", runs.length > 1 ? "by run" : "plain"], ["time", "by time"]];
    if (evaluated.length) modes.unshift(["error", "by error"]);
    let world = worlds[0];
    choose(byId("scene-color"), modes, drawPaths);
    if (evaluated.length && world.length > 1) byId("scene-color").value = "run";
    const ups = [[0, 0, 1], [0, 0, -1], [0, -1, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0]];
    const upName = (up) => (up.some((value) => value < 0) ? "−" : "+") + "xyz"[up.findIndex((value) => value !== 0)];
    choose(byId("scene-up"), ups.map((up, i) => [i, upName(up)]), () => { scene && scene.setUp(ups[byId("scene-up").value]); drawWorld(); });
    const guessed = guessUp();
    byId("scene-up").value = ups.findIndex((up) => up.every((value, i) => value === guessed[i]));

    const plan = new DeepUav.PlanChart(byId("plan"), byId("plan-dot"), view);
    let scene = null;
    try {
      scene = new DeepUav.Scene(byId("scene"), guessed);
    } catch (error) {
      byId("scene").append(DeepUav.element("p", "This browser has no WebGL, so there is no 3-D view.", "note"));
    }
    const bar = DeepUav.element("div", "", "color-bar");
    byId("scene").append(bar);
    const isShown = (run) => view.shown[run.index] && world.includes(run);

    function drawPaths() {
      const mode = byId("scene-color").value, up = ups[byId("scene-up").value];
      const flat = [];
      for (const run of runs) {
        const path = coloredPath(run, mode);
        if (scene) {
          scene.putPath(`path ${run.index}`, path.p, { color: run.color, width: 3, colors: path.shades && path.shades.flat() });
          scene.putPath(`truth ${run.index}`, run.evaluation ? run.evaluation.truth.p : [], { color: "#c9d3dc", width: 1.6 });
        }
        if (!world.includes(run)) continue;
        if (run.evaluation && run === world[0]) flat.push({ run: null, label: "truth", ...run.evaluation.truth, color: truthColor, width: 3.6 });
        flat.push({ run: run.index, label: run.name, ...path, shades: path.shades && path.shades.map(DeepUav.cssColor), color: run.color, width: 2 });
      }
      plan.setPaths(flat, DeepUav.planAxes(up), world[0].unit);
      drawBar(mode);
      showLayers();
    }

    function drawBar(mode) {
      bar.hidden = mode === "run";
      const strip = DeepUav.element("div"), labels = DeepUav.element("span");
      strip.style.background = DeepUav.cssGradient(mode === "error" ? "error" : "viridis");
      labels.append(DeepUav.element("b", "0"), DeepUav.element("b", mode === "error" ? `error ${DeepUav.number(errorLimit)} m` : `${DeepUav.number(end)} s`));
      bar.replaceChildren(strip, labels);
    }

    function showLayers() {
      if (!scene) return;
      const truthOf = world.find((run) => isShown(run) && run.evaluation) || world[0];
      for (const run of runs) {
        scene.show(`path ${run.index}`, isShown(run));
        scene.show(`truth ${run.index}`, run === truthOf && byId("scene-truth").checked);
        scene.show(`cloud ${run.index}`, isShown(run) && byId("scene-points").checked);
        scene.show(`cameras ${run.index}`, isShown(run) && byId("scene-cameras").checked);
      }
      scene.draw();
    }

    function drawWorld() {
      const up = ups[byId("scene-up").value], box = worldBox(world);
      const size = box.getSize(new THREE.Vector3()).length();
      if (scene) {
        for (const run of runs) {
          scene.putCloud(`cloud ${run.index}`, run.points, cloudColors(run, up));
          scene.putCameras(`cameras ${run.index}`, run.keyframes.p, run.keyframes.q, 0.008 * size, run.color);
        }
        scene.putGrid("grid", box, roundStep(size / 14));
        scene.fit(box);
      }
      drawPaths();
      const shown = world.reduce((count, run) => count + run.cloud.count, 0), total = world.reduce((count, run) => count + run.cloud.total, 0);
      byId("scene-caption").textContent = `Drag turns, wheel zooms, right button moves. ${shown} of ${total} points${world.some((run) => run.cloud.rgb) ? "" : ", coloured by height"}; squares of ${DeepUav.number(roundStep(size / 14), 1)} ${world[0].unit}.`;
    }

    if (worlds.length > 1) {
      const select = DeepUav.element("select");
      choose(select, worlds.map((one, i) => [i, one.map((run) => run.name).join(", ")]), () => { world = worlds[select.value]; drawWorld(); });
      const label = DeepUav.element("label", "Shown ");
      label.append(select);
      byId("scene-color").closest(".toolbar").prepend(label);
    }
    byId("plan-caption").textContent = evaluated.length ? "Grey: truth. Seen from above, same scale on both axes." : "Seen from above, same scale on both axes.";
    for (const id of ["scene-truth", "scene-points", "scene-cameras"]) byId(id).addEventListener("change", showLayers);
    byId("scene-truth").parentElement.hidden = !evaluated.length;
    byId("scene-above").addEventListener("click", () => scene && scene.fit(undefined, 0, 89.9));
    byId("scene-side").addEventListener("click", () => scene && scene.fit(undefined, 0, 4));
    byId("scene-fit").addEventListener("click", () => scene && scene.fit());
    view.listen((what) => {
      if (what === "shown") showLayers();
      if (what !== "moment" || !scene) return;
      const run = world.find((one) => isShown(one) && one.path.t.length);
      const i = run && view.moment !== null ? DeepUav.nearestIndex(run.path.t, view.moment) : null;
      scene.setMarker(i === null || i === undefined ? null : run.path.p.subarray(3 * i, 3 * i + 3), run ? run.color : "#ffffff");
    });
    drawWorld();
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
    choose(byId("timing-stage"), names.map((name) => [name, name]), draw);
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
    makeTrajectory();
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
