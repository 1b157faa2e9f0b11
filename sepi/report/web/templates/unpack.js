"use strict";

/* What sepi.report.web.packing packed: base64, deflate, residuals of the median edge predictor. */
const Sepi = {};

/** The element with this id. */
Sepi.byId = (id) => document.getElementById(id);

/** A new element with properties, and children (elements or text). */
Sepi.element = (name, properties = {}, ...children) => {
  const made = document.createElement(name);
  Object.assign(made, properties);
  made.append(...children);
  return made;
};

/** A name that may go on in the next line after _ and /. */
Sepi.breakable = (name) =>
  name.split(/(?<=[_/])/).flatMap((piece, i) => (i ? [Sepi.element("wbr"), piece] : [piece]));

Sepi.canvas = (width, height) => Sepi.element("canvas", { width, height });

/** JSON that stands in the page under this id. */
Sepi.json = (id) => JSON.parse(Sepi.byId(id).textContent);

Sepi.bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

Sepi.inflate = async (text) => {
  const stream = new Blob([Sepi.bytes(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

/** Class of a pixel whose neighbours differ by so many steps. */
Sepi.classOf = (activity) => (activity < 3 ? activity : Math.min(7, 33 - Math.clz32(activity - 1)));

/** A map as Float32Array, row after row; NaN is unknown. */
Sepi.unpackMap = async (array, width, height) => {
  const planes = await Sepi.inflate(array.data);
  const next = [...array.starts];
  const count = width * height;
  const levels = new Int32Array(count);
  const values = new Float32Array(count);
  for (let y = 0, i = 0; y < height; y++) {
    for (let x = 0; x < width; x++, i++) {
      const left = x ? levels[i - 1] : 0;
      const up = y ? levels[i - width] : 0;
      const corner = x && y ? levels[i - width - 1] : 0;
      const ahead = y && x + 1 < width ? levels[i - width + 1] : 0;
      const activity = Math.abs(left - corner) + Math.abs(up - corner) + Math.abs(up - ahead);
      const place = next[Sepi.classOf(activity)]++;
      const low = Math.min(left, up);
      const high = Math.max(left, up);
      const predicted = Math.max(low, Math.min(high, left + up - corner));
      const folded = planes[place] | (planes[place + count] << 8);
      levels[i] = (predicted + ((folded >> 1) ^ -(folded & 1))) & 0xffff;
      values[i] = levels[i] ? (levels[i] - 1 + array.base) * array.step : NaN;
    }
  }
  return values;
};

/** A mask as Uint8Array of 0 and 1. */
Sepi.unpackMask = async (array, width, height) => {
  const bytes = await Sepi.inflate(array.data);
  return Uint8Array.from({ length: width * height }, (_, i) => (bytes[i >> 3] >> (7 - (i & 7))) & 1);
};

/** Arrays of a scene, each unpacked once, when it is first asked for. */
Sepi.Arrays = class {
  constructor(scene) {
    this.scene = scene;
    this.unpacked = new Map();
  }

  get(number) {
    if (!this.unpacked.has(number)) {
      const { arrays, width, height } = this.scene;
      const array = arrays[number];
      const unpack = array.step === undefined ? Sepi.unpackMask : Sepi.unpackMap;
      this.unpacked.set(number, unpack(array, width, height));
    }
    return this.unpacked.get(number);
  }

  /** Decimals that tell the steps of an array apart. */
  decimals(number) {
    const { step } = this.scene.arrays[number];
    return step < 0.01 ? 3 : 2;
  }
};
