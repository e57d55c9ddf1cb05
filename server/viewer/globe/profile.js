// A profile as numbers and as a picture. Samples: [{metres, source?, mesh?, bound?}].

import {lengthText, ticks} from "./legend.js";

/// {climb, fall, ground, worst, outside}: metres up and down (of the source where there is one), length over
/// the ground (undefined with a gap), largest difference, and at how many places it is beyond the bound.
export function profileFigures(samples) {
  let climb = 0, fall = 0, ground = 0, worst, outside = 0;
  samples.forEach(({metres, source, mesh, bound}, i) => {
    if (source !== undefined && mesh !== undefined) {
      worst = Math.max(worst ?? 0, Math.abs(mesh - source));
      if (bound !== undefined && Math.abs(mesh - source) > bound + 0.001) ++outside;
    }
    if (i === 0) return;
    const before = samples[i - 1];
    const height = source ?? mesh, last = before.source ?? before.mesh;
    if (height !== undefined && last !== undefined) {
      climb += Math.max(height - last, 0);
      fall += Math.max(last - height, 0);
    }
    if (mesh === undefined || before.mesh === undefined) ground = undefined;
    else if (ground !== undefined) ground += Math.hypot(metres - before.metres, mesh - before.mesh);
  });
  return {climb, fall, ground, worst, outside};
}

/// Runs of samples that have all of the keys: a gap stays a gap.
export function runs(samples, ...keys) {
  const found = [];
  let run = [];
  for (const sample of samples) {
    if (keys.every((key) => sample[key] !== undefined)) run.push(sample);
    else if (run.length > 0) found.push(run), run = [];
  }
  if (run.length > 0) found.push(run);
  return found;
}

const HIGH = 150, TOP = 8, BOTTOM = 20;
export const LEFT = 64, RIGHT = 8; // beside the curves: room for −10,000 m

/// A picture `wide` pixels wide.
export function profileSvg(samples, wide) {
  const heights = samples.flatMap(({source, mesh, bound = 0}) => [source, mesh, mesh === undefined ? undefined : mesh + bound, mesh === undefined ? undefined : mesh - bound])
    .filter((height) => height !== undefined);
  const [low, high] = heights.length > 0 ? [Math.min(...heights), Math.max(...heights)] : [0, 1];
  const margin = Math.max((high - low) * 0.06, 0.5);
  const length = samples.at(-1).metres || 1;
  const x = (metres) => LEFT + (metres / length) * (wide - LEFT - RIGHT);
  const y = (height) => TOP + ((high + margin - height) / (high - low + 2 * margin)) * (HIGH - TOP - BOTTOM);
  const make = (name, attributes, text) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  };
  const picture = make("svg", {viewBox: `0 0 ${wide} ${HIGH}`, class: "profile", role: "img", "aria-label": "Heights of source and mesh along the line"});
  for (const height of ticks(low - margin, high + margin, 4))
    picture.append(make("line", {x1: LEFT, x2: wide - RIGHT, y1: y(height), y2: y(height), class: "grid"}),
      make("text", {x: LEFT - 4, y: y(height) + 4, "text-anchor": "end"}, `${height.toLocaleString("en").replace("-", "−")} m`));
  for (const at of ticks(0, length, 4)) // none beyond the picture's sides
    picture.append(make("text", {x: x(at), y: HIGH - 5, "text-anchor": at === 0 ? "start" : x(at) > wide - RIGHT - 16 ? "end" : "middle"}, at === 0 ? "0" : lengthText(at)));
  const line = (run, key, sign = 0) => run.map((s) => `${x(s.metres).toFixed(1)},${y(s[key] + sign * (s.bound ?? 0)).toFixed(1)}`);
  for (const run of runs(samples, "mesh", "bound"))
    picture.append(make("polygon", {points: [...line(run, "mesh", 1), ...line(run, "mesh", -1).reverse()].join(" "), class: "bound"}));
  for (const key of ["source", "mesh"])
    for (const run of runs(samples, key)) picture.append(make("polyline", {points: line(run, key).join(" "), class: key}));
  return picture;
}

/// The sample at x pixels of a picture that is `wide`.
export function sampleAt(samples, x, wide) {
  const i = Math.round(((x - LEFT) / (wide - LEFT - RIGHT)) * (samples.length - 1));
  return samples[Math.min(Math.max(i, 0), samples.length - 1)];
}
