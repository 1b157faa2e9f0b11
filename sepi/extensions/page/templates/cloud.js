"use strict";

/* A coloured point cloud that can be turned: points, a depth buffer, no graphics card needed. */

Sepi.Cloud = class {
  /** @param {HTMLElement} root Holds the elements with data-part attributes that the page's template makes. */
  constructor(root) {
    this.root = root;
    this.canvas = this.part("cloud");
    this.pointers = new Map();
    this.part("cloud-map").addEventListener("change", () => this.load());
    this.part("cloud-colours").addEventListener("change", () => this.load());
    this.part("cloud-reset").addEventListener("click", () => this.reset());
    this.canvas.addEventListener("pointerdown", (event) => this.down(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      this.canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    }
    this.canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.canvas.addEventListener("dblclick", () => this.reset());
    new IntersectionObserver((entries) => entries.at(-1).isIntersecting && this.load()).observe(this.canvas);
    addEventListener("resize", () => this.request());
  }

  part(name) {
    return this.root.querySelector(`[data-part="${name}"]`);
  }

  /** Offer the maps of a scene; points are made when the canvas comes into sight. */
  show(panels) {
    this.panels = panels;
    this.points = null;
    this.loaded = null;
    const maps = panels.list.filter((panel) => panel.kind === "disparity");
    const select = this.part("cloud-map");
    const before = select.value;
    select.replaceChildren(...Sepi.options(maps));
    select.value = maps.some(({ key }) => key === before) ? before : panels.scene.first.b;
    const colours = this.part("cloud-colours");
    colours.options[0].disabled = !panels.scene.picture;
    if (!panels.scene.picture) colours.value = "disparity";
    this.reset();
    const box = this.canvas.getBoundingClientRect();
    if (box.top < innerHeight && box.bottom > 0) this.load();
  }

  reset() {
    this.angles = [0.35, 0.2];
    this.zoom = 1;
    this.request();
  }

  /** Make the points of the chosen map. */
  async load() {
    if (!this.panels) return;
    const key = this.part("cloud-map").value;
    const requested = `${key} ${this.part("cloud-colours").value}`;
    if (this.loaded === requested || !key) return;
    this.loaded = requested;
    const { panels } = this;
    const panel = panels.get(key);
    const disparity = await panels.values(panel);
    const picture = await panels.picture(this.part("cloud-colours").value === "view" ? "reference_view" : key);
    if (panels !== this.panels || this.loaded !== requested) return;
    const { width, height } = panels.scene;
    const image = picture.getContext("2d").getImageData(0, 0, width, height);
    this.points = Sepi.points(panels.scene, disparity, new Uint32Array(image.data.buffer));
    this.part("cloud-note").textContent = panels.scene.camera
      ? "Positions are metric: the camera is known."
      : "A relief: the camera is not known, depth is not to scale.";
    this.request();
  }

  down(event) {
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  move(event) {
    if (!this.pointers.has(event.pointerId)) return;
    const before = this.pointers.get(event.pointerId);
    const now = [event.clientX, event.clientY];
    if (this.pointers.size === 1) {
      this.rotate((now[0] - before[0]) / 150, (now[1] - before[1]) / 150);
    } else {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const distance = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) + 1;
      this.magnify(distance(now) / distance(before));
    }
    this.pointers.set(event.pointerId, now);
  }

  wheel(event) {
    // the page must still scroll past the picture
    if (!event.ctrlKey && document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.magnify(Math.exp(-event.deltaY / 500));
  }

  key(event) {
    const turn = { ArrowLeft: [-0.08, 0], ArrowRight: [0.08, 0], ArrowUp: [0, -0.08], ArrowDown: [0, 0.08] }[event.key];
    const zoom = { "+": 1.15, "=": 1.15, "-": 1 / 1.15 }[event.key];
    if (turn) this.rotate(...turn);
    else if (zoom) this.magnify(zoom);
    else if (event.key === "Home" || event.key === "0") this.reset();
    else return;
    event.preventDefault();
  }

  rotate(across, down) {
    this.angles = [this.angles[0] + across, Math.max(-1.5, Math.min(1.5, this.angles[1] + down))];
    this.request();
  }

  magnify(factor) {
    this.zoom = Math.max(0.3, Math.min(12, this.zoom * factor));
    this.request();
  }

  request() {
    this.pending ??= requestAnimationFrame(() => {
      this.pending = undefined;
      if (this.points) this.draw();
    });
  }

  draw() {
    const ratio = Math.min(devicePixelRatio, 1.5);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d");
    const image = context.createImageData(width, height);
    const drawn = Sepi.splat(this.points, new Uint32Array(image.data.buffer), width, height, this.angles, this.zoom);
    context.putImageData(image, 0, 0);
    this.canvas.dataset.points = drawn;
    this.canvas.dataset.angles = this.angles.map((angle) => angle.toFixed(2)).join(" ");
  }
};

/** Value below which a share of the finite values lies. */
Sepi.quantile = (values, share) => {
  const sorted = Float32Array.from(values).filter(Number.isFinite).sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
};

/** Points round the origin, about one unit large: x to the right, y down, z away. */
Sepi.points = (scene, disparity, colours) => {
  const { width, height, stride, camera } = scene;
  const count = width * height;
  const positions = new Float32Array(3 * count);
  const kept = new Uint32Array(count);
  const low = Sepi.quantile(disparity, 0.005);
  const high = Sepi.quantile(disparity, 0.995);
  const span = Math.max(high - low, 0.1);
  let n = 0;
  for (let i = 0; i < count; i++) {
    const d = disparity[i];
    // a few wrong pixels would make all else small
    if (!(d >= low - 0.1 * span && d <= high + 0.1 * span)) continue;
    const x = (i % width) - (width - 1) / 2;
    const y = Math.floor(i / width) - (height - 1) / 2;
    let place = [x, y, (-d * width) / 3 / span];
    if (camera) {
      const above = d + camera.offset;
      if (above <= 0) continue;
      const depth = camera.scale / above;
      const [down, across] = camera.from_centre;
      const ray = [stride * x - across * camera.offset, stride * y - down * camera.offset, camera.focal];
      place = ray.map((part) => (part * depth) / camera.focal);
    }
    positions.set(place, 3 * n);
    kept[n++] = colours[i];
  }
  return Sepi.centred(positions.subarray(0, 3 * n), kept.subarray(0, n));
};

Sepi.centred = (positions, colours) => {
  const n = colours.length;
  const middle = [0, 1, 2].map((axis) => Sepi.quantile(positions.filter((_, i) => i % 3 === axis), 0.5) ?? 0);
  for (let i = 0; i < positions.length; i++) positions[i] -= middle[i % 3];
  const size = Sepi.quantile(positions.map(Math.abs), 0.96) || 1;
  for (let i = 0; i < positions.length; i++) positions[i] /= size;
  return { positions, colours, n };
};

/** Draw points, nearer ones over more distant ones; returns how many lie in the picture. */
Sepi.splat = ({ positions, colours, n }, pixels, width, height, [yaw, pitch], zoom) => {
  const depth = new Float32Array(width * height).fill(Infinity);
  const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  const away = 3.2; // of the eye from the middle
  const focal = 0.42 * Math.min(width, height) * away * zoom;
  const spacing = (2.4 * focal) / Math.sqrt(n || 1); // of points at distance 1
  let drawn = 0;
  for (let i = 0; i < n; i++) {
    const x = positions[3 * i];
    const y = positions[3 * i + 1];
    const z = positions[3 * i + 2];
    const turned = -sy * x + cy * z;
    const far = away - sp * y + cp * turned;
    if (far < 0.1) continue;
    const size = Math.max(1, Math.min(40, Math.ceil(spacing / far)));
    const left = Math.round(width / 2 + (focal * (cy * x + sy * z)) / far - size / 2);
    const top = Math.round(height / 2 + (focal * (cp * y + sp * turned)) / far - size / 2);
    if (left < 0 || top < 0 || left + size > width || top + size > height) continue;
    drawn++;
    for (let row = 0; row < size; row++) {
      const start = (top + row) * width + left;
      for (let p = start; p < start + size; p++) {
        if (far < depth[p]) {
          depth[p] = far;
          pixels[p] = colours[i] | 0xff000000;
        }
      }
    }
  }
  return drawn;
};
