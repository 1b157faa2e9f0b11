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
    const buttons = this.probes.map(({ label }, number) => {
      const properties = { type: "button", onclick: () => this.select(number) };
      return Sepi.element("button", properties, `${number + 1} ${label}`);
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
    const value = (d) => d?.toFixed(3) ?? "unknown";
    const occlusion = `${probe.occluded ? "occluded" : "not occluded"}; kept: ${Sepi.subset(probe.kept_subset)}`;
    const facts = {
      pixel: `x ${probe.x}, y ${probe.y} ([${probe.y}, ${probe.x}] in the configuration)`,
      "chosen by paper": value(probe.chosen),
      "chosen by best": value(probe.best),
      "90 % interval of best": probe.interval?.map(value).join(" … ") ?? "none",
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
  const [left, right, top, base, height] = [44, width - 20, 38, 260, 300];
  const costs = Object.entries(probe.costs).map(([name, text]) => [name, new Uint16Array(Sepi.bytes(text).buffer)]);
  const highest = Math.max(0.02, ...costs.map(([, curve]) => Math.max(...curve) / 65535));
  const [low, high] = probe.range;
  const at = (share) => low + share * (high - low);
  const across = (d) => left + ((d - low) / (high - low || 1)) * (right - left);
  const up = (cost) => base - (cost / highest) * (base - top);
  const path = (d, name) => Sepi.shape("path", { d, class: name });
  const text = (place, words) => Sepi.shape("text", { "text-anchor": "middle", ...place }, words);
  const axes = [
    path(`M${left},${top}V${base}H${right}`, "axis"),
    ...[0, 0.25, 0.5, 0.75, 1].map(at).flatMap((d) => [
      path(`M${across(d)},${base}v4`, "axis"),
      text({ x: across(d), y: base + 17 }, d.toFixed(2)),
    ]),
    text({ x: (left + width) / 2, y: height - 4 }, "candidate disparity, pixels per view step"),
    text({ x: left - 6, y: base + 4, "text-anchor": "end" }, "0"),
    text({ x: left - 6, y: top + 8, "text-anchor": "end" }, highest.toFixed(2)),
    text({ transform: `translate(12 ${(base + top) / 2}) rotate(-90)` }, "cost"),
  ];
  // what lies beyond the candidates is not drawn
  const ends = (probe.interval ?? []).map((d) => across(Math.max(low, Math.min(high, d ?? NaN))));
  const band = ends.every(Number.isFinite) && ends.length ? [ends] : [];
  const bands = band.map(([from, to]) =>
    Sepi.shape("rect", { x: from, y: top, width: Math.max(1, to - from), height: base - top, class: "interval" }),
  );
  // that of all views upon the others
  costs.sort(([one], [other]) => (one === "full") - (other === "full"));
  const lines = costs.map(([name, curve]) => {
    const point = (cost, k) => `${across(at(k / (curve.length - 1))).toFixed(1)},${up(cost / 65535).toFixed(1)}`;
    const style = Sepi.CURVES[name] ? `stroke: ${Sepi.CURVES[name]}; stroke-width: 1.6` : "";
    const looks = { points: Array.from(curve, point).join(" "), class: name === "full" ? "full" : "part", style };
    return Sepi.shape("polyline", looks, Sepi.shape("title", {}, name));
  });
  const marks = Object.entries({ ground_truth: probe.ground_truth, paper: probe.chosen, best: probe.best })
    .filter(([, d]) => d !== null)
    .flatMap(([name, d], i) => [
      path(`M${across(d)},${top}V${base}`, `mark ${name}`),
      Sepi.shape("text", { x: across(d) + 3, y: top - 14 + 11 * i, class: `mark ${name}` }, name.replace("_", " ")),
    ]);
  const box = { viewBox: `0 0 ${width} ${height}`, class: "chart", role: "img", "aria-label": "cost over the candidates" };
  const key = { "all views": "currentColor", ...Sepi.CURVES, quarters: "gray" };
  const words = Object.entries(key).map(([name, colour]) => {
    const line = Sepi.element("i");
    line.style.background = colour;
    return Sepi.element("span", {}, line, ` ${name} `);
  });
  return Sepi.element(
    "div",
    {},
    Sepi.shape("svg", box, ...bands, ...axes, ...lines, ...marks),
    Sepi.element("p", { className: "key" }, ...words),
  );
};
