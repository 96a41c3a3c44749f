"use strict";

// What the page was told, and the bytes of pictures and maps, inflated when they are first looked at.

const report = JSON.parse(document.getElementById("report").textContent);

async function inflate(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const inflated = new Map();

/** Promise of the bytes of a blob. */
function blob(id) {
  if (!inflated.has(id)) {
    inflated.set(id, inflate(document.getElementById(`blob${id}`).textContent));
  }
  return inflated.get(id);
}

/** The value of each of the 65536 half floats. */
const HALF_VALUES = Float32Array.from({ length: 65536 }, (_, bits) => {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const mantissa = bits & 1023;
  if (exponent === 0) return sign * mantissa * 2 ** -24;
  if (exponent === 31) return mantissa ? NaN : sign * Infinity;
  return sign * (1 + mantissa / 1024) * 2 ** (exponent - 15);
});

const decoded = new Map();

/** Promise of a picture's linear numbers, three a pixel. Stored are all low bytes, then all high ones. */
function pixels(id) {
  if (!decoded.has(id)) {
    const decode = (bytes) => {
      const count = bytes.length / 2;
      return Float32Array.from({ length: count }, (_, i) => HALF_VALUES[bytes[i] | (bytes[count + i] << 8)]);
    };
    decoded.set(id, blob(id).then(decode));
  }
  return decoded.get(id);
}

function luminance(numbers, pixel) {
  const i = 3 * pixel;
  return 0.2126 * numbers[i] + 0.7152 * numbers[i + 1] + 0.0722 * numbers[i + 2];
}

/** (L(image) − L(reference)) / (L(reference) + 0.01), as in the block error, for each pixel. */
function relativeDifference(reference, image) {
  const count = reference.length / 3;
  return Float32Array.from({ length: count }, (_, i) => {
    const b = luminance(reference, i);
    return (luminance(image, i) - b) / (b + 0.01);
  });
}

/** `rrggbb` in a row to bytes. */
function colorTable(hex) {
  return Uint8Array.from({ length: hex.length / 2 }, (_, i) => parseInt(hex.slice(2 * i, 2 * i + 2), 16));
}

const SEQUENTIAL = colorTable(report.sequential);
const DIVERGING = colorTable(report.diverging);

/** The sRGB byte of a linear number, by the square root of the number in 4096 steps. */
const SRGB_BYTES = Uint8Array.from({ length: 4097 }, (_, i) => {
  const x = (i / 4096) ** 2;
  return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
});

/** Linear light, multiplied by `factor` and clipped, as the pixels of a canvas. */
function paintPicture(canvas, numbers, factor) {
  paint(canvas, (out) => {
    for (let i = 0, j = 0; i < numbers.length; i += 3, j += 4) {
      for (let c = 0; c < 3; c++) {
        out[j + c] = SRGB_BYTES[Math.round(4096 * Math.sqrt(Math.min(1, numbers[i + c] * factor)))];
      }
      out[j + 3] = 255;
    }
  });
}

/** A map's numbers, taken to places 0 to 255 of a colour table. */
function paintMap(canvas, numbers, table, place) {
  paint(canvas, (out) => {
    for (let i = 0, j = 0; i < numbers.length; i++, j += 4) {
      const k = 3 * place(numbers[i]);
      out[j] = table[k];
      out[j + 1] = table[k + 1];
      out[j + 2] = table[k + 2];
      out[j + 3] = 255;
    }
  });
}

function paint(canvas, fill) {
  const context = canvas.getContext("2d");
  const image = context.createImageData(canvas.width, canvas.height);
  fill(image.data);
  context.putImageData(image, 0, 0);
}

/** Where in the diverging map a relative difference is, ±range being its ends. */
function divergingPlace(range) {
  return (x) => Math.max(0, Math.min(255, Math.round(127.5 * (1 + x / range))));
}
