// Elements, and numbers as text.

/** An element; what is in `children` as text stays text. */
function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child != null));
  return element;
}

function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** To four significant digits, without an exponent where that is short. */
function significant(x) {
  if (x == null || !Number.isFinite(x)) return x === 0 ? "0" : "–";
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-4 || size >= 1e5)) return x.toExponential(3);
  return String(Number(x.toPrecision(4)));
}

function percent(x) {
  const p = 100 * x;
  return `${p > 0 ? "+" : p < 0 ? "−" : ""}${Math.abs(p) >= 100 ? Math.abs(p).toFixed(0) : Math.abs(p).toFixed(2)} %`;
}

function pValue(p) {
  return p < 1e-3 ? p.toExponential(1) : p.toFixed(3);
}

/**
 * The numbers of a pair. `badness` grows with how bad a number is. JSON has no infinity: `null` stands for it.
 */
const METRICS = [
  {
    key: "ldr_flip", name: "LDR-FLIP", help: "Mean LDR-FLIP, 0 to 1: how different they look when flipped between, at exposure 0",
    text: (x) => x.toFixed(4), badness: (x) => x,
  },
  {
    key: "hdr_flip", name: "HDR-FLIP", help: "Mean HDR-FLIP, 0 to 1: the worst over all exposures",
    text: (x) => x.toFixed(4), badness: (x) => x,
  },
  {
    key: "mean_ratio", name: "mean ratio", help: "Mean luminance of the image over that of the reference",
    text: (x) => (x == null ? "∞" : x.toFixed(4)), badness: (x) => (x == null ? Infinity : Math.abs(Math.log(x))),
  },
  {
    key: "rel_mse", name: "relMSE", help: "Relative mean square error, worst 0.1 % of pixels left out: noise",
    text: (x) => x.toExponential(2), badness: (x) => x,
  },
  {
    key: "block_median", name: "block median", help: "Median relative difference of 8 × 8 block means: bias",
    text: (x) => x.toFixed(4), badness: (x) => x,
  },
  {
    key: "block_p95", name: "block p95", help: "95th percentile of the relative difference of 8 × 8 block means",
    text: (x) => x.toFixed(4), badness: (x) => x,
  },
  {
    key: "psnr", name: "PSNR", help: "Peak signal-to-noise ratio of the sRGB-encoded pictures, in decibels",
    text: (x) => (x == null ? "∞" : `${x.toFixed(1)} dB`), badness: (x) => (x == null ? -Infinity : -x),
  },
];

/** The index of the worst of `items` (`null` and `undefined` are none), or −1 where none stands out. */
function worst(items, badness) {
  if (items.filter((item) => item != null).length < 2) return -1;
  const values = items.map((item) => (item == null ? -Infinity : badness(item)));
  const most = Math.max(...values);
  const among = values.filter((value) => value === most).length;
  return among === 1 ? values.indexOf(most) : -1;
}
