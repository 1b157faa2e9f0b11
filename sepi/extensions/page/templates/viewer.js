"use strict";

/* The maps of a scene: a slider to wipe between any two, the numbers under the cursor, close-ups in every panel. */

/** Half the side of a close-up in pixels of the maps. */
Sepi.REACH = 20;

Sepi.Viewer = class {
  /**
   * @param {HTMLElement} root Holds the elements with data-part attributes that the page's template makes.
   * @param {(x: number, y: number) => void} chosen Called with the pixel of a click, in pixels of the maps.
   */
  constructor(root, chosen = () => {}) {
    this.root = root;
    this.chosen = chosen;
    this.cursor = null;
    this.turn = 0; // of show(): what an earlier scene began is dropped
    this.wipe = this.part("wipe");
    this.slider = this.part("slider");
    this.visible = new Set();
    this.watcher = new IntersectionObserver((entries) => this.seen(entries), { rootMargin: "200px" });
    this.slider.addEventListener("input", () => this.drawWipe());
    for (const side of ["a", "b"]) this.part(side).addEventListener("change", () => this.select());
    this.part("swap").addEventListener("click", () => this.choose({ a: this.key("b"), b: this.key("a") }));
    this.part("close-ups").addEventListener("change", () => this.drawGrid());
    this.follow(this.wipe, true);
    addEventListener("resize", () => this.drawGrid());
  }

  part(name) {
    return this.root.querySelector(`[data-part="${name}"]`);
  }

  /** Show a scene. */
  async show(scene) {
    this.turn += 1;
    this.scene = scene;
    this.shown = null;
    this.panels = new Sepi.Panels(scene);
    this.cursor = null;
    this.root.style.setProperty("--ratio", scene.width / scene.height);
    this.wipe.width = scene.width;
    this.wipe.height = scene.height;
    this.fillSelects();
    this.fillGrid();
    this.mark(scene.probes);
    await this.select();
  }

  /** Show where the prepared pixels are. */
  mark(probes) {
    const { width, height, stride } = this.scene;
    const marks = probes.map(({ x, y, label }, number) => {
      const mark = Sepi.element("span", { className: "mark", title: label }, `${number + 1}`);
      mark.style.left = `${(100 * (x / stride + 0.5)) / width}%`;
      mark.style.top = `${(100 * (y / stride + 0.5)) / height}%`;
      return mark;
    });
    this.part("marks").replaceChildren(...marks);
  }

  /** Show which of the prepared pixels is looked into. */
  markChosen(number) {
    [...this.part("marks").children].forEach((mark, i) => mark.classList.toggle("chosen", i === number));
    const label = this.scene?.probes[number]?.label;
    const link = this.part("chosen");
    if (link && label) link.textContent = `what the method sees at pixel ${number + 1}, ${label}`;
  }

  fillSelects() {
    const { list } = this.panels;
    for (const side of ["a", "b"]) {
      const before = this.part(side).value;
      this.part(side).replaceChildren(...Sepi.options(list));
      this.part(side).value = this.panels.get(before) ? before : this.scene.first[side];
    }
  }

  key(side) {
    return this.part(side).value;
  }

  choose(keys) {
    for (const [side, key] of Object.entries(keys)) this.part(side).value = key;
    return this.select();
  }

  async select() {
    const turn = this.turn;
    const keys = { a: this.key("a"), b: this.key("b") };
    const shown = {};
    for (const side of ["a", "b"]) {
      const panel = this.panels.get(keys[side]);
      shown[side] = { panel, picture: await this.panels.picture(panel.key), values: await this.panels.values(panel) };
      for (const name of ["confidence", "sigma", "below", "above"]) {
        if (panel[name] !== undefined) shown[side][name] = await this.panels.array(panel[name]);
      }
    }
    const groundTruth = this.panels.groundTruth && (await this.panels.array(this.panels.groundTruth.map));
    if (turn !== this.turn || keys.a !== this.key("a") || keys.b !== this.key("b")) return;
    this.shown = shown;
    this.groundTruth = groundTruth;
    this.part("legends").replaceChildren(
      ...["a", "b"].map((side) =>
        Sepi.element(
          "div",
          {},
          Sepi.element("b", {}, side.toUpperCase()),
          ` ${shown[side].panel.title} `,
          Sepi.legend(this.panels, shown[side].panel),
          Sepi.element("small", {}, this.small(shown[side].panel)),
        ),
      ),
    );
    this.drawWipe();
    this.readOut();
    this.root.dataset.shown = `${keys.a} ${keys.b}`;
  }

  /** What is to be said of a panel: its scores, and how finely the page holds it. */
  small(panel) {
    const steps =
      Sepi.overView(panel) || panel.kind === "sigma" ? "" : `held in steps of ${this.scene.arrays[panel.map].step}`;
    return [panel.note, steps].filter(Boolean).join("; ");
  }

  drawWipe() {
    if (!this.shown) return;
    const { width, height } = this.scene;
    const context = this.wipe.getContext("2d");
    const border = Math.round((this.slider.value / 1000) * width);
    context.drawImage(this.shown.a.picture, 0, 0);
    if (border < width) {
      context.drawImage(this.shown.b.picture, border, 0, width - border, height, border, 0, width - border, height);
    }
    this.part("line").style.left = `${this.slider.value / 10}%`;
    this.slider.setAttribute("aria-valuetext", `${Math.round(this.slider.value / 10)} % of A`);
    this.drawCloseUps();
  }

  /** The pixel of the maps that is nearest to a position. */
  inside(x, y) {
    const { width, height } = this.scene;
    return [Math.max(0, Math.min(width - 1, x)), Math.max(0, Math.min(height - 1, y))];
  }

  /** Pixels of the maps under a pointer over an element that shows all of them. */
  pixel(element, event) {
    const box = element.getBoundingClientRect();
    const { width, height } = this.scene;
    return this.inside(
      Math.floor(((event.clientX - box.left) / box.width) * width),
      Math.floor(((event.clientY - box.top) / box.height) * height),
    );
  }

  /** Let the cursor follow the pointer over an element; a drag over the large picture moves the slider. */
  follow(element, wipes = false) {
    let start = null;
    const moved = (event) => this.moveTo(...this.pixel(element, event));
    element.addEventListener("pointerdown", (event) => {
      start = event.clientX;
      moved(event);
    });
    element.addEventListener("pointermove", (event) => {
      if (wipes && event.buttons && start !== null && Math.abs(event.clientX - start) > 3) {
        const box = element.getBoundingClientRect();
        this.slider.value = Math.round((1000 * (event.clientX - box.left)) / box.width);
        this.drawWipe();
        start = -1e9; // a drag, however short the rest of it
      }
      moved(event);
    });
    element.addEventListener("click", (event) => {
      if (start !== -1e9) this.chosen(...this.pixel(element, event));
    });
    if (!wipes) return;
    element.addEventListener("keydown", (event) => {
      const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      const [x, y] = this.cursor ?? [this.scene.width >> 1, this.scene.height >> 1];
      if (move) {
        const far = event.shiftKey ? 10 : 1;
        this.moveTo(...this.inside(x + far * move[0], y + far * move[1]));
      } else if (event.key === "Enter") this.chosen(x, y);
      else return;
      event.preventDefault();
    });
  }

  moveTo(x, y) {
    this.cursor = [x, y];
    this.pending ??= requestAnimationFrame(() => {
      this.pending = undefined;
      if (!this.shown) return;
      this.readOut();
      this.drawCloseUps();
      this.drawGrid();
    });
  }

  /** Numbers under the cursor. */
  readOut() {
    if (!this.shown) return;
    const { cursor, panels, scene } = this;
    const show = (name, values, array) => {
      const value = cursor && values ? values[cursor[1] * scene.width + cursor[0]] : undefined;
      const known = Number.isNaN(value) ? "unknown" : value?.toFixed(panels.decimals(array));
      this.part(name).textContent = known ?? "–";
    };
    show("ground_truth", this.groundTruth, panels.groundTruth?.map);
    for (const side of ["a", "b"]) {
      const { panel, values, confidence } = this.shown[side];
      if (panel.kind === "sigma") this.part(`value-${side}`).textContent = this.spread(values);
      else show(`value-${side}`, values, panel.map);
      this.readOutBars(side);
      const compares = cursor && panel.kind === "disparity" && this.groundTruth && panel !== panels.groundTruth;
      show(`error-${side}`, compares && this.errors(side), panel.map);
      show(`confidence-${side}`, confidence, panel.confidence);
    }
    const marker = this.part("marker");
    marker.hidden = !cursor;
    const position = cursor?.map((place) => place * scene.stride);
    this.part("pixel").textContent = position ? `x ${position[0]}, y ${position[1]}` : "move over a map";
    if (!cursor) return;
    marker.style.left = `${(100 * (this.cursor[0] + 0.5)) / this.scene.width}%`;
    marker.style.top = `${(100 * (this.cursor[1] + 0.5)) / this.scene.height}%`;
  }

  /** The pixel under the cursor of a map of logarithms, as the number itself. */
  spread(logarithms) {
    const value = this.cursor && logarithms?.[this.cursor[1] * this.scene.width + this.cursor[0]];
    return Number.isNaN(value) ? "unknown" : Number.isFinite(value) ? `${Number((10 ** value).toPrecision(2))}` : "–";
  }

  /** Standard deviation and interval of what a side shows; a disparity that has none says so. */
  readOutBars(side) {
    const { panel, values, sigma, below, above } = this.shown[side];
    const estimate = this.cursor && panel.kind === "disparity" && panel !== this.panels.groundTruth;
    let interval = estimate && !sigma ? (panel.no_interval ?? "no interval") : "–";
    this.part(`sigma-${side}`).textContent = sigma ? this.spread(sigma) : "–";
    if (sigma && this.cursor) {
      const place = this.cursor[1] * this.scene.width + this.cursor[0];
      const reach = (sigmas) => 10 ** (sigma[place] + sigmas[place]);
      const ends = [values[place] - reach(below), values[place] + reach(above)];
      interval = ends.some(Number.isNaN) ? "unknown" : ends.map((end) => end.toFixed(3)).join(" … ");
    }
    this.part(`interval-${side}`).textContent = interval;
  }

  /** Errors of what a side shows, made when they are first read out. */
  errors(side) {
    const shown = this.shown[side];
    shown.errors ??= shown.values.map((value, i) => value - this.groundTruth[i]);
    return shown.errors;
  }

  /** The surroundings of the cursor in A and B, magnified. */
  drawCloseUps() {
    for (const side of ["a", "b"]) {
      const canvas = this.part(`close-${side}`);
      const context = canvas.getContext("2d");
      context.imageSmoothingEnabled = false;
      this.magnify(context, this.shown[side].picture, 0, 0, canvas.width);
    }
  }

  magnify(context, picture, left, top, side) {
    const span = 2 * Sepi.REACH + 1;
    // before anything is pointed at, the middle
    const middle = [this.scene.width >> 1, this.scene.height >> 1];
    const [x, y] = (this.cursor ?? middle).map((place) => place - Sepi.REACH);
    const pixel = side / span;
    context.fillStyle = "#808080";
    context.fillRect(left, top, side, side);
    context.save();
    context.beginPath();
    context.rect(left, top, side, side);
    context.clip();
    context.drawImage(picture, left - x * pixel, top - y * pixel, picture.width * pixel, picture.height * pixel);
    context.restore();
    context.strokeStyle = "#fff";
    context.lineWidth = 1;
    context.strokeRect(left + Sepi.REACH * pixel, top + Sepi.REACH * pixel, pixel, pixel);
  }

  /** One small panel for each, under the headings of their groups. */
  fillGrid() {
    this.watcher.disconnect();
    this.visible.clear();
    this.tiles = new Map();
    const tiles = (panels) => Sepi.element("div", { className: "tiles" }, ...panels.map((panel) => this.tile(panel)));
    const changes = Sepi.byId("changes");
    const elsewhere = changes ? this.panels.list.filter(({ kind }) => kind === "change") : [];
    changes?.replaceChildren(tiles(elsewhere));
    const groups = Sepi.grouped(this.panels.list.filter((panel) => !elsewhere.includes(panel)));
    const problems = Object.entries(this.scene.problems ?? {}).map(([method, why]) => `${method}: ${why}`);
    this.part("grid").replaceChildren(
      ...groups.map(([title, panels]) => Sepi.element("section", {}, Sepi.element("h4", {}, title), tiles(panels))),
      Sepi.element("p", { className: "soft" }, problems.length ? `Not available: ${problems.join("; ")}.` : ""),
    );
  }

  tile(panel) {
    const canvas = Sepi.canvas(10, 10);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${panel.title}${panel.note ? `: ${panel.note}` : ""}`);
    canvas.style.aspectRatio = `${this.scene.width} / ${this.scene.height}`;
    const buttons = ["a", "b"].map((side) => {
      const name = side.toUpperCase();
      const button = Sepi.element("button", { type: "button", title: `show as ${name}` }, name);
      button.setAttribute("aria-label", `show ${panel.title} as ${name}`);
      button.addEventListener("click", () => this.choose({ [side]: panel.key }));
      return button;
    });
    const figure = Sepi.figure(
      canvas,
      Sepi.element("span", { className: "pair" }, ...buttons),
      ...Sepi.breakable(panel.title),
      Sepi.element("small", {}, panel.note ?? ""),
    );
    figure.dataset.key = panel.key;
    this.follow(canvas);
    this.tiles.set(canvas, panel.key);
    this.watcher.observe(canvas);
    return figure;
  }

  seen(entries) {
    for (const { target, isIntersecting } of entries) {
      if (isIntersecting) this.visible.add(target);
      else this.visible.delete(target);
    }
    this.drawGrid();
  }

  drawGrid() {
    for (const canvas of this.visible) this.drawTile(canvas);
  }

  async drawTile(canvas) {
    const key = this.tiles.get(canvas);
    if (!key) return;
    const turn = this.turn;
    const picture = await this.panels.picture(key);
    if (turn !== this.turn) return;
    const width = Math.round(canvas.clientWidth * devicePixelRatio);
    const height = Math.round(canvas.clientHeight * devicePixelRatio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = width < picture.width;
    context.drawImage(picture, 0, 0, width, height);
    if (!this.cursor) return;
    this.drawCursor(context, width, height, picture);
  }

  /** The cursor in a small panel, and its close-up in the more distant corner. */
  drawCursor(context, width, height, picture) {
    const [x, y] = [
      ((this.cursor[0] + 0.5) * width) / this.scene.width,
      ((this.cursor[1] + 0.5) * height) / this.scene.height,
    ];
    const half = (Sepi.REACH * width) / this.scene.width;
    for (const [colour, wider] of [["#000", 1], ["#fff", 0]]) {
      context.lineWidth = devicePixelRatio;
      context.strokeStyle = colour;
      context.strokeRect(x - half - wider, y - half - wider, 2 * (half + wider), 2 * (half + wider));
    }
    if (!this.part("close-ups").checked) return;
    const side = Math.round(0.46 * Math.min(width, height));
    const left = x < width / 2 ? width - side : 0;
    this.magnify(context, picture, left, height - side, side);
    for (const [colour, inset] of [["#000", 0.5], ["#fff", 1.5]]) {
      context.strokeStyle = colour;
      context.lineWidth = 1;
      context.strokeRect(left + inset, height - side + inset, side - 2 * inset, side - 2 * inset);
    }
  }
};

/** Panels under the headings of their groups, in order. */
Sepi.grouped = (list) => {
  const groups = new Map(list.map(({ group }) => [group, []]));
  for (const panel of list) groups.get(panel.group).push(panel);
  return [...groups];
};

/** Options of a select, under the headings of their groups. */
Sepi.options = (list) =>
  Sepi.grouped(list).map(([label, panels]) =>
    Sepi.element("optgroup", { label }, ...panels.map(({ key, title }) => Sepi.element("option", { value: key }, title))),
  );
