"use strict";

/* What the method sees at a pixel: its stitched EPIs, its cost curves, the views that are kept. */

/** Columns of a SEPI picture. */
Sepi.SEPI_WIDTH = 49;

// Okabe and Ito's colours, told apart by every kind of eye
Sepi.CURVES = { left: "#e69f00", right: "#56b4e9", up: "#009e73", down: "#d55e00" };

Sepi.Pixels = class {
  /** @param {HTMLElement} root Holds the elements with data-part attributes that the page's template makes. */
  constructor(root) {
    this.root = root;
    this.selected = () => {};
  }

  part(name) {
    return this.root.querySelector(`[data-part="${name}"]`);
  }

  /** Offer the pixels of a scene. */
  show(scene) {
    this.scene = scene;
    this.probes = scene.probes ?? [];
    this.root.hidden = this.probes.length === 0;
    const buttons = this.probes.map((probe, number) => {
      const button = Sepi.element("button", { type: "button" }, `${number + 1} ${probe.label}`);
      button.addEventListener("click", () => this.select(number));
      return button;
    });
    this.part("pixels").replaceChildren(...buttons);
    if (this.probes.length) this.select(0);
  }

  /** Show the prepared pixel that is nearest to a pixel of the maps. */
  nearest(x, y) {
    if (!this.probes.length) return;
    const { stride } = this.scene;
    const distance = (probe) => Math.hypot(probe.x - stride * x, probe.y - stride * y);
    const distances = this.probes.map(distance);
    const number = distances.indexOf(Math.min(...distances));
    this.select(number);
    if (distances[number] < stride) return;
    const asked = `${this.scene.dataset}/${this.scene.scene}: [[${stride * y}, ${stride * x}]]`;
    this.part("asked").textContent =
      `You clicked x ${stride * x}, y ${stride * y}; the nearest prepared pixel is shown. ` +
      `To have that one: config.yaml, report, pixels: {${asked}}`;
  }

  select(number) {
    const probe = this.probes[number];
    this.part("asked").textContent = "";
    [...this.part("pixels").children].forEach((button, i) => button.setAttribute("aria-pressed", i === number));
    const value = (d) => (d === null || d === undefined ? "unknown" : d.toFixed(3));
    const occlusion = `${probe.occluded ? "occluded" : "not occluded"}; kept: ${Sepi.subset(probe.kept_subset)}`;
    const facts = {
      pixel: `x ${probe.x}, y ${probe.y} ([${probe.y}, ${probe.x}] in the configuration)`,
      "chosen by paper": value(probe.chosen),
      "chosen by best": value(probe.best),
      "lowest cost": `${value(probe.minimum)} (all views); lowest of all subsets: ${Sepi.subset(probe.best_subset)}`,
      "ground truth": value(probe.ground_truth),
      confidence: value(probe.confidence),
      occlusion: `${occlusion}${probe.textureless ? "; textureless" : ""}`,
    };
    this.part("facts").replaceChildren(
      ...Object.entries(facts).flatMap(([name, text]) => [
        Sepi.element("dt", {}, name),
        Sepi.element("dd", {}, text),
      ]),
    );
    this.part("sepis").replaceChildren(...this.pictures(probe));
    this.part("curves").replaceChildren(Sepi.curves(probe));
    this.root.dataset.pixel = `${probe.x} ${probe.y}`;
    this.number = number;
    this.selected(number);
  }

  pictures(probe) {
    const [rows, columns] = this.scene.grid;
    // known before they are decoded, so that nothing below jumps
    const size = { width: Sepi.SEPI_WIDTH, height: rows * columns };
    const names = {
      minimum: "SEPI at the lowest cost",
      chosen: "SEPI at the chosen candidate",
      ground_truth: "SEPI at the ground truth",
      wrong: "SEPI at the worst candidate",
    };
    const shown = Object.keys(names).filter((name) => name in probe.sepi);
    const figures = shown.map((name) => {
      const { disparity, src } = probe.sepi[name];
      const title = `${names[name]}: ${disparity.toFixed(3)}`;
      const picture = Sepi.element("img", { src, alt: title, ...size });
      return Sepi.figure(Sepi.element("div", { className: "sepi" }, picture), title);
    });
    const alt = "the pixel in every view at the chosen candidate";
    const patch = Sepi.element("img", { src: probe.patch, alt, className: "patch" });
    return [...figures, Sepi.figure(patch, "the pixel in every view"), this.keptViews(probe)];
  }

  /** The view grid, with the views that the half-SEPI keeps. */
  keptViews(probe) {
    const [rows, columns] = this.scene.grid;
    const cells = Array.from({ length: rows * columns }, (_, i) =>
      Sepi.shape("rect", {
        x: (i % columns) + 0.1,
        y: Math.floor(i / columns) + 0.1,
        width: 0.8,
        height: 0.8,
        class: probe.kept[i] === "1" ? "kept" : "left-out",
      }),
    );
    const words = `views kept: ${Sepi.subset(probe.kept_subset)}`;
    const box = { viewBox: `0 0 ${columns} ${rows}`, class: "views", role: "img", "aria-label": words };
    return Sepi.figure(Sepi.shape("svg", box, ...cells), words);
  }
};

/** A subset of the views in words. */
Sepi.subset = (name) => (name === "full" ? "all views" : `${name} ${name.includes("-") ? "quarter" : "half"}`);

Sepi.shape = (name, attributes = {}, ...children) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};

/** Cost over the candidates, of all views and of the halves and quarters of the view grid. */
Sepi.curves = (probe) => {
  // letters keep their size on a phone
  const width = matchMedia("(max-width: 800px)").matches ? 380 : 620;
  const [height, left, bottom, top] = [300, 44, 40, 38];
  const costs = Object.fromEntries(
    Object.entries(probe.costs).map(([name, text]) => [name, new Uint16Array(Sepi.bytes(text).buffer)]),
  );
  const highest = Math.max(0.02, ...Object.values(costs).map((curve) => Math.max(...curve) / 65535));
  const [low, high] = probe.range;
  const across = (d) => left + ((d - low) / (high - low || 1)) * (width - left - 20);
  const up = (cost) => height - bottom - (cost / highest) * (height - bottom - top);
  const lines = Object.entries(costs)
    .sort(([one], [other]) => (one === "full") - (other === "full"))
    .map(([name, curve]) => {
      const last = curve.length - 1;
      const points = Array.from(curve, (cost, k) => {
        const d = low + ((high - low) * k) / last;
        return `${across(d).toFixed(1)},${up(cost / 65535).toFixed(1)}`;
      });
      const line = Sepi.shape("polyline", { points: points.join(" "), class: name === "full" ? "full" : "part" });
      if (Sepi.CURVES[name]) line.setAttribute("style", `stroke: ${Sepi.CURVES[name]}; stroke-width: 1.6`);
      line.append(Sepi.shape("title", {}, name));
      return line;
    });
  return Sepi.element(
    "div",
    {},
    Sepi.shape(
      "svg",
      { viewBox: `0 0 ${width} ${height}`, class: "chart", role: "img", "aria-label": "cost over the candidates" },
      ...Sepi.chartAxes(width, height, left, bottom, top, [low, high], highest),
      ...lines,
      ...Sepi.chartMarks(probe, across, up, top, height - bottom),
    ),
    Sepi.curveKey(),
  );
};

Sepi.chartAxes = (width, height, left, bottom, top, [low, high], highest) => {
  const base = height - bottom;
  const text = (x, y, words, anchor = "middle") => Sepi.shape("text", { x, y, "text-anchor": anchor }, words);
  const ticks = [0, 0.25, 0.5, 0.75, 1].flatMap((share) => {
    const x = left + share * (width - left - 20);
    return [
      Sepi.shape("path", { d: `M${x},${base}v4`, class: "axis" }),
      text(x, base + 17, (low + share * (high - low)).toFixed(2)),
    ];
  });
  return [
    Sepi.shape("path", { d: `M${left},${top}V${base}H${width - 20}`, class: "axis" }),
    ...ticks,
    text((left + width) / 2, height - 4, "candidate disparity, pixels per view step"),
    text(left - 6, base + 4, "0", "end"),
    text(left - 6, top + 8, highest.toFixed(2), "end"),
    Sepi.shape("text", { transform: `translate(12 ${(base + top) / 2}) rotate(-90)`, "text-anchor": "middle" }, "cost"),
  ];
};

Sepi.chartMarks = (probe, across, up, top, base) => {
  const marks = { ground_truth: probe.ground_truth, paper: probe.chosen, best: probe.best };
  return Object.entries(marks)
    .filter(([, d]) => d !== null && d !== undefined)
    .flatMap(([name, d], i) => [
      Sepi.shape("path", { d: `M${across(d)},${top}V${base}`, class: `mark ${name}` }),
      Sepi.shape("text", { x: across(d) + 3, y: top - 14 + 11 * i, class: `mark ${name}` }, name.replace("_", " ")),
    ]);
};

Sepi.curveKey = () =>
  Sepi.element(
    "p",
    { className: "key" },
    ...[["all views", "currentColor"], ...Object.entries(Sepi.CURVES), ["quarters", "gray"]].map(([name, colour]) => {
      const line = Sepi.element("i");
      line.style.background = colour;
      return Sepi.element("span", {}, line, ` ${name} `);
    }),
  );
