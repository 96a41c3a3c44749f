// How often each number of a map occurs: bars in the map's own colours, their height the logarithm of the count.

const BINS = 64;

/** Draws into `place` the numbers between `low` and `high`; those beyond count in the outermost bars. */
function drawHistogram(place, numbers, low, high, table, labels) {
  const counts = new Uint32Array(BINS);
  for (const x of numbers) {
    const bin = Math.floor((BINS * (x - low)) / (high - low));
    counts[Math.max(0, Math.min(BINS - 1, bin))]++;
  }
  const most = Math.log1p(Math.max(...counts));
  const bars = Array.from(counts, (count, i) => {
    const height = most > 0 ? (100 * Math.log1p(count)) / most : 0;
    const k = 3 * Math.round((255 * (i + 0.5)) / BINS);
    const from = labels(low + ((high - low) * i) / BINS);
    const to = labels(low + ((high - low) * (i + 1)) / BINS);
    return svg("g", {},
      svg("title", {}, `${from} to ${to}: ${count} pixels`),
      svg("rect", { x: i * 5, y: 0, width: 5, height: 100, fill: "transparent" }),
      svg("rect", {
        class: "bar", x: i * 5 + 0.4, y: 100 - height, width: 4.2, height, rx: 0.8,
        fill: `rgb(${table[k]} ${table[k + 1]} ${table[k + 2]})`,
      }));
  });
  place.replaceChildren(
    svg("svg", { viewBox: "0 0 320 100", preserveAspectRatio: "none", role: "img", "aria-label": "histogram" }, ...bars),
    el("div", { class: "ticks" }, [low, (low + high) / 2, high].map((x) => el("span", {}, labels(x)))));
}
