"use strict";
// The figure of conductivity over the density, or another quantity: bands of confidence, means with marks, and models as dashed lines.

const SVG = "http://www.w3.org/2000/svg";
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#b65c93", "#c58a00", "#3a93c9"]; // told apart by the colour-blind
const DASHES = ["7 4", "2 3", "10 3 2 3", "5 2", "1 4", "12 5"];
const LEFT = 70, RIGHT = 20, TOP = 16, BOTTOM = 52;

function draw(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

// Steps of 1, 2 or 5 times a power of ten, about `wanted` of them.
function ticks(low, high, wanted) {
  const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(factor => factor * power).find(size => size >= raw);
  const first = Math.ceil(low / step - 1e-9);
  const values = [];
  for (let i = first; i * step <= high + 1e-9 * step; i++) values.push(i * step);
  return { values, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

function range(values, margin, fallback) {
  const finite = values.filter(value => value !== null);
  if (!finite.length) return [0, 1];
  const low = Math.min(...finite), high = Math.max(...finite);
  const more = high > low ? margin * (high - low) : fallback * Math.abs(high) || 0.5;
  return [low - more, high + more];
}

const FAR = 3; // heights of the simulation that the figure grows by, at most, for the sake of a model

// The vertical range: the simulation, and every drawn model that does not make it too small to be read.
function upright(curve, models, across) {
  const all = curve.series.flatMap(s => [...s.mean, ...s.low, ...s.high]).filter(value => value !== null);
  const low = Math.min(...all), high = Math.max(...all), room = FAR * (Math.max(high - low, 0.2 * Math.abs(high)) || 1);
  for (const model of models) {
    const values = seen(model, across).flat();
    if (values.every(value => value > low - room && value < high + room)) all.push(...values);
  }
  return range(all, 0.07, 0.2);
}

// What each curve of a model has between the ends of the horizontal axis.
function seen(model, across) {
  return model.curves.map(values => values.filter((value, i) =>
    value !== null && model.at[i] !== null && model.at[i] >= across[0] && model.at[i] <= across[1]));
}

// An arrow and the value where a model leaves the picture: at its right end, or else where it is farthest away.
function outside(model, across, up) {
  const curves = seen(model, across).filter(values => values.length), beyond = value => Math.max(value - up[1], up[0] - value);
  const farthest = values => values.reduce((a, b) => beyond(b) > beyond(a) ? b : a, up[0]);
  const end = farthest(curves.map(values => values[values.length - 1]));
  const value = beyond(end) > 0 ? end : farthest(curves.flat());
  return beyond(value) > 0 ? ` ${value > up[1] ? "\u2191" : "\u2193"} ${Number(value.toPrecision(3))}` : "";
}

function mark(shape, x, y, colour) {
  const size = 4.6, common = { fill: colour, stroke: "none" };
  if (shape % 4 === 0) return draw("circle", { cx: x, cy: y, r: size, ...common });
  if (shape % 4 === 1) return draw("rect", { x: x - size, y: y - size, width: 2 * size, height: 2 * size, ...common });
  const d = shape % 4 === 2
    ? `M${x} ${y - 1.3 * size}L${x + 1.2 * size} ${y + size}L${x - 1.2 * size} ${y + size}Z`
    : `M${x} ${y - 1.4 * size}L${x + 1.4 * size} ${y}L${x} ${y + 1.4 * size}L${x - 1.4 * size} ${y}Z`;
  return draw("path", { d, ...common });
}

const seriesName = series => series.name || "simulation";

// Colour and shape of every curve: one colour for each contact angle (or for each value of the first quantity that has
// several), and a shape for the rest.
function looksOf(series) {
  const values = series.map(one => one.values || {}), names = Object.keys(values[0] || {});
  const several = names.filter(name => new Set(values.map(one => one[name])).size > 1);
  const first = several.includes("contact_angle") ? "contact_angle" : several[0];
  const others = one => JSON.stringify(several.filter(name => name !== first).map(name => one[name]));
  const groups = [...new Set(values.map(one => one[first]))], shapes = [...new Set(values.map(others))];
  return values.map((one, number) => {
    const group = first === undefined ? number : groups.indexOf(one[first]);
    return { colour: COLOURS[group % COLOURS.length],
      shape: first === undefined ? number : shapes.indexOf(others(one)) + (shapes.length > 1 ? 0 : group) };
  });
}

// How many packings a point is the mean of, in words: "4", or "3 to 4" where the points differ.
function packingsPerPoint(curve) {
  const counts = curve.series.flatMap(one => one.count).filter(count => count > 0);
  if (!counts.length) return "0";
  const few = Math.min(...counts), many = Math.max(...counts);
  return few === many ? String(many) : `${few} to ${many}`;
}

// Runs of neighbouring points for which all the given values are there.
function runs(places, ...lists) {
  const found = [[]];
  places.forEach((x, i) => {
    if (x !== null && lists.every(list => list[i] !== null)) found[found.length - 1].push(i);
    else if (found[found.length - 1].length) found.push([]);
  });
  return found.filter(run => run.length);
}

// Answers the SVG and the entries of its legend; a narrow page gets a narrow figure, whose letters stay readable.
function figure(curve, shownModels, room) {
  const WIDTH = room < 600 ? Math.max(340, Math.round(room)) : 900, HEIGHT = room < 600 ? 380 : 470;
  const places = curve.along.values, across = range(places, 0.04, 0.05);
  const drawn = curve.models.filter(model => shownModels.has(model.name));
  const up = upright(curve, drawn, across);
  const X = x => LEFT + (x - across[0]) / (across[1] - across[0]) * (WIDTH - LEFT - RIGHT);
  const Y = y => HEIGHT - BOTTOM - (y - up[0]) / (up[1] - up[0]) * (HEIGHT - TOP - BOTTOM);
  const at = (x, y) => `${X(x).toFixed(2)} ${Y(y).toFixed(2)}`;
  const level = Math.round(100 * curve.confidence);
  const svg = draw("svg", { class: "curve", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img",
    "aria-label": `Effective conductivity over ${curve.along.title} with ${level} % confidence bands; the values are in the table below` });
  const clip = draw("clipPath", { id: "plot" },
    draw("rect", { x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM }));
  svg.append(draw("defs", {}, clip));
  const horizontal = ticks(...across, WIDTH / 130), vertical = ticks(...up, 6);
  for (const x of horizontal.values) {
    svg.append(draw("line", { class: "grid", x1: X(x), x2: X(x), y1: TOP, y2: HEIGHT - BOTTOM }),
      draw("text", { x: X(x), y: HEIGHT - BOTTOM + 20, "text-anchor": "middle" }, x.toFixed(horizontal.digits)));
  }
  for (const y of vertical.values) {
    svg.append(draw("line", { class: "grid", x1: LEFT, x2: WIDTH - RIGHT, y1: Y(y), y2: Y(y) }),
      draw("text", { x: LEFT - 9, y: Y(y) + 4, "text-anchor": "end" }, y.toFixed(vertical.digits)));
  }
  svg.append(draw("rect", { class: "frame", x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM }),
    draw("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 10, "text-anchor": "middle" }, curve.along.title),
    draw("text", { x: 0, y: 0, transform: `translate(18 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)`, "text-anchor": "middle" },
      "effective conductivity [W/(m K)]"));
  const plot = draw("g", { "clip-path": "url(#plot)" });
  svg.append(plot);
  const legend = [];
  drawn.forEach((model, number) => {
    const dash = DASHES[number % DASHES.length];
    for (const values of model.curves) {
      for (const run of runs(model.at, values)) {
        const d = "M" + run.map(i => at(model.at[i], values[i])).join("L");
        plot.append(draw("path", { class: "model", d, "stroke-dasharray": dash }));
      }
    }
    const sample = draw("path", { class: "model", d: "M1 7H33", "stroke-dasharray": dash });
    legend.push([model.title + outside(model, across, up), draw("svg", { class: "curve", viewBox: "0 0 34 14", "aria-hidden": "true" }, sample)]);
  });
  const looks = looksOf(curve.series);
  curve.series.forEach((series, number) => {
    const { colour, shape } = looks[number], name = seriesName(series);
    for (const run of runs(places, series.low, series.high)) {
      const low = run.map(i => at(places[i], series.low[i]));
      const high = run.map(i => at(places[i], series.high[i])).reverse();
      const d = `M${[...low, ...high].join("L")}Z`;
      plot.append(draw("path", { class: "band", d, fill: colour, "fill-opacity": 0.17, stroke: "none" }));
    }
    for (const run of runs(places, series.mean)) {
      const d = "M" + run.map(i => at(places[i], series.mean[i])).join("L");
      plot.append(draw("path", { d, fill: "none", stroke: colour, "stroke-width": 1.8 }));
      for (const i of run) {
        const x = X(places[i]);
        if (series.low[i] !== null) {
          const y1 = Y(series.low[i]), y2 = Y(series.high[i]);
          plot.append(draw("path", { class: "bar", d: `M${x - 4} ${y1}h8M${x - 4} ${y2}h8M${x} ${y1}V${y2}`, stroke: colour, fill: "none" }));
        }
        const point = mark(shape, x, Y(series.mean[i]), colour);
        const width = series.low[i] === null ? "" : ` ± ${(0.5 * (series.high[i] - series.low[i])).toPrecision(2)}`;
        point.append(draw("title", {}, `${name}: ${series.mean[i].toPrecision(4)}${width}, ${series.count[i]} realizations`));
        plot.append(point);
      }
    }
    const sample = draw("svg", { viewBox: "0 0 34 14", "aria-hidden": "true" },
      draw("path", { d: "M1 7H33", stroke: colour, "stroke-width": 2 }), mark(shape, 17, 7, colour));
    legend.splice(number, 0, [name, sample]);
  });
  return { svg, legend };
}
