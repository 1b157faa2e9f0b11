"use strict";

/* Pictures of panels: colours for values, masks over the reference view. */

Sepi.UNKNOWN = [255, 0, 255]; // magenta is in none of the scales

/** Whether a panel is drawn over the reference view, and has no numbers. */
Sepi.overView = ({ kind }) => ["picture", "mask", "outline"].includes(kind);

/** Scales of 256 colours, [r, g, b, r, ...], by name. */
Sepi.scales = () => {
  Sepi.knownScales ??= Object.fromEntries(
    Object.entries(Sepi.json("colour-scales")).map(([name, text]) => [name, Sepi.bytes(text)]),
  );
  return Sepi.knownScales;
};

/** Panels of a scene; values and pictures are made when they are asked for, once. */
Sepi.Panels = class {
  constructor(scene) {
    this.scene = scene;
    this.list = scene.panels;
    this.arrays = [];
    this.drawn = {};
    this.groundTruth = this.get("ground_truth");
  }

  get(key) {
    return this.list.find((panel) => panel.key === key);
  }

  /** An array of the scene, unpacked once, when it is first asked for. */
  array(number) {
    this.arrays[number] ??= Sepi.unpack(this.scene.arrays[number], this.scene.width);
    return this.arrays[number];
  }

  /** Decimals that tell the steps of an array apart. */
  decimals(number) {
    return this.scene.arrays[number].step < 0.01 ? 3 : 2;
  }

  /** Colour scale of a panel, and the values at its ends. */
  scale(panel) {
    const limit = this.scene.error_limit;
    if (panel.kind === "error" || panel.kind === "change") return ["error", -limit, limit];
    if (panel.kind === "sigma") return ["grey", ...this.scene.sigma_limits];
    if (panel.kind === "confidence" || panel.kind === "grey") return ["grey", 0, 1];
    return ["disparity", ...this.scene.limits];
  }

  /** Numbers that a panel shows, as an array over the pixels; null for pictures and masks. Those of a standard
   * deviation are logarithms. */
  async values(panel) {
    if (Sepi.overView(panel)) return null;
    const map = await this.array(panel.map);
    if (panel.minus === undefined) return map;
    const other = await this.array(panel.minus);
    if (panel.kind !== "change") return map.map((value, i) => value - other[i]);
    const groundTruth = await this.array(panel.ground_truth);
    return map.map((value, i) => Math.abs(value - groundTruth[i]) - Math.abs(other[i] - groundTruth[i]));
  }

  /** The panel as a canvas of the maps' size. */
  picture(key) {
    this.drawn[key] ??= this.draw(this.get(key));
    return this.drawn[key];
  }

  async draw(panel) {
    const { width, height } = this.scene;
    const canvas = Sepi.canvas(width, height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    const overView = Sepi.overView(panel);
    if (overView && this.scene.picture) context.drawImage(await this.view(), 0, 0);
    if (panel.kind === "picture") return canvas;
    const image = context.getImageData(0, 0, width, height);
    if (overView) this.overlay(image.data, await this.array(panel.map), panel.kind);
    else this.colour(image.data, await this.values(panel), ...this.scale(panel));
    context.putImageData(image, 0, 0);
    return canvas;
  }

  /** The reference view as a decoded image. */
  async view() {
    this.image ??= Sepi.element("img", { src: this.scene.picture });
    await this.image.decode();
    return this.image;
  }

  colour(data, values, name, low, high) {
    const scale = Sepi.scales()[name];
    const factor = 255 / (high - low || 1);
    for (let i = 0, j = 0; i < values.length; i++, j += 4) {
      const value = values[i];
      const level = Math.max(0, Math.min(255, Math.round((value - low) * factor)));
      for (let c = 0; c < 3; c++) data[j + c] = Number.isNaN(value) ? Sepi.UNKNOWN[c] : scale[3 * level + c];
      data[j + 3] = 255;
    }
  }

  overlay(data, mask, kind) {
    const colour = kind === "mask" ? [255, 64, 32] : [255, 220, 0];
    for (let i = 0, j = 0; i < mask.length; i++, j += 4) {
      for (let c = 0; c < 3; c++) {
        if (kind === "outline") data[j + c] = mask[i] ? colour[c] : data[j + c];
        else data[j + c] = mask[i] ? data[j + c] / 4 + colour[c] / 2 + 32 : data[j + c] / 2;
      }
      data[j + 3] = 255;
    }
  }
};

/** A legend of a panel's colours, with the values at its ends. */
Sepi.legend = (panels, panel) => {
  if (Sepi.overView(panel)) return Sepi.element("span", { className: "legend" });
  const [name, low, high] = panels.scale(panel);
  const scale = Sepi.scales()[name];
  const stops = Array.from({ length: 17 }, (_, i) => {
    const k = 3 * Math.round((255 * i) / 16);
    return `rgb(${scale[k]} ${scale[k + 1]} ${scale[k + 2]})`;
  });
  const bar = Sepi.element("span", { className: "bar" });
  bar.style.background = `linear-gradient(to right, ${stops.join(",")})`;
  const words = panel.ends ?? {
    disparity: ["far", "near"],
    error: ["too far", "too near"],
    change: ["degraded", "improved"],
    confidence: ["low", "high"],
    sigma: ["sure", "unsure"],
    grey: ["low", "high"],
  }[panel.kind];
  const [first, last] = [low, high].map((end) => (panel.kind === "sigma" ? `${10 ** end}` : end.toFixed(2)));
  return Sepi.element("span", { className: "legend" }, `${words[0]} ${first} `, bar, ` ${last} ${words[1]}`);
};
