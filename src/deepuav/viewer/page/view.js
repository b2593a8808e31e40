// Shows what comes. Numbers at most ten times a second, charts twice, the scene as it changes.
"use strict";

(function () {
  const byId = (id) => document.getElementById(id);
  const start = performance.now();
  const seconds = () => (performance.now() - start) / 1000;
  const scene = new DeepUav.Scene(byId("scene"), [0, -1, 0]);
  const pathColor = "#43c0c4", keyframeColor = "#9bd770", cameraColor = "#ffb347", loopColor = "#ff5fa2";
  const rate = new DeepUav.LatestChart(byId("rate-chart"), DeepUav.runColor(0));
  const landmarks = new DeepUav.LatestChart(byId("landmarks-chart"), DeepUav.runColor(2));
  const stages = new DeepUav.StagesChart(byId("stages-chart"));
  const tiles = new Map();
  const counts = { status: 0, picture: 0, map: 0 };
  let status = null, isShown = true, fitted = null, drawing = false, next = null;

  function tile(label, value, unit = "", detail = "") {
    if (!tiles.has(label)) {
      const box = document.createElement("div");
      box.className = "tile";
      box.innerHTML = `<div class="label"></div><div class="value"><span></span> <small></small></div><div class="detail"></div>`;
      box.querySelector(".label").textContent = label;
      byId("tiles").appendChild(box);
      tiles.set(label, { value: box.querySelector("span"), unit: box.querySelector("small"), detail: box.querySelector(".detail") });
    }
    tiles.get(label).value.textContent = value;
    tiles.get(label).unit.textContent = unit;
    tiles.get(label).detail.textContent = detail;
  }

  function setState(state, reason) {
    byId("state").textContent = state;
    byId("state").dataset.state = state;
    byId("reason").textContent = reason;
    byId("reason").hidden = !reason;
  }

  function showNumbers() {
    byId("subtitle").textContent = status.title;
    setState(status.state || "waiting for images", status.reason);
    tile("Frames/s", status.frames_per_s.toFixed(1));
    tile("Frame", status.frame < 0 ? "-" : status.frame);
    if (status.latency_ms > 0) tile("Latency", status.latency_ms.toFixed(0), "ms", `95 %: ${status.latency_p95_ms.toFixed(0)} ms`);
    tile("Tracked", status.landmarks, "", `of ${status.key_points} key points`);
    tile("Keyframes", status.keyframes);
    tile("Points", status.points);
    tile("Loops", status.closed_loops, "", `${status.merged_maps} maps merged`);
    if (status.memory_mb > 0) tile("Memory", status.memory_mb.toFixed(0), "MB", status.memory_is_peak ? "at most" : "");
    if (status.link) tile("Link", status.link.split(",")[0], "", status.link.split(", ")[1] || `${status.reconnects} times again`);
    if (status.arrived) tile("Overtaken", status.skipped, "", `of ${status.arrived} images`);
  }

  function showStatus(message) {
    status = message;
    showNumbers();
    rate.add(seconds(), status.frames_per_s);
    landmarks.add(seconds(), status.landmarks);
    if (!status.pose || status.map !== status.map_shown) return;
    const size = fitted ? 0.035 * fitted.getSize(new THREE.Vector3()).length() : 0.2;
    scene.putCameras("camera", Float32Array.from(status.pose.slice(0, 3)), Float32Array.from(status.pose.slice(3)), size, cameraColor);
    scene.layers.get("camera").material.opacity = 1;
    scene.draw();
  }

  function showCharts() {
    if (!status || document.hidden) return;
    rate.draw();
    landmarks.draw();
    stages.show(status.stages_ms);
    byId("rate-readout").textContent = `${status.frames_per_s.toFixed(1)} now`;
    byId("landmarks-readout").textContent = `${status.landmarks} now`;
  }

  // The next picture waits while one is decoded; what lies between is left out.
  async function showPicture(message) {
    next = message;
    if (drawing) return;
    drawing = true;
    while (next) {
      const picture = next;
      next = null;
      const image = await createImageBitmap(picture.jpeg);
      drawPicture(picture, image);
      image.close();
    }
    drawing = false;
  }

  function drawPicture(picture, image) {
    const canvas = byId("picture"), context = canvas.getContext("2d");
    if (canvas.width !== image.width) Object.assign(canvas, { width: image.width, height: image.height });
    context.drawImage(image, 0, 0);
    context.fillStyle = "#2ee6a6";
    for (let i = 0; i < picture.shares.length; i += 2) {
      const x = (picture.shares[i] / 65535) * image.width, y = (picture.shares[i + 1] / 65535) * image.height;
      context.fillRect(x - 1.5, y - 1.5, 3, 3);
    }
    byId("picture-readout").textContent = `frame ${picture.frame}, ${picture.points} landmarks`;
  }

  // The middle 90 % of each coordinate: a few points lie far away.
  function boxOf(message) {
    const box = new THREE.Box3();
    for (const values of [message.points, message.positions]) {
      for (const share of [0.05, 0.95]) {
        const corner = [0, 1, 2].map((axis) => DeepUav.quantile(values.filter((_, i) => i % 3 === axis), share));
        if (values.length) box.expandByPoint(new THREE.Vector3(...corner));
      }
    }
    for (let i = 0; i < message.path.length; i += 3) box.expandByPoint(new THREE.Vector3(...message.path.subarray(i, i + 3)));
    return box;
  }

  // Whether the world is now seen another way up.
  function turn(up) {
    if (scene.up.equals(new THREE.Vector3(...up))) return false;
    scene.setUp(up);
    return true;
  }

  function putLoops(ends) {
    if (!ends.length) return scene.remove("loops");
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
    scene.put("loops", new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: loopColor })));
  }

  function showMap(message) {
    const shades = new Float32Array(message.points.length).fill(0.72);
    scene.putCloud("points", message.points, shades, 1.6);
    scene.putPath("path", message.path, { color: pathColor });
    const box = boxOf(message), size = box.getSize(new THREE.Vector3()).length();
    scene.putCameras("keyframes", message.positions, message.rotations, 0.012 * size, keyframeColor);
    putLoops(message.loops);
    showLayers();
    const turned = turn(message.up);
    const grew = !fitted || !fitted.clone().expandByScalar(0.1 * size).containsBox(box);
    if (size > 0 && (turned || (byId("follow").checked && grew))) scene.fit(fitted = box);
    else scene.draw();
  }

  function showLayers() {
    scene.show("points", byId("show-points").checked);
    scene.show("keyframes", byId("show-keyframes").checked);
    scene.show("loops", byId("show-loops").checked);
    scene.draw();
  }

  function showEvents(message) {
    for (const line of message.lines) {
      const item = document.createElement("li"), time = document.createElement("time");
      time.textContent = new Date().toLocaleTimeString();
      item.append(time, line);
      byId("events").prepend(item);
    }
    while (byId("events").children.length > 100) byId("events").lastChild.remove();
  }

  const show = { status: showStatus, picture: showPicture, map: showMap, events: showEvents };
  byId("show-points").addEventListener("change", showLayers);
  byId("show-keyframes").addEventListener("change", showLayers);
  byId("show-loops").addEventListener("change", showLayers);
  byId("fit").addEventListener("click", () => fitted && scene.fit());
  byId("above").addEventListener("click", () => fitted && scene.fit(scene.box, 0, 89));
  byId("side").addEventListener("click", () => fitted && scene.fit(scene.box, 0, 5));
  document.addEventListener("visibilitychange", () => { isShown = !document.hidden; });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const chart of [rate, landmarks, stages]) DeepUav.recolor(chart.chart);
  });
  setInterval(showCharts, 500);
  DeepUav.connect((message) => {
    counts[message.kind] = (counts[message.kind] || 0) + 1;
    document.documentElement.dataset.messages = JSON.stringify(counts);
    if (isShown) show[message.kind](message);
  }, (isThere) => {
    if (!isThere) setState("disconnected", "The program does not answer: it may have ended.");
  });
})();
