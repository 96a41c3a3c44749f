// The page: title, overview of all groups, and the groups, whose pictures are inflated when they come near.

function details(group) {
  const keys = [...new Set(group.pictures.flatMap((picture) => picture.details.map(([key]) => key)))];
  if (keys.length === 0) return null;
  const values = (picture, key) => picture.details.filter(([k]) => k === key).map(([, value]) => value);
  const head = el("tr", {}, el("th", {}, ""), keys.map((key) => el("th", { scope: "col" }, key)));
  const rows = group.pictures.map((picture) => el("tr", {}, el("th", { scope: "row" }, picture.name),
    keys.map((key) => el("td", {}, values(picture, key).map((value) => el("div", {}, value))))));
  return el("details", {}, el("summary", {}, "How the pictures were made"),
    el("div", { class: "scroll" }, el("table", {}, el("thead", {}, head), el("tbody", {}, rows))));
}

function section(group, index) {
  const element = el("section", { id: `group${index}`, "aria-labelledby": `title${index}` });
  const current = (pair) => {
    element.querySelectorAll("tr[data-pair]").forEach((row) => {
      const isCurrent = group.pairs[+row.dataset.pair] === pair;
      if (isCurrent) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    });
  };
  const viewer = new Viewer(group, index, current);
  const choose = (pair) => viewer.choose(pair.reference, pair.image);
  const matrix = el("div");
  const notes = [...group.notes];
  if (group.reduction > 1) {
    notes.push(`Of ${group.width} × ${group.height} pixels; shown reduced by ${group.reduction}. Numbers are those of all pixels.`);
  }
  element.append(el("h2", { id: `title${index}` }, group.name),
    ...[group.description ? el("p", {}, group.description) : null,
      notes.length ? el("ul", { class: "notes" }, notes.map((note) => el("li", {}, note))) : null,
      matrix, numbersTable(group, choose), viewer.element, details(group)].filter(Boolean));
  current(viewer.pair);
  const showMetric = (metric) => {
    if (group.all && group.pictures.length > 2) matrix.replaceChildren(matrixTable(group, metric, choose));
  };
  return { element, viewer, choose, showMetric };
}

function start() {
  const { groups } = report;
  const sections = groups.map(section);
  document.getElementById("head").append(el("h1", {}, report.title),
    ...report.notes.map((note) => el("p", {}, note)),
    el("p", { class: "quiet" }, `rayo ${report.rayo} compare`));

  const overview = el("div");
  const metricSelect = el("select", { id: "metric", onchange: () => showMetric() },
    METRICS.map((metric, i) => el("option", { value: i }, metric.name)));
  const help = el("span", { class: "hint" });
  const showMetric = () => {
    const metric = METRICS[+metricSelect.value];
    help.textContent = metric.help;
    sections.forEach((s) => s.showMetric(metric));
    if (groups.length > 1) overview.replaceChildren(overviewTable(groups, metric, (g, pair) => sections[g].choose(pair)));
  };
  const main = document.getElementById("main");
  if (groups.length > 1 || groups.some((group) => group.all)) {
    main.append(el("section", { id: "overview", "aria-label": "Overview" }, el("h2", {}, "Overview"),
      el("div", { class: "controls" }, el("div", { class: "field" }, el("label", { for: "metric" }, "Number"), metricSelect), help), overview));
  }
  showMetric();
  main.append(...sections.map((s) => s.element));

  const near = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((e) => e.isIntersecting)) {
      near.unobserve(entry.target);
      sections.find((s) => s.viewer.element === entry.target).viewer.show();
    }
  }, { rootMargin: "400px" });
  sections.forEach((s) => near.observe(s.viewer.element));
}

start();
