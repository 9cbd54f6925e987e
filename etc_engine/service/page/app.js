"use strict";
// The page of the service: it only asks what any client can ask, and writes text, never markup, into the document.

const BUSY_SECONDS = 2, IDLE_SECONDS = 4, HIDDEN_SECONDS = 20, QUEUE_TURNS = 2;
const $ = id => document.getElementById(id);
let about = null, schema = null, catalogue = null, view = { poll: null }, token = sessionStorage.getItem("etc-token") || "";
let draft = null; // what was typed into the form of a new study, kept while other parts are looked at

function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter(child => child !== null && child !== undefined));
  return element;
}

class Refusal extends Error {
  constructor(status, problem) { super(problem.error); this.status = status; this.field = problem.field || ""; }
}

async function ask(path, options = {}) {
  const headers = { ...options.headers };
  if (token) headers.Authorization = `Bearer ${token}`;
  let answer;
  try { answer = await fetch(path, { ...options, headers }); }
  catch { throw new Refusal(0, { error: "The service does not answer. This page keeps trying." }); }
  if (answer.ok) return answer;
  let problem = { error: `The service returned ${answer.status}.` };
  try { problem = await answer.json(); } catch { /* not from the service itself */ }
  if (answer.status === 401) {
    $("token").hidden = false;
    $("token-label").textContent = token ? "The token is wrong; try another one" : "This service asks for a token";
  }
  throw new Refusal(answer.status, problem);
}
const get = async path => (await ask(path)).json();
const post = async (path, body, type) =>
  (await ask(path, { method: "POST", body, headers: type ? { "Content-Type": type } : {} })).json();

function alarm(text) { $("alarm").textContent = text; $("alarm").hidden = !text; }

$("token").addEventListener("submit", event => {
  event.preventDefault();
  token = $("token-word").value.trim();
  sessionStorage.setItem("etc-token", token);
  $("token").hidden = true;
  alarm("");
  start();
});

// A download is a link; where a token is needed, the file is fetched first: an address must not carry the token.
function download(path, label) {
  if (!token) return h("a", { class: "button", href: path, download: true }, label);
  return h("button", { onclick: async () => {
    try {
      const name = path.split("/").pop();
      const address = URL.createObjectURL(await (await ask(path)).blob());
      h("a", { href: address, download: name }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60000);
    } catch (error) { alarm(error.message); }
  } }, label);
}

// Words of others: what has no picture is shown by its number, what is too long is cut.
const NAME_LENGTH = 60;
function clean(text) {
  const letters = [...text.replace(/[\p{C}\p{Zl}\p{Zp}]/gu, letter => `\\u{${letter.codePointAt(0).toString(16)}}`)];
  return letters.length > NAME_LENGTH ? letters.slice(0, NAME_LENGTH - 1).join("") + "…" : letters.join("");
}

// ---- the queue

async function refreshQueue() {
  const { studies, total } = await get("/api/studies?limit=200");
  const shown = location.hash.replace("#/study/", "");
  const items = studies.map(study => h("li", {},
    h("a", { href: `#/study/${study.id}`, "aria-current": study.id === shown ? "page" : null },
      h("span", { class: "row" }, h("span", { class: "name" }, clean(study.name)),
        h("span", { class: `state ${study.state}` }, stateOf(study))),
      study.state === "running" || study.state === "queued"
        ? h("progress", { max: study.planned, value: study.done, "aria-label": `progress of ${clean(study.name)}` }) : null,
      h("span", { class: "row faint" }, h("span", {}, `${study.done} of ${study.planned} packings${failedOf(study)}`)))));
  const focused = document.activeElement && document.activeElement.closest("#queue") ? document.activeElement.hash : null;
  $("queue").replaceChildren(...items);
  if (focused) { const again = $("queue").querySelector(`a[href="${focused}"]`); if (again) again.focus(); }
  $("queue-empty").hidden = studies.length > 0;
  $("queue-more").textContent = total > studies.length ? `and ${total - studies.length} older ones` : "";
  return studies.some(study => study.state === "running" || study.state === "queued");
}
const failedOf = study => study.failed_cells ? ` (${study.failed_cells} cell${study.failed_cells === 1 ? "" : "s"} failed)` : "";
const stateOf = study => study.cancelling ? "cancelling" : study.state;

// ---- a new study

const allFields = () => draft.tables.flatMap(([, fields]) => fields);

function fieldOf(field) {
  const id = `field-${field.place}`, value = draft.values[field.place], words = wordsOf(field, draft.values);
  const common = { id, name: field.place, "aria-describedby": `${id}-hint ${id}-error`, autocomplete: "off", spellcheck: "false" };
  const control = words && !field.list
    ? h("select", common, (field.required || field.start !== null ? words : ["", ...words]).map(word =>
      h("option", { value: word, selected: word === value }, word)))
    : h("input", { ...common, value, list: words ? `${id}-words` : null, inputmode: field.numbers && !field.list ? "decimal" : null });
  return h("div", { class: "field", "data-field": field.place }, h("label", { for: id }, field.title), control,
    words && field.list ? h("datalist", { id: `${id}-words` }, words.map(word => h("option", { value: word }))) : null,
    h("p", { class: "hint", id: `${id}-hint` }, field.hint), h("p", { class: "error", id: `${id}-error` }));
}

function newStudy() {
  if (!draft) {
    const tables = tablesOf(schema);
    draft = { mode: "form", tables, values: startOf(schema, tables), text: "" };
  }
  const body = h("form", { novalidate: true });
  const size = h("p", { class: "size faint", id: "size", "aria-live": "polite" });
  const general = h("p", { class: "error", id: "study-error", role: "alert" });
  const tab = (mode, label) => h("button", { type: "button", role: "tab", id: `tab-${mode}`, "aria-selected": draft.mode === mode ? "true" : "false",
    onclick: () => { if (mode === "text" && draft.mode === "form") draft.text = tomlOf(studyOf(schema, draft.tables, draft.values)); draft.mode = mode; newStudy(); } }, label);
  const read = () => draft.mode === "text" ? [draft.text, "application/toml"] : [JSON.stringify(studyOf(schema, draft.tables, draft.values)), "application/json"];
  let timer = null, asked = 0;

  function tell(error) {
    for (const element of body.querySelectorAll("[aria-invalid]")) element.removeAttribute("aria-invalid");
    for (const element of body.querySelectorAll(".field .error")) element.textContent = "";
    general.textContent = "";
    if (!error) return;
    size.textContent = "";
    const words = error.message.replace(/^study: /, "");
    const control = error.field && body.querySelector(`[name="${CSS.escape(error.field)}"]`);
    if (control) {
      control.setAttribute("aria-invalid", "true");
      $(`field-${error.field}-error`).textContent = words;
    } else {
      general.textContent = words;
      const text = $("study-text");
      if (text) text.setAttribute("aria-invalid", "true");
    }
  }
  async function check() {
    const mine = ++asked;
    try {
      const found = await post("/api/studies/check", ...read());
      if (mine !== asked) return;
      tell(null);
      const packings = found.most > found.units ? `${found.units} to ${found.most} packings` : `${found.units} packings`;
      size.textContent = `${packings}, ${found.cells} results, about ${Math.round(found.particles)} particles in the densest packing` +
        (found.known ? "; this very study is there already" : "");
    } catch (error) { if (mine === asked) tell(error); }
  }
  function changed() { clearTimeout(timer); timer = setTimeout(check, 350); }

  if (draft.mode === "form") {
    body.append(...draft.tables.map(([title, fields]) => h("fieldset", {}, h("legend", {}, title), h("div", { class: "fields" }, fields.map(fieldOf)))));
    const hide = () => {
      for (const field of body.querySelectorAll(".field"))
        field.hidden = !meant(allFields().find(one => one.place === field.dataset.field), draft.values, allFields());
      for (const set of body.querySelectorAll("fieldset")) set.hidden = !set.querySelector(".field:not([hidden])");
    };
    body.addEventListener("input", event => {
      draft.values[event.target.name] = event.target.value;
      const follow = allFields().filter(field => field.words && !Array.isArray(field.words) && event.target.name in field.words);
      for (const field of follow) draft.values[field.place] = "";
      if (follow.length) newStudy();
      hide();
      changed();
    });
    hide();
  } else {
    const text = h("textarea", { id: "study-text", spellcheck: "false", "aria-describedby": "study-error", "aria-label": "Study as TOML" });
    text.value = draft.text;
    text.addEventListener("input", () => { draft.text = text.value; changed(); });
    body.append(text);
  }
  body.append(general, size, h("div", { class: "buttons" }, h("button", { class: "main", id: "submit" }, "Submit study")));
  body.addEventListener("submit", async event => {
    event.preventDefault();
    clearTimeout(timer);
    try {
      const found = await post("/api/studies", ...read());
      location.hash = `#/study/${found.id}`;
    } catch (error) {
      asked++;
      tell(error);
      const wrong = body.querySelector("[aria-invalid]");
      if (wrong) wrong.focus();
    }
  });
  show(h("h1", {}, "New study"),
    h("p", { class: "faint" }, "Many random packings, the effective conductivity of each, and the mean with its confidence interval."),
    h("div", { class: "tabs", role: "tablist", "aria-label": "How to write the study" }, tab("form", "Form"), tab("text", "TOML text")), body);
  check();
}

// ---- one study

const SHOWN_BY_DEFAULT = 4;

function study(id) {
  const title = h("h1", {}), state = h("span", { class: "state" }), reason = h("p", { class: "error" });
  const bar = h("progress", { "aria-label": "progress" }), counts = h("p", { class: "faint" });
  const buttons = h("div", { class: "buttons" }), plot = h("figure"), table = h("div", { class: "wide" });
  const models = h("div"), log = h("pre", { tabindex: "0", "aria-label": "end of the log" });
  const bed = h("details", { ontoggle: showBed }, h("summary", {}, "Packing"));
  const shown = new Set();
  let known = "", drawn = "", chosen = false, lagging = false, units = -1;

  const act = (label, action, style) => h("button", { class: style || null, onclick: async () => {
    try { await action(); alarm(""); await poll(); } catch (error) { alarm(error.message); }
  } }, label);
  function fillButtons(found) {
    if (known === stateOf(found)) return;
    known = stateOf(found);
    const path = `/api/studies/${id}`, active = found.state === "running" || found.state === "queued";
    buttons.replaceChildren(...[
      found.state === "done" ? download(`${path}/result.nc`, "Result (netCDF)") : null,
      found.state === "done" ? download(`${path}/report.html`, "Report (HTML)") : null,
      download(`${path}/study.toml`, "Study (TOML)"),
      active && !found.cancelling ? act("Cancel", () => post(`${path}/cancel`, "")) : null,
      found.state === "cancelled" || found.state === "failed" ? act("Resume", () => post(`${path}/resume`, ""), "main") : null,
      found.state !== "running" ? act("Remove", async () => {
        if (!confirm(`Remove the study ${clean(found.name)} with all its results?`)) return;
        await ask(path, { method: "DELETE" });
        location.hash = "#/new";
      }) : null].filter(Boolean));
  }
  function showBed() { // drawn by the service when it is first asked for
    if (!bed.open || bed.querySelector("img")) return;
    const said = h("p", { class: "faint" }, "Drawing …");
    bed.append(said, h("img", { src: `/api/studies/${id}/bed.png`, alt: "The packing of the first realization",
      onload: () => said.replaceChildren("The first realization, made again from its random stream."),
      onerror: event => { event.target.hidden = true; said.replaceChildren("This packing cannot be drawn: the report says why."); } }));
  }
  function drawFigure(curve) {
    if (!chosen && curve.models.length) {
      chosen = true;
      curve.models.filter(m => m.curves.some(c => c.some(v => v > 0))).slice(0, SHOWN_BY_DEFAULT).forEach(m => shown.add(m.name));
    }
    if (!curve.series.length) {
      plot.replaceChildren(h("p", { class: "faint" }, "The figure appears with the first realizations."));
      return;
    }
    const { svg, legend } = figure(curve, shown, $("main").clientWidth);
    const level = Math.round(100 * curve.confidence);
    plot.replaceChildren(svg, h("ul", { class: "legend" }, legend.map(([name, sample]) => h("li", {}, sample, name))),
      h("figcaption", {}, `Each point: mean over ${packingsPerPoint(curve)} packings (${curve.units} in all${curve.complete ? "" : " so far"}), ` +
        `with the ${level} % Student-t interval of the mean: bands and bars. Packings without a path count as 0. Dashed: models.` +
        (curve.method_error === null ? "" :
          ` Estimated error of the method, not in the bands: up to ${(100 * curve.method_error).toPrecision(2)} %.`)));
    fillTable(curve);
    fillModels(curve);
  }
  function fillTable(curve) {
    const head = curve.series.map(series => h("th", { scope: "col" }, seriesName(series)));
    const cell = (series, i) => series.mean[i] === null ? "–" : series.mean[i].toPrecision(4) +
      (series.low[i] === null ? "" : ` ± ${(0.5 * (series.high[i] - series.low[i])).toPrecision(2)}`) + ` (${series.count[i]})`;
    table.replaceChildren(h("table", {}, h("caption", { class: "faint" }, "W/(m K), in brackets the realizations"),
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, curve.along.title), head)),
      h("tbody", {}, curve.along.values.map((x, i) => h("tr", {}, h("th", { scope: "row" }, x === null ? "own" : String(+x.toPrecision(6))),
        curve.series.map(series => h("td", {}, cell(series, i))))))));
  }
  function fillModels(curve) {
    const focused = document.activeElement && models.contains(document.activeElement) ? document.activeElement.id : null;
    const rows = curve.models.map(model => h("tr", {},
      h("td", {}, h("input", { type: "checkbox", id: `show-${model.name}`, checked: shown.has(model.name), "aria-label": `draw ${model.title}`,
        onchange: event => { event.target.checked ? shown.add(model.name) : shown.delete(model.name); drawFigure(curve); } })),
      h("td", { class: "text" }, h("label", { for: `show-${model.name}` }, model.title)), h("td", { class: "text" }, model.kind),
      h("td", {}, model.rms_relative_difference === null ? "–" : `${(100 * model.rms_relative_difference).toPrecision(3)} %`),
      h("td", { class: "text" }, model.note || (model.name === curve.best_model ? "closest estimate" :
        curve.within_error.includes(model.name) ? "inside the error of the simulation" : ""))));
    models.replaceChildren(curve.remark ? h("p", { class: "faint" }, curve.remark) : h("div", { class: "wide" }, h("table", {},
      h("thead", {}, h("tr", {}, h("th", {}, "draw"), h("th", { class: "text" }, "model"), h("th", { class: "text" }, "kind"),
        h("th", {}, "rms difference"), h("th", { class: "text" }, "remark"))), h("tbody", {}, rows))));
    if (curve.bounds_broken) models.prepend(h("p", { class: "error" }, "A rigorous bound is broken: look at the report."));
    if (focused && $(focused)) $(focused).focus();
  }
  // The packings of the figure, so that the page tells one number: the queue counts on while a figure is made.
  function fillCounts(found) {
    const done = units < 0 ? found.done : units, more = found.most > found.planned ? ` (adaptive: ${found.most} at most)` : "";
    bar.max = found.planned; bar.value = done;
    counts.replaceChildren(state, ` – ${done} of ${found.planned} packings${more}${failedOf(found)}`);
  }
  async function poll() {
    const found = await get(`/api/studies/${id}`);
    title.textContent = clean(found.name);
    state.textContent = stateOf(found);
    state.className = `state ${found.state}`;
    reason.textContent = found.reason === found.state ? "" : found.reason;
    bar.hidden = found.state === "done";
    bed.hidden = found.state !== "done";
    fillCounts(found);
    log.textContent = found.log || "nothing yet";
    fillButtons(found);
    const version = `${found.state} ${found.done}`;
    if (version !== drawn || lagging) { // asked for again only when there is something new
      const curve = await get(`/api/studies/${id}/curve`);
      if (curve.units !== units || version !== drawn) drawFigure(curve);
      units = curve.units;
      lagging = found.state === "running" && units < found.done;
      drawn = version;
      fillCounts(found);
    }
    return found.state === "running" || found.state === "queued";
  }
  show(title, counts, bar, reason, buttons, plot, h("h3", {}, "Models beside it"), models,
    bed, h("details", {}, h("summary", {}, "Values"), table), h("details", {}, h("summary", {}, "Log"), log));
  view.poll = poll;
  return poll();
}

// ---- single solve and models

function facts(entries) {
  return h("dl", { class: "facts" }, entries.map(([key, value]) => h("div", {}, h("dt", {}, key), h("dd", {}, value))));
}

function solve() {
  const field = (id, label, control, hint) => h("div", { class: "field" }, h("label", { for: id }, label), control, h("p", { class: "hint" }, hint));
  const input = (id, placeholder, hint, label) => field(id, label, h("input", { id, name: id, placeholder, autocomplete: "off" }), hint);
  const answer = h("div", { "aria-live": "polite" }), button = h("button", { class: "main" }, "Solve");
  const form = h("form", { novalidate: true }, h("fieldset", {}, h("legend", {}, "Particles"), h("div", { class: "fields" },
    field("file", "File", h("input", { id: "file", type: "file", required: true }), "CSV with x,y,radius[,conductivity]; LAMMPS/LIGGGHTS dump, netCDF, VTK, extended XYZ, YADE or MercuryDPM"),
    input("box", "1,1", "edge lengths, for CSV, YADE and legacy VTK; others bring their own", "Box"), input("periodic", "", "such as xy, for files without a box", "Periodic axes"),
    field("engine", "Engine", h("select", { id: "engine", name: "engine" }, Object.keys(about.engines).map(word => h("option", {}, word))), ""),
    field("method", "Method", h("select", { id: "method", name: "method" }), ""),
    input("contact_angle", "", "degrees; empty: overlaps", "Contact half-angle"), input("conductivity", "", "of the particles [W/(m K)]", "Conductivity"))),
    h("div", { class: "buttons" }, button));
  const fill = () => form.elements.method.replaceChildren(...about.engines[form.elements.engine.value].map(word => h("option", {}, word)));
  form.elements.engine.addEventListener("change", fill);
  fill();
  form.addEventListener("submit", async event => {
    event.preventDefault();
    const file = $("file").files[0];
    if (!file) { answer.replaceChildren(h("p", { class: "error" }, "Choose a file first.")); return; }
    const query = new URLSearchParams();
    for (const name of ["box", "periodic", "engine", "method", "contact_angle", "conductivity"]) if (form.elements[name].value.trim()) query.set(name, form.elements[name].value.trim());
    button.disabled = true;
    answer.replaceChildren(h("p", { class: "faint" }, "Solving …"));
    try {
      const found = await post(`/api/solve?${query}`, file, "application/octet-stream");
      const shown = [["conductivity [W/(m K)]", found.conductivity.toPrecision(8)], ["particles", found.particles], ["contacts", found.contacts],
        ["wall contacts", found.wall_contacts], ["percolates", found.percolates ? "yes" : "no"], ["engine and method", `${found.engine}, ${found.method}`], ["seconds", found.seconds.toFixed(2)]];
      if (found.conductivity_tensor) shown.splice(1, 0, ["tensor", found.conductivity_tensor.map(row => row.map(k => k.toPrecision(6)).join(" ")).join("; ")]);
      answer.replaceChildren(facts(shown.map(([key, value]) => [key, String(value)])), ...found.warnings.map(text => h("p", { class: "error" }, text)));
    } catch (error) { answer.replaceChildren(h("p", { class: "error", role: "alert" }, error.message)); }
    button.disabled = false;
  });
  show(h("h1", {}, "Single solve"), h("p", { class: "faint" }, "The effective conductivity of one packing of your own, between walls at x = 0 and x = L, or periodic."), form, answer);
}

async function models() {
  const mine = view;
  if (!catalogue) catalogue = (await get("/api/models")).models;
  if (mine !== view) return; // somebody has gone on to another part meanwhile
  const select = h("select", { id: "model" }, catalogue.map(model => h("option", { value: model.model }, model.title)));
  const detail = h("div");
  function fill() {
    const model = catalogue.find(item => item.model === select.value), answer = h("p", { "aria-live": "polite" });
    const form = h("form", { novalidate: true }, h("div", { class: "fields" }, model.inputs.map(item => h("div", { class: "field" },
      h("label", { for: `in-${item.name}` }, item.name), h("input", { id: `in-${item.name}`, name: item.name, autocomplete: "off",
        placeholder: item.default === null ? "" : String(item.default) }),
      h("p", { class: "hint" }, `${item.meaning}, ${item.unit === "-" ? "" : `[${item.unit}], `}in ${item.allowed}`))),
      h("div", { class: "field" }, h("label", { for: "in-dimension" }, "dimension"),
        h("select", { id: "in-dimension", name: "dimension" }, model.dimensions.map(d => h("option", {}, String(d)))))),
      h("div", { class: "buttons" }, h("button", { class: "main" }, "Evaluate"), answer));
    form.addEventListener("submit", async event => {
      event.preventDefault();
      const body = { dimension: Number(form.elements.dimension.value), parameters: {} };
      for (const { name } of model.inputs) {
        const word = form.elements[name].value.trim();
        if (word) (["k1", "k2", "fraction"].includes(name) ? body : body.parameters)[name] = word;
      }
      try {
        const found = await post(`/api/models/${model.model}`, JSON.stringify(body), "application/json");
        answer.className = "";
        answer.textContent = `${found.conductivity === null ? "infinite" : found.conductivity.toPrecision(10)} W/(m K)`;
      } catch (error) { answer.className = "error"; answer.textContent = error.message; }
    });
    detail.replaceChildren(facts([["kind", model.kind], ["dimension", model.dimensions.map(d => `${d}D`).join(", ")], ["name", model.model]]), form,
      h("p", {}, h("strong", {}, "Validity: "), model.validity), h("p", {}, h("strong", {}, "Limits: "), model.limits), h("p", { class: "faint" }, model.reference));
  }
  select.addEventListener("change", fill);
  show(h("h1", {}, "Conductivity models"), h("p", { class: "faint" }, "Closed-form estimates and bounds for two-phase media."),
    h("div", { class: "field" }, h("label", { for: "model" }, "Model"), select), detail);
  fill();
}

// ---- which part is shown, and when it is asked for again

function show(...children) { $("main").replaceChildren(...children); }

async function route() {
  view = { poll: null };
  alarm("");
  const [, part, id] = location.hash.split("/");
  for (const link of document.querySelectorAll("nav a")) link.toggleAttribute("aria-current", link.hash === `#/${part || "new"}`);
  try {
    if (part === "study" && /^[0-9a-f]{16}$/.test(id || "")) await study(id);
    else if (part === "solve") solve();
    else if (part === "models") await models();
    else newStudy();
    await refreshQueue();
  } catch (error) { alarm(error.message); }
}

let ticking = null, turn = 0, busyQueue = false;
async function tick() {
  clearTimeout(ticking);
  let busy = false;
  try {
    if (turn++ % QUEUE_TURNS === 0 || !view.poll) busyQueue = await refreshQueue();
    busy = view.poll && await view.poll() || busyQueue;
    alarm("");
  } catch (error) { if (error.status !== 401) alarm(error.message); }
  const seconds = document.hidden ? HIDDEN_SECONDS : busy ? BUSY_SECONDS : IDLE_SECONDS;
  ticking = setTimeout(tick, 1000 * seconds);
}

async function start() {
  try { [about, schema] = await Promise.all([get("/api/service"), get("/api/schema")]); }
  catch (error) { if (error.status !== 401) alarm(error.message); return; }
  $("about").textContent = `${about.ranks} rank${about.ranks > 1 ? "s" : ""} a study, ${about.launcher}`;
  await route();
  ticking = setTimeout(tick, 1000 * BUSY_SECONDS);
}

addEventListener("hashchange", () => { $("main").focus(); if (about) route(); });
addEventListener("visibilitychange", () => { if (!document.hidden && about) tick(); });
start();
