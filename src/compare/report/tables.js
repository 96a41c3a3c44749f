// Tables of numbers: all metrics of a group's pairs, one metric of all its pictures, one metric of all groups.

/** A number's cell; the worst of its column is marked by more than colour. */
function numberCell(metric, value, isWorst, attributes = {}) {
  const text = metric.text(value);
  return el("td", { class: isWorst ? "number worst" : "number", title: isWorst ? "the worst of its column" : null, ...attributes },
    isWorst ? el("span", { class: "mark", "aria-label": "worst: " }, "▲") : null, text);
}

function pairName(group, pair) {
  return `${group.pictures[pair.image].name} against ${group.pictures[pair.reference].name}`;
}

/** All numbers of a group, a line for each pair; `choose` is told which pair was clicked. */
function numbersTable(group, choose) {
  const withWelch = group.pairs.some((pair) => pair.welch);
  const marked = METRICS.map((metric) => worst(group.pairs, (pair) => metric.badness(pair[metric.key])));
  const head = el("tr", {},
    el("th", { scope: "col" }, "image"),
    group.all ? el("th", { scope: "col" }, "reference") : null,
    METRICS.map((metric) => el("th", { scope: "col", class: "number", title: metric.help }, metric.name)),
    withWelch ? el("th", { scope: "col", title: "Welch's test: are they the same but for noise?" }, "Welch test") : null);
  const rows = group.pairs.map((pair, i) => el("tr", { "data-pair": i },
    el("th", { scope: "row" }, el("button", {
      type: "button", class: "link", onclick: () => choose(pair), title: `Show ${pairName(group, pair)}`,
    }, group.pictures[pair.image].name)),
    group.all ? el("td", {}, group.pictures[pair.reference].name) : null,
    METRICS.map((metric, k) => numberCell(metric, pair[metric.key], marked[k] === i)),
    withWelch ? welchCell(pair.welch) : null));
  return el("div", { class: "scroll" }, el("table", { class: "numbers" }, el("thead", {}, head), el("tbody", {}, rows)));
}

function welchCell(welch) {
  if (!welch) return el("td", {}, "–");
  const [x, y] = welch.worst_block;
  const title = `p over ${welch.tests} tests of blocks: ${pValue(welch.blocks_p)} (least at the block at ${x}, ${y}); of the whole: ${pValue(welch.whole_p)}`;
  return el("td", { title, class: welch.agrees ? "agrees" : "differs" },
    welch.agrees ? "same but for noise" : "differs beyond noise",
    el("span", { class: "quiet" }, ` p ${pValue(welch.p)}`));
}

/** One metric of every picture against every other. */
function matrixTable(group, metric, choose) {
  const names = group.pictures.map((picture) => picture.name);
  const cell = (reference, image) => {
    const pair = group.pairs.find((p) => p.reference === reference && p.image === image);
    if (!pair) return el("td", { class: "number quiet" }, "·");
    return el("td", { class: "number" }, el("button", {
      type: "button", class: "link", onclick: () => choose(pair), title: `Show ${pairName(group, pair)}`,
    }, metric.text(pair[metric.key])));
  };
  const head = el("tr", {}, el("th", { scope: "col", class: "quiet" }, "reference ↓ image →"),
    names.map((name) => el("th", { scope: "col", class: "number" }, name)));
  const rows = names.map((name, reference) => el("tr", {}, el("th", { scope: "row" }, name),
    names.map((_, image) => cell(reference, image))));
  return el("div", { class: "scroll" }, el("table", { class: "matrix" },
    el("caption", {}, `Agreement: ${metric.name}`), el("thead", {}, head), el("tbody", {}, rows)));
}

/** One metric of all groups: a line for each, a column for each pair that any of them has. */
function overviewTable(groups, metric, open) {
  const key = (group, pair) => JSON.stringify([group.pictures[pair.image].name, group.pictures[pair.reference].name]);
  // Of two pairs of the same pictures, the one whose reference comes first.
  const shown = (pair) => pair.reference < pair.image;
  const columns = [...new Set(groups.flatMap((group) => group.pairs.filter(shown).map((pair) => key(group, pair))))];
  const cells = groups.map((group) => columns.map((column) => group.pairs.find((pair) => shown(pair) && key(group, pair) === column)));
  const marked = columns.map((_, c) => worst(cells.map((row) => row[c]), (pair) => metric.badness(pair[metric.key])));
  const head = el("tr", {}, el("th", { scope: "col" }, ""), columns.map((column) => {
    const [image, reference] = JSON.parse(column);
    return el("th", { scope: "col", class: "number" }, image, el("span", { class: "quiet" }, el("br"), `against ${reference}`));
  }));
  const rows = groups.map((group, g) => el("tr", {},
    el("th", { scope: "row" }, el("a", { href: `#group${g}` }, group.name)),
    cells[g].map((pair, c) => {
      if (!pair) return el("td", { class: "number quiet" }, "·");
      const isWorst = marked[c] === g;
      return el("td", { class: isWorst ? "number worst" : "number" },
        el("a", { href: `#group${g}`, onclick: () => open(g, pair), title: `Show ${pairName(group, pair)} of ${group.name}` },
          isWorst ? el("span", { class: "mark", "aria-label": "worst: " }, "▲") : null, metric.text(pair[metric.key])));
    })));
  return el("div", { class: "scroll" }, el("table", { class: "overview" }, el("thead", {}, head), el("tbody", {}, rows)));
}
