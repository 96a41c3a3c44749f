// One group: two of its pictures under a slider, their difference and FLIP maps, the numbers under the mouse.

const RANGES = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2];

/** A canvas of the group's size and what lies on it. */
class Pane {
  constructor(group, title, extra) {
    const [width, height] = viewSize(group);
    this.canvas = el("canvas", { width, height });
    this.cross = el("span", { class: "cross", hidden: true });
    this.stage = el("div", { class: "stage", style: `aspect-ratio: ${width} / ${height}` }, this.canvas, this.cross);
    this.title = el("figcaption", {}, title);
    this.figure = el("figure", { class: "pane" }, this.title, this.stage, extra);
    this.size = [width, height];
    if (width < 500) this.stage.classList.add("pixelated");
  }

  /** The pixel under the pointer. */
  at(event) {
    const box = this.stage.getBoundingClientRect();
    const part = (start, length, count) => Math.max(0, Math.min(count - 1, Math.floor((count * start) / length)));
    return [
      part(event.clientX - box.left, box.width, this.size[0]),
      part(event.clientY - box.top, box.height, this.size[1]),
    ];
  }

  mark([x, y]) {
    this.cross.hidden = false;
    this.cross.style.left = `${(100 * (x + 0.5)) / this.size[0]}%`;
    this.cross.style.top = `${(100 * (y + 0.5)) / this.size[1]}%`;
  }
}

function viewSize(group) {
  return [Math.ceil(group.width / group.reduction), Math.ceil(group.height / group.reduction)];
}

function scale(table) {
  const canvas = el("canvas", { width: 256, height: 1, class: "ramp", "aria-hidden": "true" });
  paintMap(canvas, Float32Array.from({ length: 256 }, (_, i) => i), table, (i) => i);
  return canvas;
}

class Viewer {
  constructor(group, index, onPair) {
    this.group = group;
    this.onPair = onPair;
    this.flipKind = "ldr";
    this.histogramOf = "flip";
    this.range = null;
    this.element = el("div", { class: "viewer" });
    if (group.pairs.length > 0) this.build(index);
  }

  build(index) {
    const { group } = this;
    const id = (name) => `${name}${index}`;
    const options = (count) => group.pictures.slice(0, count).map((p, i) => el("option", { value: i }, p.name));
    const select = (name, children, onchange) => el("select", { id: id(name), onchange }, children);
    const field = (name, label, control, more) => el("div", { class: "field" }, el("label", { for: id(name) }, label), control, more);

    const references = group.all ? group.pictures.length : 1;
    this.referenceSelect = select("reference", options(references), () => this.choose(+this.referenceSelect.value, this.pair.image));
    this.imageSelect = select("image", options(group.pictures.length), () => this.choose(this.pair.reference, +this.imageSelect.value));
    if (!group.all) this.imageSelect.options[0].disabled = true;
    this.exposure = el("input", { id: id("exposure"), type: "range", min: -8, max: 8, step: 0.25, value: 0, oninput: () => this.paintPictures() });
    this.exposureText = el("output", { for: id("exposure") }, "0");
    this.rangeSelect = select("range", RANGES.map((r) => el("option", { value: r }, `±${100 * r} %`)), () => {
      this.range = +this.rangeSelect.value;
      this.paintMaps();
    });
    this.flipSelect = select("flip", [el("option", { value: "ldr" }, "LDR-FLIP"), el("option", { value: "hdr" }, "HDR-FLIP")], () => {
      this.flipKind = this.flipSelect.value;
      this.show();
    });
    this.histogramSelect = select("histogram", [
      el("option", { value: "flip" }, "FLIP"), el("option", { value: "difference" }, "relative difference"),
    ], () => {
      this.histogramOf = this.histogramSelect.value;
      this.paintMaps();
    });
    const controls = el("div", { class: "controls" },
      field("reference", "Reference", this.referenceSelect),
      field("image", "Image", this.imageSelect),
      field("exposure", "Exposure, stops", this.exposure, this.exposureText));

    this.photos = new Pane(group, "Reference and image");
    this.photos.figure.classList.add("photos");
    this.over = el("canvas", { width: this.photos.size[0], height: this.photos.size[1], class: "over" });
    this.split = el("input", {
      type: "range", class: "split", min: 0, max: 100, step: 0.1, value: 50, oninput: () => this.moveSplit(),
      "aria-label": "Slider between reference (left) and image (right)",
    });
    this.handle = el("span", { class: "handle", "aria-hidden": "true" });
    this.leftLabel = el("span", { class: "chip left" });
    this.rightLabel = el("span", { class: "chip right" });
    this.photos.stage.append(this.over, this.handle, this.leftLabel, this.rightLabel, this.split);

    const legend = (table, ticks, control) => el("div", { class: "legend" }, el("div", { class: "scale" }, scale(table), ticks), control);
    this.rangeTicks = el("div", { class: "ticks" });
    this.difference = new Pane(group, "Relative difference of luminance",
      legend(DIVERGING, this.rangeTicks, field("range", "Range", this.rangeSelect)));
    const flipTicks = el("div", { class: "ticks" }, ["0", "0.25", "0.5", "0.75", "1"].map((t) => el("span", {}, t)));
    this.flip = new Pane(group, "FLIP", legend(SEQUENTIAL, flipTicks, field("flip", "Map", this.flipSelect)));
    this.panes = [this.photos, this.difference, this.flip];
    this.panes.forEach((pane) => this.listen(pane));

    this.histogram = el("div", { class: "histogram" });
    this.readout = el("tbody");
    this.readoutTitle = el("figcaption", {}, "Under the mouse");
    const side = el("div", { class: "side" },
      el("figure", { class: "pane" }, this.readoutTitle,
        el("div", { class: "scroll" }, el("table", { class: "readout" },
          el("thead", {}, el("tr", {}, ["picture", "R", "G", "B"].map((t, i) => el("th", { scope: "col", class: i ? "number" : null }, t)))),
          this.readout)),
        el("p", { class: "hint" }, "Point at a picture, or move with the arrow keys on a map. Linear Rec.709.")),
      el("figure", { class: "pane" }, el("figcaption", {}, "Histogram"), this.histogram,
        el("div", { class: "legend" }, field("histogram", "Of", this.histogramSelect), el("span", { class: "hint" }, "height: logarithm of the count"))));
    this.element.append(controls, el("div", { class: "panes" }, this.panes.map((p) => p.figure), side));
    this.moveSplit();
    this.choose(group.pairs[0].reference, group.pairs[0].image, true);
  }

  listen(pane) {
    pane.stage.addEventListener("pointermove", (event) => this.probeAt(pane.at(event)));
    pane.stage.addEventListener("pointerdown", (event) => this.probeAt(pane.at(event)));
    if (pane === this.photos) return;
    pane.stage.tabIndex = 0;
    pane.stage.setAttribute("role", "application");
    pane.stage.setAttribute("aria-label", `${pane.title.textContent}: arrow keys move the pixel that is read`);
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    pane.stage.addEventListener("keydown", (event) => {
      const step = steps[event.key];
      if (!step) return;
      event.preventDefault();
      const size = event.shiftKey ? 10 : 1;
      const move = (axis) => Math.max(0, Math.min(pane.size[axis] - 1, this.probe[axis] + size * step[axis]));
      this.probeAt([move(0), move(1)]);
    });
  }

  /** Shows a pair; of two that are the same picture, the first pair that has the reference. */
  choose(reference, image, quietly = false) {
    const { pairs } = this.group;
    const find = (test) => pairs.find(test);
    this.pair = find((p) => p.reference === reference && p.image === image)
      ?? find((p) => p.reference === reference) ?? pairs[0];
    this.referenceSelect.value = this.pair.reference;
    this.imageSelect.value = this.pair.image;
    this.onPair(this.pair);
    if (!quietly) this.show();
  }

  /** Inflates what is to be seen and paints it. */
  async show() {
    const { group, pair } = this;
    if (!pair) return;
    const [reference, image, flip] = await Promise.all([
      pixels(group.pictures[pair.reference].blob),
      pixels(group.pictures[pair.image].blob),
      blob(this.flipKind === "ldr" ? pair.ldr_blob : pair.hdr_blob),
    ]);
    if (pair !== this.pair) return;
    if (this.shown !== pair) {
      this.differences = relativeDifference(reference, image);
      this.shown = pair;
    }
    this.light = [reference, image];
    this.errors = Float32Array.from(flip, (byte) => byte / 255);
    this.range ??= this.fittingRange();
    this.rangeSelect.value = this.range;
    this.leftLabel.textContent = group.pictures[pair.reference].name;
    this.rightLabel.textContent = group.pictures[pair.image].name;
    this.flip.title.textContent = `${this.flipKind.toUpperCase()}-FLIP, mean ${pair[`${this.flipKind}_flip`].toFixed(4)}`;
    this.paintPictures();
    this.paintMaps();
    this.probeAt(this.probe ?? this.photos.size.map((n) => n >> 1));
    this.element.dataset.ready = `${pair.reference},${pair.image}`;
  }

  /** The smallest range that nine tenths of the pixels lie in. */
  fittingRange() {
    const sorted = this.differences.map(Math.abs).sort();
    const most = sorted[Math.floor(0.9 * (sorted.length - 1))];
    return RANGES.find((range) => range >= most) ?? RANGES.at(-1);
  }

  paintPictures() {
    const stops = +this.exposure.value;
    this.exposureText.textContent = stops > 0 ? `+${stops}` : String(stops).replace("-", "−");
    if (!this.light) return;
    paintPicture(this.over, this.light[0], 2 ** stops);
    paintPicture(this.photos.canvas, this.light[1], 2 ** stops);
  }

  paintMaps() {
    paintMap(this.difference.canvas, this.differences, DIVERGING, divergingPlace(this.range));
    paintMap(this.flip.canvas, this.errors, SEQUENTIAL, (x) => Math.round(255 * x));
    const label = (x) => `${x > 0 ? "+" : x < 0 ? "−" : ""}${significant(100 * Math.abs(x))} %`;
    this.rangeTicks.replaceChildren(...[-1, -0.5, 0, 0.5, 1].map((x) => el("span", {}, label(x * this.range))));
    if (this.histogramOf === "flip") drawHistogram(this.histogram, this.errors, 0, 1, SEQUENTIAL, (x) => x.toFixed(2));
    else drawHistogram(this.histogram, this.differences, -this.range, this.range, DIVERGING, percent);
  }

  moveSplit() {
    const percent = +this.split.value;
    this.over.style.clipPath = `inset(0 ${100 - percent}% 0 0)`;
    this.handle.style.left = `${percent}%`;
  }

  /** Reads a pixel: of all pictures of the group, even those that are not shown. */
  async probeAt([x, y]) {
    this.probe = [x, y];
    this.panes.forEach((pane) => pane.mark(this.probe));
    const i = y * this.photos.size[0] + x;
    const all = await Promise.all(this.group.pictures.map((picture) => pixels(picture.blob)));
    if (this.probe[0] !== x || this.probe[1] !== y || !this.errors) return;
    const rows = this.group.pictures.map((picture, k) => el("tr", {},
      el("th", { scope: "row" }, el("span", {
        class: "swatch", style: `background: rgb(${[0, 1, 2].map((c) => this.byte(all[k][3 * i + c])).join(" ")})`,
      }), picture.name),
      [0, 1, 2].map((c) => el("td", { class: "number" }, significant(all[k][3 * i + c])))));
    const last = (name, text) => el("tr", { class: "derived" }, el("th", { scope: "row" }, name), el("td", { class: "number", colspan: 3 }, text));
    this.readout.replaceChildren(...rows, last("relative difference", percent(this.differences[i])),
      last(`${this.flipKind.toUpperCase()}-FLIP`, this.errors[i].toFixed(3)));
    const where = this.group.reduction > 1 ? `Mean of the ${this.group.reduction} × ${this.group.reduction} pixels from ` : "Pixel ";
    this.readoutTitle.textContent = `${where}${x * this.group.reduction}, ${y * this.group.reduction}`;
  }

  byte(linear) {
    return SRGB_BYTES[Math.round(4096 * Math.sqrt(Math.min(1, linear * 2 ** +this.exposure.value)))];
  }
}
