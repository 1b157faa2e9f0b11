"use strict";

/* What sepi.extensions.page.viewer packed: base64, deflate, differences to the row above. */
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

Sepi.figure = (content, ...caption) =>
  Sepi.element("figure", {}, content, Sepi.element("figcaption", {}, ...caption));

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

/** A map as Float32Array, row after row; NaN is unknown. A mask is a map of 0 and 1. */
Sepi.unpack = async ({ step, base, data }, width) => {
  const planes = await Sepi.inflate(data);
  const count = planes.length / 2;
  const levels = new Uint16Array(count); // sums wrap as the differences did
  const values = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    const folded = planes[i] | (planes[i + count] << 8);
    levels[i] = (i < width ? 0 : levels[i - width]) + ((folded >> 1) ^ -(folded & 1));
    values[i] = levels[i] ? (levels[i] - 1 + base) * step : NaN;
  }
  return values;
};
