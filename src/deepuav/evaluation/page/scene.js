// A three-dimensional view of paths, points and cameras, turned with the mouse. It knows nothing of the report: the live
// view uses it as well. Needs three.js with OrbitControls and Line2.
"use strict";

DeepUav.Scene = class {
  // Fills `container`. `up` is a unit vector [x, y, z].
  constructor(container, up) {
    this.container = container;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    container.appendChild(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, 1000);
    this.layers = new Map();
    this.lineMaterials = [];
    this.box = new THREE.Box3();
    this.marker = new THREE.Mesh(new THREE.SphereGeometry(1, 20, 14), new THREE.MeshBasicMaterial({ color: 0xffffff }));
    this.marker.visible = false;
    this.scene.add(this.marker);
    this.setUp(up);
    new ResizeObserver(() => this.resize()).observe(container);
    this.resize();
  }

  setUp(up) {
    this.up = new THREE.Vector3(...up);
    this.camera.up.copy(this.up);
    if (this.controls) this.controls.dispose();
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.screenSpacePanning = true;
    this.controls.addEventListener("change", () => this.draw());
  }

  // What was added under a name replaces what had it before.
  put(name, object) {
    this.remove(name);
    this.layers.set(name, object);
    this.scene.add(object);
  }

  remove(name) {
    const object = this.layers.get(name);
    if (!object) return;
    this.scene.remove(object);
    this.lineMaterials = this.lineMaterials.filter((material) => material !== object.material);
    object.geometry.dispose();
    object.material.dispose();
    this.layers.delete(name);
  }

  show(name, visible) {
    const object = this.layers.get(name);
    if (object) object.visible = visible;
  }

  // A line through `points` (x, y, z by turns); `colors` r, g, b by turns, one a point, win over `color`.
  putPath(name, points, { color = "#ffffff", width = 2.5, colors = null } = {}) {
    if (points.length < 6) return this.remove(name);
    const geometry = new THREE.LineGeometry();
    geometry.setPositions(points);
    const shades = colors || this.repeated(color, points.length / 3);
    geometry.setColors(shades);
    const material = new THREE.LineMaterial({ linewidth: width, vertexColors: THREE.VertexColors });
    material.resolution.set(this.container.clientWidth || 1, this.container.clientHeight || 1);
    this.put(name, new THREE.Line2(geometry, material));
    this.lineMaterials.push(material);
  }

  putCloud(name, points, colors, size = 2.2) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(colors, 3));
    const material = new THREE.PointsMaterial({ size: size * this.renderer.getPixelRatio(), sizeAttenuation: false, vertexColors: THREE.VertexColors });
    this.put(name, new THREE.Points(geometry, material));
  }

  // A pyramid for each camera: `positions` by turns, `rotations` x, y, z, w by turns (world from camera, z forward).
  putCameras(name, positions, rotations, size, color) {
    const corners = [[-1, -0.75, 1.4], [1, -0.75, 1.4], [1, 0.75, 1.4], [-1, 0.75, 1.4]];
    const edges = [];
    for (let i = 0; 3 * i < positions.length; ++i) {
      const rotation = new THREE.Quaternion(...rotations.subarray(4 * i, 4 * i + 4));
      const tip = new THREE.Vector3(...positions.subarray(3 * i, 3 * i + 3));
      const base = corners.map((corner) => new THREE.Vector3(...corner).multiplyScalar(size).applyQuaternion(rotation).add(tip));
      base.forEach((corner, j) => edges.push(tip, corner, corner, base[(j + 1) % 4]));
    }
    const geometry = new THREE.BufferGeometry().setFromPoints(edges);
    this.put(name, new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color, transparent: true, opacity: 0.4 })));
  }

  // A grid of squares of `step` across the box, at its lowest height.
  putGrid(name, box, step) {
    const axis = this.upAxis();
    const [a, b] = [0, 1, 2].filter((other) => other !== axis);
    const low = box.min.toArray(), high = box.max.toArray();
    const height = this.up.getComponent(axis) > 0 ? low[axis] : high[axis];
    const vertices = [];
    const line = (along, across) => {
      const from = Math.floor(low[along] / step) * step, to = Math.ceil(high[along] / step) * step;
      for (let place = Math.floor(low[across] / step) * step; place <= high[across] + step; place += step) {
        for (const end of [from, to]) {
          const point = [0, 0, 0];
          point[along] = end;
          point[across] = place;
          point[axis] = height;
          vertices.push(new THREE.Vector3(...point));
        }
      }
    };
    line(a, b);
    line(b, a);
    const geometry = new THREE.BufferGeometry().setFromPoints(vertices);
    this.put(name, new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x4d6173, transparent: true, opacity: 0.35 })));
  }

  setMarker(position, color) {
    this.marker.visible = Boolean(position);
    if (position) {
      this.marker.position.set(...position);
      this.marker.material.color.set(color);
    }
    this.draw();
  }

  // Looks at the box from an azimuth and elevation (degrees).
  fit(box = this.box, azimuth = 40, elevation = 32) {
    this.box = box;
    const centre = box.getCenter(new THREE.Vector3());
    const radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-6);
    const [right, ahead] = this.levelAxes();
    const radians = Math.PI / 180;
    const level = right.clone().multiplyScalar(Math.sin(azimuth * radians)).add(ahead.clone().multiplyScalar(-Math.cos(azimuth * radians)));
    const direction = level.multiplyScalar(Math.cos(elevation * radians)).add(this.up.clone().multiplyScalar(Math.sin(elevation * radians)));
    const narrowest = Math.min(1, this.camera.aspect);
    const distance = (0.8 * radius) / Math.sin((this.camera.fov * radians) / 2) / narrowest;
    this.camera.position.copy(centre).add(direction.multiplyScalar(distance));
    this.camera.near = distance / 200;
    this.camera.far = 60 * distance;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(centre);
    this.controls.update();
    this.marker.scale.setScalar(0.016 * radius);
    this.draw();
  }

  upAxis() {
    return [0, 1, 2].reduce((best, axis) => (Math.abs(this.up.getComponent(axis)) > Math.abs(this.up.getComponent(best)) ? axis : best), 0);
  }

  // Two level axes, to the right and ahead, that make a right-handed frame with up.
  levelAxes() {
    const [right, ahead] = DeepUav.planAxes(this.up.toArray());
    const unit = (axis) => new THREE.Vector3().setComponent(axis, 1);
    return [unit(right), unit(ahead)];
  }

  repeated(color, count) {
    const shades = new Float32Array(3 * count);
    const rgb = DeepUav.parseColor(color);
    for (let i = 0; i < shades.length; ++i) shades[i] = rgb[i % 3];
    return shades;
  }

  resize() {
    const width = this.container.clientWidth, height = this.container.clientHeight;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    for (const material of this.lineMaterials) material.resolution.set(width, height);
    this.draw();
  }

  // At most once a frame of the display.
  draw() {
    if (this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.renderer.render(this.scene, this.camera);
    });
  }
};

// The coordinates that run to the right and up on a plan seen from above, for an up vector along an axis.
DeepUav.planAxes = function (up) {
  const axis = up.findIndex((value) => Math.abs(value) > 0.5);
  const following = [(axis + 1) % 3, (axis + 2) % 3];
  return up[axis] > 0 ? following : following.reverse();
};
