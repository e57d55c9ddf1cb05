// Tools that answer a click on the ground: a profile with source, mesh and bound, a length, an area, a
// line of sight. Escape puts the tool away.

import {$} from "../page.js";
import {elevations} from "./dataset.js";
import {along, geodesic, pathMetres, polygonArea, sightLine} from "./geodesy.js";
import {areaText, datumText, lengthText} from "./legend.js";
import {profileFigures, profileSvg, sampleAt} from "./profile.js";
import {metres} from "./readout.js";
import {drawnTile} from "./tiles.js";

const {Cesium} = window;
const SAMPLES = 401;
const EYE_M = 1.7;

const TOOLS = {
  profile: {title: "Profile", points: 2, say: "where the profile begins and where it ends."},
  distance: {title: "Distance", points: Infinity, say: "along a line."},
  area: {title: "Area", points: Infinity, say: "around an area."},
  sight: {title: "Line of sight", points: 2, say: "where the eye is, and what it looks at."},
};
const POINT = matchMedia("(pointer: coarse)").matches ? "Tap" : "Click";

export class Tools {
  #points = []; // Cartographic
  #turn = 0;

  constructor(globe) {
    this.globe = globe;
    this.lines = globe.scene.primitives.add(new Cesium.PolylineCollection());
    this.marks = globe.scene.primitives.add(new Cesium.PointPrimitiveCollection());
    for (const button of document.querySelectorAll("#tools [data-tool]"))
      button.addEventListener("click", ({detail}) => this.choose(this.tool === button.dataset.tool ? undefined : button.dataset.tool, detail === 0));
    $("result-close").addEventListener("click", () => this.choose(undefined));
  }

  /// `byKey`: the mouse is not at hand, the middle of the picture is pointed at.
  choose(tool, byKey = false) {
    this.tool = tool;
    this.clear();
    for (const button of document.querySelectorAll("#tools [data-tool]"))
      button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    $("result").hidden = !tool;
    const {canvas} = this.globe.scene;
    if (tool) this.#say(TOOLS[tool].title, byKey ? `Move with the arrow keys and press Enter ${TOOLS[tool].say}` : `${POINT} ${TOOLS[tool].say}`);
    canvas.classList.toggle("measuring", Boolean(tool));
    if (tool && byKey) canvas.focus();
  }

  clear() {
    ++this.#turn;
    this.#points = [];
    this.#draw([]);
  }

  /// A click on the ground; true where a tool took it.
  click(place) {
    if (!this.tool || !place) return false;
    if (this.#points.length >= TOOLS[this.tool].points) this.clear();
    this.#points.push(place);
    this.#draw(this.#points, this.tool === "area" && this.#points.length > 2);
    const tool = this.tool;
    this.#measure().catch((error) => tool === this.tool && this.#say(TOOLS[tool].title, `No answer: ${error.message}. ${POINT} again.`));
    return true;
  }

  #say(title, ...content) {
    $("result-title").textContent = title;
    $("result-body").replaceChildren(...content.flatMap((part) => (typeof part === "string" ? [Object.assign(document.createElement("p"), {textContent: part})] : [part])));
  }

  #places() {
    return this.#points.map(({longitude, latitude}) => [longitude, latitude].map(Cesium.Math.toDegrees));
  }

  async #measure() {
    const turn = ++this.#turn;
    const places = this.#places();
    const {title} = TOOLS[this.tool];
    if (this.tool === "area") {
      if (places.length > 2) this.#say(title, `${areaText(polygonArea(places))}, ${lengthText(pathMetres([...places, places[0]]))} around, on the ellipsoid`);
    } else if (places.length > 1) {
      if (this.tool === "distance") return this.#distance(places, turn);
      this.#say(title, "Asking …");
      const samples = await this.#sample(places);
      if (turn !== this.#turn) return;
      if (this.tool === "profile") this.#profile(samples);
      else this.#sight(samples);
    }
  }

  async #distance(places, turn) {
    const {azimuth} = geodesic(places.at(-2), places.at(-1));
    const words = `${lengthText(pathMetres(places))} along the ellipsoid, the last leg towards ${azimuth.toFixed(1)}°`;
    this.#say("Distance", words);
    const samples = await this.#sample(places);
    if (turn !== this.#turn) return;
    const {ground} = profileFigures(samples);
    this.#say("Distance", words, ground === undefined ? "No heights all along it." : `${lengthText(ground)} over the ground, as the mesh has it`);
  }

  #profile(samples) {
    const {climb, fall, worst, outside} = profileFigures(samples);
    const picture = profileSvg(samples, $("result-body").clientWidth);
    const read = ({clientX}) => {
      const {left, width} = picture.getBoundingClientRect();
      const sample = sampleAt(samples, clientX - left, width);
      this.#mark(sample);
      const said = [["source", sample.source], ["mesh", sample.mesh]].filter(([, height]) => height !== undefined);
      $("result-at").textContent = `${lengthText(sample.metres)}: ${said.map(([name, height]) => `${name} ${metres(height)}`).join(", ") || "no height"}`;
    };
    for (const event of ["pointerdown", "pointermove"]) picture.addEventListener(event, read);
    const at = Object.assign(document.createElement("p"), {id: "result-at", textContent: "Point at the profile to read it."});
    const off = worst === undefined ? [] : [`The mesh of level ${this.level} and the source differ by ${metres(worst, 2)} at most here` +
      (outside > 0 ? `; at ${outside} of ${samples.length} places by more than the bound, which holds at posts.` : ", within the bound everywhere.")];
    this.#say(`Profile, ${datumText(this.globe.dataset.ownDatum)}`, picture, at, `${lengthText(samples.at(-1).metres)}, up ${metres(climb, 0)}, down ${metres(fall, 0)}.`, ...off);
  }

  #sight(samples) {
    const profile = samples.map(({metres: length, source, mesh}) => ({metres: length, height: source ?? mesh}));
    if (profile[0].height === undefined) return this.#say("Line of sight", "There is no height where the eye is.");
    const seen = sightLine(profile, EYE_M);
    this.#drawSight(samples, seen);
    const known = seen.filter((one) => one !== undefined).length;
    const share = Math.round((100 * seen.filter((one) => one === true).length) / known);
    const end = seen.at(-1) === undefined ? "At the end there is no height." : seen.at(-1) ? "The end is seen." : "The end is hidden.";
    this.#say("Line of sight", end, `From ${EYE_M} m above the ground, ${share} % of ${lengthText(samples.at(-1).metres)} is seen; the earth's curve and usual refraction are in it.`);
  }

  /// Source, mesh and its bound at places along a path, heights as the DEM counts them; the mesh is that of the finest
  /// level that is drawn along it, which `this.level` then is.
  async #sample(places) {
    const samples = along(places, SAMPLES);
    const {scene, dataset, deepest} = this.globe;
    const drawn = samples.map(({lon, lat}) => drawnTile(scene, Cesium.Cartographic.fromDegrees(lon, lat))?.z).filter((z) => z !== undefined);
    this.level = drawn.length > 0 ? Math.max(...drawn) : deepest;
    const [source, mesh] = await Promise.all([
      dataset.kind === "dem" ? elevations(dataset, samples) : undefined, elevations(dataset, samples, this.level)]);
    samples.forEach((sample, i) => {
      const shift = dataset.shift.at(sample.lon, sample.lat);
      if (source?.coverage[i] === "value") sample.source = source.height_m[i] - shift;
      if (mesh.coverage[i] === "value") Object.assign(sample, {mesh: mesh.height_m[i] - shift, bound: mesh.max_error_m[i] ?? undefined});
    });
    return samples;
  }

  // ---- on the globe

  /// Just above the drawn ground.
  #over({lon, lat}) {
    const {scene, dataset} = this.globe;
    const place = Cesium.Cartographic.fromDegrees(lon, lat);
    const height = scene.globe.getHeight(place) ?? dataset.high;
    return Cesium.Cartesian3.fromDegrees(lon, lat, height + 0.002 * dataset.extent ** 0.8);
  }

  #line(places, colour) {
    const material = Cesium.Material.fromType("Color", {color: Cesium.Color.fromCssColorString(colour)});
    this.lines.add({positions: places.map((place) => this.#over(place)), width: 3, material});
  }

  #draw(points, closed = false) {
    this.lines.removeAll();
    this.marks.removeAll();
    const places = points.map(({longitude, latitude}) => [longitude, latitude].map(Cesium.Math.toDegrees));
    for (const [lon, lat] of places)
      this.marks.add({position: this.#over({lon, lat}), pixelSize: 9, color: Cesium.Color.WHITE, outlineColor: Cesium.Color.fromCssColorString("#b3261e"), outlineWidth: 3, disableDepthTestDistance: Infinity});
    if (places.length > 1) this.#line(along(closed ? [...places, places[0]] : places, SAMPLES), "#b3261e");
    this.globe.scene.requestRender();
  }

  #drawSight(samples, seen) {
    this.lines.removeAll();
    for (let from = 0, i = 1; i < samples.length; ++i) {
      if (i + 1 < samples.length && seen[i + 1] === seen[i]) continue;
      if (seen[i] !== undefined) this.#line(samples.slice(from, i + 1), seen[i] ? "#2e7d32" : "#b3261e");
      from = i;
    }
    this.globe.scene.requestRender();
  }

  #mark(sample) {
    if (this.cursor) this.marks.remove(this.cursor);
    this.cursor = this.marks.add({position: this.#over(sample), pixelSize: 8, color: Cesium.Color.fromCssColorString("#1d2733"), disableDepthTestDistance: Infinity});
    this.globe.scene.requestRender();
  }
}
