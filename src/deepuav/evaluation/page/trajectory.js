// Where the cameras flew, in space and seen from above: paths, points and keyframes of the runs of one world.
"use strict";

(function () {
  const byId = (id) => document.getElementById(id);

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
  function guessUp(world) {
    if (world.some((run) => run.evaluation && run.evaluation.z_is_up)) return [0, 0, 1];
    const sums = [[0, 0, 0], [0, 0, 0]];
    for (const run of world) {
      for (let i = 0; 4 * i < run.keyframes.q.length; ++i) {
        const rotation = new THREE.Quaternion(...run.keyframes.q.subarray(4 * i, 4 * i + 4));
        [[0, -1, 0], [0, 0, -1]].forEach((axis, j) => new THREE.Vector3(...axis).applyQuaternion(rotation).toArray().forEach((value, k) => { sums[j][k] += value; }));
      }
    }
    const total = world.reduce((count, run) => count + run.keyframes.q.length / 4, 0) || 1;
    const found = sums.map((sum) => ({ sum, axis: sum.findIndex((value) => Math.abs(value) / total > 0.7) })).filter(({ axis }) => axis >= 0);
    found.sort((a, b) => reach(world, a.axis) - reach(world, b.axis));
    if (!found.length) return [0, 0, 1];
    const { sum, axis } = found[0];
    return [0, 1, 2].map((other) => (other === axis ? Math.sign(sum[axis]) : 0));
  }

  // The path of a run and its colours: by error the compared poses, else all.
  function coloredPath(run, mode, errorLimit, end) {
    if (mode === "error" && run.evaluation) {
      const { matched, error_m } = run.evaluation;
      return { ...matched, shades: Array.from(error_m, (error) => DeepUav.colorAt("error", error / errorLimit)) };
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

  // Fills a select with entries of value and text.
  DeepUav.choose = function (select, entries, change) {
    for (const [value, text] of entries) {
      const option = DeepUav.element("option", text);
      option.value = value;
      select.append(option);
    }
    select.addEventListener("change", change);
  };

  // `worlds`: the runs that lie in one; `end`: of the longest, in seconds.
  DeepUav.showTrajectory = function ({ runs, evaluated, worlds, view, end, truthColor }) {
    const errorLimit = DeepUav.quantile(evaluated.flatMap((run) => Array.from(run.evaluation.error_m)), 0.98) || 1;
    const modes = [["run", runs.length > 1 ? "by run" : "plain"], ["time", "by time"]];
    if (evaluated.length) modes.unshift(["error", "by error"]);
    let world = worlds[0];
    DeepUav.choose(byId("scene-color"), modes, drawPaths);
    if (evaluated.length && world.length > 1) byId("scene-color").value = "run";
    const ups = [[0, 0, 1], [0, 0, -1], [0, -1, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0]];
    const upName = (up) => (up.some((value) => value < 0) ? "−" : "+") + "xyz"[up.findIndex((value) => value !== 0)];
    DeepUav.choose(byId("scene-up"), ups.map((up, i) => [i, upName(up)]), () => { scene && scene.setUp(ups[byId("scene-up").value]); drawWorld(); });
    const guessed = guessUp(worlds[0]);
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
        const path = coloredPath(run, mode, errorLimit, end);
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
      DeepUav.choose(select, worlds.map((one, i) => [i, one.map((run) => run.name).join(", ")]), () => { world = worlds[select.value]; drawWorld(); });
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
  };
})();
