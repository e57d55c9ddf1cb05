// A flight over a dataset, with the mesh that POST /refine keeps fit for it. One request is under
// way at a time; each brings what has changed since the last view. From above one sees that the mesh
// is fine only where the camera looks.

import {DEGREE, fitToWindow, FOV, frameAt, Picture, poseOf} from "./picture.js";
import {$, busyFor, chooseDataset, connectKeys, fetchDatasets, foldControls, NoAnswer, say, sayFailed, stillIfAsked, unanswered, whenBack} from "./page.js";
import {lengthText} from "./globe/legend.js";
import {decodeRefinedMesh, RefinedMesh} from "./refined_mesh.js";

const SPEED = 250, LEAST_RADIUS_M = 5000; // metres a second; a smaller circle takes as long as this one
const MOST_POSTS = 600000; // of a window; the server widens it to whole blocks, and takes a million

// ---- the camera

const METRES_PER_DEGREE = 111320;

/// Metres of a circle around the middle of [west, south, east, north], well inside.
const radiusIn = ([west, south, east, north]) =>
  0.3 * METRES_PER_DEGREE * Math.min((east - west) * Math.cos(((south + north) / 2) * DEGREE), north - south);

const speedIn = (bounds) => SPEED * Math.min(radiusIn(bounds) / LEAST_RADIUS_M, 1);

/// On that circle, above most of the ground, looking inwards and down.
function cameraOnCircle({bounds, low, top}, metres) {
  const [west, south, east, north] = bounds;
  const lat = (south + north) / 2, radius = radiusIn(bounds);
  const turn = metres / radius - 2.2;
  return {
    lon: (west + east) / 2 + (radius * Math.sin(turn)) / (METRES_PER_DEGREE * Math.cos(lat * DEGREE)),
    lat: lat + (radius * Math.cos(turn)) / METRES_PER_DEGREE,
    height_m: low + 0.75 * (top - low) + Math.min(400, 0.2 * radius), heading_deg: ((turn / DEGREE + 150) % 360 + 360) % 360, pitch_deg: -13, roll_deg: 0, fov_deg: FOV,
  };
}

/// A part in the middle of a dataset that is too large to be refined as a whole.
function windowOf({box: [west, south, east, north], source: {columns, rows}}) {
  const share = Math.sqrt(MOST_POSTS / (columns * rows));
  if (share >= 1) return undefined;
  const [x, y] = [(west + east) / 2, (south + north) / 2];
  const [dx, dy] = [((east - west) / 2) * share, ((north - south) / 2) * share];
  return [x - dx, y - dy, x + dx, y + dy];
}

// ---- the flight

class Flight {
  mesh = new RefinedMesh();
  metres = 0;
  view = undefined;
  received = 0;
  updates = 0;

  constructor(dataset, picture) {
    this.window = windowOf(dataset);
    const {lowest, highest} = dataset;
    Object.assign(this, {dataset, picture, bounds: this.window ?? dataset.box, low: lowest?.height_m ?? 0, top: highest?.height_m ?? 3000});
    this.url = new URL(`../refine/${encodeURIComponent(dataset.name)}`, document.baseURI);
  }

  get tolerance() {
    return 2 ** Number($("tolerance").value);
  }

  async update() {
    const {canvas} = this.picture;
    const camera = {...cameraOnCircle(this, this.metres), width_px: canvas.width, height_px: canvas.height, tolerance_px: this.tolerance};
    const body = JSON.stringify({camera, ...(this.view ? {view: this.view} : this.window && {window: this.window})});
    const reply = await fetch(this.url, {method: "POST", headers: {"Content-Type": "application/json"}, body}).catch(unanswered);
    if (reply.status === 404 && this.view) return (this.view = undefined); // expired: a whole mesh next
    if (reply.status === 503) return busyFor(reply.headers);
    if (!reply.ok) throw new Error((await reply.json()).detail);
    const delta = decodeRefinedMesh(await reply.arrayBuffer().catch(unanswered));
    this.mesh.apply(delta);
    this.frame ??= frameAt(delta.lon, delta.lat);
    this.view = delta.view;
    this.camera = camera;
    if (delta.whole) {
      this.low = [...this.mesh.vertices.values()].reduce((least, v) => Math.min(least, v[2]), Infinity);
      this.top = [...this.mesh.vertices.values()].reduce((most, v) => Math.max(most, v[2]), this.low + 1);
    }
    if (delta.triangles.length + delta.removedTriangles.length > 0) this.picture.load(this.mesh.positions());
    ++this.updates;
    this.received += delta.bytes;
    $("triangles").textContent = `${this.mesh.triangles.size.toLocaleString("en")} triangles`;
    $("error").textContent = `at most ${this.tolerance.toFixed(1)} px at every post`;
    $("change").textContent = `+${delta.triangles.length.toLocaleString("en")} −${delta.removedTriangles.length.toLocaleString("en")} triangles, ${delta.bytes.toLocaleString("en")} bytes`;
    $("bytes").textContent = `${(this.received / 1e6).toFixed(2)} MB in ${this.updates.toLocaleString("en")} views`;
    $("figures").hidden = false;
  }

  draw() {
    if (!this.camera) return;
    const [west, south, east, north] = this.bounds;
    const size = METRES_PER_DEGREE * Math.max((east - west) * Math.cos(south * DEGREE), north - south);
    const above = {lon: (west + east) / 2, lat: south - 0.25 * (north - south), height_m: this.low + 0.95 * size, heading_deg: 0, pitch_deg: -55};
    const high = $("above").checked;
    const pose = poseOf(high ? above : cameraOnCircle(this, this.metres), this.frame);
    this.picture.draw(pose, {wires: $("wires").checked ? 1 : 0, low: this.low, top: this.top, haze: high ? 1e7 : 1.2 * size, near: Math.min(20, size / 1000)});
  }
}

async function main() {
  const picture = new Picture($("picture"));
  fitToWindow(picture.canvas);
  foldControls();
  stillIfAsked("fly");
  const dems = (await fetchDatasets()).filter(({links, state}) => links.refine && state !== "failed");
  if (dems.length === 0) return say("No DEM is served that can be refined: neither tiles alone nor layers of several DEMs can.");
  const label = () => ($("tolerance-value").textContent = `${(2 ** Number($("tolerance").value)).toFixed(1)} px`);
  $("tolerance").addEventListener("input", label);
  label();
  const tolerance = (step) => {
    $("tolerance").value = Number($("tolerance").value) + step;
    label();
  };
  connectKeys({
    w: () => $("wires").click(), f: () => $("fly").click(), a: () => $("above").click(),
    "+": () => tolerance(-0.25), "=": () => tolerance(-0.25), "-": () => tolerance(0.25),
  });

  let flight;
  window.tind = {get flight() { return flight; }}; // for tests and the browser's console

  let last = performance.now();
  const frame = (now) => {
    if ($("fly").checked && flight?.camera) flight.metres += (speedIn(flight.bounds) * Math.min(now - last, 200)) / 1000;
    last = now;
    flight?.draw();
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);

  await new Promise((chosen) => chooseDataset(dems.map(({name}) => name), (name) => {
    say("Making the dataset ready for refining …");
    flight = new Flight(dems.find((one) => one.name === name), picture);
    $("speed").textContent = lengthText(Number(speedIn(flight.bounds).toPrecision(2)));
    chosen();
  }));
  let refused; // a flight that the daemon does not go on with
  for (;;) {
    const current = flight;
    try {
      if (current !== refused) await current.update();
      if (current.camera && current === flight && current !== refused) say("");
    } catch (error) {
      if (error instanceof NoAnswer) await whenBack();
      else if (current === flight) {
        refused = current;
        say(`It cannot be refined: ${error.message ?? error}.`, [["Try again", () => (refused = undefined)]]);
      }
    }
    await new Promise((resolve) => setTimeout(resolve, 30));
  }
}

main().catch(sayFailed);
