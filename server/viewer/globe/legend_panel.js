// The legend, the scale bar and the north arrow.

import {$} from "../page.js";
import {contourInterval, datumText, lengthText, roundLength, ticks} from "./legend.js";
import {ERRORS, FACINGS, gradientOf, heightStops, SLOPES, tintTop, washed} from "./material.js";

const {Cesium} = window;
const NEAR_SEA_M = 5;

function ramp(stops, from, to, values, text) {
  $("legend-ramp").style.backgroundImage = gradientOf(stops);
  $("legend-ticks").replaceChildren(...values.map((value) => {
    const tick = Object.assign(document.createElement("span"), {textContent: text(value)});
    const share = (value - from) / (to - from);
    tick.style.left = `${100 * share}%`;
    if (share < 0.06 || share > 0.94) tick.style.transform = `translateX(${share < 0.5 ? "0" : "-100%"})`; // not beyond the panel
    return tick;
  }));
  let right = -Infinity;
  for (const tick of [...$("legend-ticks").children]) { // none over another
    const box = tick.getBoundingClientRect();
    if (box.left < right + 4) tick.remove();
    else right = box.right;
  }
}

export function showLegend(globe) {
  const {dataset, looks: {mode}} = globe;
  const {low, high, ownDatum, shift, source} = dataset;
  $("legend").hidden = false;
  const errors = mode === "error" && source ? globe.errors : undefined;
  const scaled = mode !== "error" || errors !== undefined;
  $("legend-ramp").hidden = $("legend-ticks").hidden = !scaled;
  if (errors) {
    const {reach, largest} = errors;
    $("legend-title").textContent = `Mesh below and above the source, metres; at most ${Number(largest.toPrecision(2)).toLocaleString("en")} in view, also between posts`;
    ramp(ERRORS, -reach, reach, ticks(-0.95 * reach, 0.95 * reach, 5), (value) => value.toLocaleString("en", {maximumSignificantDigits: 6}).replace("-", "−"));
  } else if (mode === "error" && source) {
    $("legend-title").textContent = "Mesh below and above the source: being measured";
  } else if (mode === "error") {
    $("legend-title").textContent = "The error needs the DEM: these are tiles without it.";
  } else if (mode === "slope") {
    $("legend-title").textContent = "Slope, degrees";
    ramp(SLOPES, 0, 90, [0, 30, 60, 90], String);
  } else if (mode === "aspect") {
    $("legend-title").textContent = "The slope looks towards";
    ramp(FACINGS, 0, 360, [45, 90, 135, 180, 225, 270, 315], (degrees) => ["NE", "E", "SE", "S", "SW", "W", "NW"][degrees / 45 - 1]);
  } else {
    const lines = mode === "contours" ? `; lines every ${lengthText(contourInterval(low, high)).replace(" ", "\u00a0")}` : "";
    $("legend-title").textContent = `Metres ${datumText(ownDatum)}${lines}`;
    const top = tintTop(dataset);
    ramp(washed(heightStops({...dataset, high: top}), mode), low - shift.middle, top - shift.middle, ticks(low - shift.middle, top - shift.middle, 5), (value) => value.toLocaleString("en").replace("-", "−"));
  }
  const kinds = source ? ["no data: hatched", "outside: plain"] : ["outside: plain"];
  if (low < dataset.seaLevel + NEAR_SEA_M || dataset.layer.extensions?.includes("watermask")) kinds.push("water: blue");
  $("legend-kinds").textContent = kinds.join(", ");
}

/// Metres that a pixel is wide in the middle of the picture; undefined in the sky.
function metresAPixel(globe) {
  const {scene, widget: {canvas}} = globe;
  const at = globe.pick(new Cesium.Cartesian2(canvas.clientWidth / 2, canvas.clientHeight / 2));
  if (!at) return undefined;
  const place = Cesium.Cartesian3.fromRadians(at.longitude, at.latitude, at.height);
  return (2 * Cesium.Cartesian3.distance(place, scene.camera.position) * Math.tan(scene.camera.frustum.fovy / 2)) / canvas.clientHeight;
}

export function connectCompass(globe) {
  const {scene} = globe;
  const update = () => {
    $("needle").style.transform = `rotate(${-scene.camera.heading}rad)`;
    const pixel = metresAPixel(globe);
    const metres = pixel && roundLength(110 * pixel);
    $("scale-bar").style.visibility = metres ? "visible" : "hidden";
    if (!metres) return;
    $("scale-bar").style.width = `${metres / pixel}px`;
    $("scale-text").textContent = lengthText(metres);
  };
  scene.camera.moveEnd.addEventListener(update);
  scene.globe.tileLoadProgressEvent.addEventListener((waiting) => waiting === 0 && update());
  $("north").addEventListener("click", () => {
    const canvas = scene.canvas;
    const at = globe.pick(new Cesium.Cartesian2(canvas.clientWidth / 2, canvas.clientHeight / 2));
    if (!at) return (globe.camera = {...globe.camera, heading: 0});
    const target = Cesium.Cartesian3.fromRadians(at.longitude, at.latitude, at.height);
    scene.camera.lookAt(target, new Cesium.HeadingPitchRange(0, scene.camera.pitch, Cesium.Cartesian3.distance(target, scene.camera.position)));
    scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
    update();
  });
}
