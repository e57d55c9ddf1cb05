// Tiles as they arrive from /progressive: every byte refines them. The slider moves all of them
// between coarse and fine; or each is as fine as its distance needs, and fits its neighbours all the
// same, because a stream never touches the border of its tile.

import {$, busyFor, chooseDataset, connectKeys, fetchDatasets, fetchJson, foldControls, isPhone, NoAnswer, say, sayFailed, stillIfAsked, unanswered, whenBack} from "./page.js";
import {cross, DEGREE, dot, fitToWindow, FOV, frameAt, Picture, sum} from "./picture.js";
import {Geomorph, ProgressiveMesh, toCrs} from "./progressive_mesh.js";
import {TpmStream} from "./tpm.js";

const DEEPEST_COARSE_LEVEL = 6; // coarser tiles are too round to be looked at like a landscape
const HYSTERESIS = 0.25; // of the distance, before a coarser state is taken: docs/guide.md
const CATCH_UP_S = 0.5; // half of the way to where a mesh should be takes at most so long
const SLOWEST = 20; // splits a second

// ---- one tile

class Tile {
  stream = new TpmStream();
  mesh = undefined;
  size = undefined; // of the stream, bytes
  shown = 0; // splits; on the way from one to the next it is no whole number
  soup = new Float32Array(0); // nine numbers a triangle
  errorM = Infinity;
  #way; // from coarse to what has arrived
  #drawn = -1;

  constructor(url) {
    this.url = url;
  }
  get done() {
    return this.stream.complete;
  }

  /// The next `portion` bytes (0: all that are left). False when the tile is not to be had.
  async receive(portion, signal) {
    const from = this.stream.bytes;
    const headers = portion > 0 ? {Range: `bytes=${from}-${from + portion - 1}`} : from > 0 ? {Range: `bytes=${from}-`} : {};
    const reply = await fetch(this.url, {headers, signal}).catch(unanswered);
    if (reply.status === 503) return busyFor(reply.headers).then(() => true);
    if (reply.status === 404) return false;
    if (!reply.ok) throw new Error((await reply.json()).detail);
    if (from > 0 && reply.status !== 206) throw new Error("the server sent a tile from the beginning again");
    this.size = Number(reply.headers.get("content-range")?.split("/")[1] ?? reply.headers.get("content-length"));
    for (const reader = reply.body.getReader(); ; ) {
      const {value, done} = await reader.read().catch(unanswered);
      if (done) return true;
      if (!this.stream.feed(value)) continue;
      this.mesh ??= new ProgressiveMesh(this.stream);
      this.#way = undefined;
      this.#drawn = -1;
    }
  }

  /// Moves `shown` towards `goal`. True when there is something new to draw, in `frame`.
  advance(goal, seconds, frame) {
    if (!this.mesh) return false;
    const step = (goal - this.shown) * (1 - 2 ** (-seconds / CATCH_UP_S)) + Math.sign(goal - this.shown) * SLOWEST * seconds;
    this.shown = Math.abs(step) >= Math.abs(goal - this.shown) ? goal : this.shown + step;
    if (this.shown === this.#drawn) return false;
    this.#way ??= new Geomorph(this.mesh, 0, this.stream.splits);
    const lattice = this.#way.at(this.stream.splits > 0 ? this.shown / this.stream.splits : 0);
    this.soup = soupOf(this.mesh.triangles(), toCrs(this.stream.header, lattice), frame);
    this.errorM = this.stream.errorAfter(this.#way.begin);
    this.#drawn = this.shown;
    return true;
  }

  /// The state for an error: finer at once where it must be, coarser only when there is room.
  stateFor(errorM) {
    const needed = this.mesh.splitsForError(errorM);
    const allowed = this.mesh.splitsForError(errorM / (1 + HYSTERESIS));
    return Math.min(Math.max(this.shown, needed), allowed);
  }
}

/// Longitude, latitude and height of each corner to metres in a frame.
function soupOf(triangles, places, frame) {
  const local = new Float64Array(places.length);
  for (let i = 0; i < places.length; i += 3) {
    const {origin} = frameAt(places[i], places[i + 1], places[i + 2]);
    const away = [origin[0] - frame.origin[0], origin[1] - frame.origin[1], origin[2] - frame.origin[2]];
    local[i] = dot(away, frame.east);
    local[i + 1] = dot(away, frame.north);
    local[i + 2] = dot(away, frame.up);
  }
  const soup = new Float32Array(3 * triangles.length);
  triangles.forEach((v, i) => soup.set(local.subarray(3 * v, 3 * v + 3), 3 * i));
  return soup;
}

// ---- a block of tiles around the middle of a dataset

class View {
  tiles = [];
  frame = undefined;
  top = 1;
  still = 0; // frames in a row in which nothing changed
  #stop = new AbortController();

  constructor(dataset, layer, level, reach) {
    const [west, south, east, north] = dataset.box;
    this.degrees = 180 / 2 ** level;
    const columns = 2 ** (level + 1);
    const middle = [Math.floor((((west + east) / 2 + 180) % 360) / this.degrees), Math.floor(((south + north) / 2 + 90) / this.degrees)];
    // Of layers the deepest levels are not all over the box: the tile that is nearest to its middle.
    const ranges = layer.available[level];
    const near = (v, first, last) => Math.min(Math.max(v, first), last);
    const distance = ([x, y]) => Math.hypot(x - middle[0], y - middle[1]);
    const [x, y] = ranges.map((r) => [near(middle[0], r.startX, r.endX), near(middle[1], r.startY, r.endY)]).reduce((a, b) => (distance(b) < distance(a) ? b : a), [Infinity, Infinity]);
    const exists = (x, y) => ranges.some((r) => x >= r.startX && x <= r.endX && y >= r.startY && y <= r.endY);
    for (let dy = -reach; dy <= reach; ++dy)
      for (let dx = -reach; dx <= reach; ++dx) {
        const column = (x + dx + columns) % columns; // around the globe
        if (exists(column, y + dy)) this.tiles.push(new Tile(new URL(`../progressive/${encodeURIComponent(dataset.name)}/${level}/${column}/${y + dy}`, document.baseURI)));
      }
    this.frame = frameAt((x + 0.5) * this.degrees - 180, (y + 0.5) * this.degrees - 90);
    this.metres = (2 * reach + 1) * this.degrees * 111320;
  }

  close() {
    this.#stop.abort();
  }

  /// In turn a portion for each tile, at the speed of the link.
  async receive() {
    let due = performance.now();
    while (this.tiles.some((tile) => !tile.done)) {
      for (const tile of this.tiles.filter((tile) => !tile.done)) {
        const link = Number($("link").value);
        const portion = link > 0 ? Math.max(128, Math.round(link / 8 / 30)) : 0;
        if (!(await tile.receive(portion, this.#stop.signal))) this.tiles.splice(this.tiles.indexOf(tile), 1);
        if (link > 0) due = Math.max(performance.now(), due + (8000 * portion) / link);
        const wait = due - performance.now();
        if (wait > 1) await new Promise((resolve) => setTimeout(resolve, wait));
        if (this.#stop.signal.aborted) return;
      }
    }
  }

  /// Where each tile should be, and towards it. True when anything has changed.
  advance(pose, pixels, seconds) {
    let changed = false;
    for (const tile of this.tiles) {
      if (!tile.mesh) continue;
      const goal = $("by-distance").checked
        ? tile.stateFor((2 ** Number($("tolerance").value) * this.#distance(tile, pose.eye)) / pixels)
        : Number($("detail").value) ** 2 * tile.stream.header.totalSplits;
      changed = tile.advance(Math.min(goal, tile.stream.splits), seconds, this.frame) || changed;
    }
    this.still = changed ? 0 : this.still + 1;
    return changed;
  }

  #distance(tile, eye) {
    let nearest = Infinity;
    for (let i = 0; i < tile.soup.length; i += 9)
      nearest = Math.min(nearest, Math.hypot(tile.soup[i] - eye[0], tile.soup[i + 1] - eye[1], tile.soup[i + 2] - eye[2]));
    return Number.isFinite(nearest) ? nearest : this.metres;
  }

  soup() {
    const out = new Float32Array(this.tiles.reduce((sum, {soup}) => sum + soup.length, 0));
    let at = 0;
    let [low, high] = [Infinity, -Infinity];
    for (const {soup} of this.tiles) {
      out.set(soup, at);
      at += soup.length;
      for (let i = 2; i < soup.length; i += 3) [low, high] = [Math.min(low, soup[i]), Math.max(high, soup[i])];
    }
    if (low <= high) [this.low, this.top] = [low, high];
    return out;
  }

  get figures() {
    const known = this.tiles.filter(({mesh}) => mesh);
    const total = (pick, tiles = known) => tiles.reduce((sum, tile) => sum + pick(tile), 0);
    return {
      tiles: known.length,
      triangles: total(({soup}) => soup.length / 9),
      finest: total(({stream: {header}}) => header.baseTriangles + 2 * header.totalSplits),
      errorM: Math.max(...known.map(({errorM}) => errorM)),
      bytes: total(({stream}) => stream.bytes, this.tiles),
      size: total(({size}) => size ?? 0, this.tiles),
      done: this.tiles.every(({done}) => done),
    };
  }
}

// ---- the camera: around the middle

class Orbit {
  heading = -0.5;
  pitch = -0.5;
  zoom = 1;

  #fingers = new Map(); // by pointer: where it is

  constructor(canvas) {
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#fingers.set(event.pointerId, event);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, ({pointerId}) => this.#fingers.delete(pointerId));
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.nearer(1.0015 ** event.deltaY);
    }, {passive: false});
  }

  /// One finger turns, two bring it nearer.
  #move(event) {
    const before = this.#fingers.get(event.pointerId);
    if (!before) return;
    const [other] = [...this.#fingers.values()].filter(({pointerId}) => pointerId !== event.pointerId);
    const apart = (finger) => Math.max(Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY), 1);
    if (other) this.nearer(apart(before) / apart(event));
    else this.turn((event.clientX - before.clientX) / 250, (before.clientY - event.clientY) / 250);
    this.#fingers.set(event.pointerId, event);
  }

  nearer(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.12), 4);
  }

  turn(heading, pitch) {
    this.heading += heading;
    this.pitch = Math.min(Math.max(this.pitch + pitch, -1.55), -0.08);
  }

  /// `metres` across, seen around `height`.
  pose(metres, height) {
    const [h, p] = [this.heading, this.pitch];
    const ahead = [Math.sin(h) * Math.cos(p), Math.cos(h) * Math.cos(p), Math.sin(p)];
    const right = [Math.cos(h), -Math.sin(h), 0];
    this.distance = 1.45 * metres * this.zoom;
    return {eye: sum([1, [0, 0, height]], [-this.distance, ahead]), ahead, right, up: cross(right, ahead)};
  }
}

// ---- the page

const number = (value) => Math.round(value).toLocaleString("en");
const metres = (value) => (Number.isFinite(value) ? `${value < 10 ? value.toFixed(2) : value.toFixed(1)} m` : "not known yet");
const size = (bytes) => (bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(2)} MB`);

function showFigures({tiles, triangles, finest, errorM, bytes, size: all, done}) {
  $("figures").hidden = tiles === 0;
  $("triangles").textContent = `${number(triangles)} of ${number(finest)} triangles`;
  $("error").textContent = Number.isFinite(errorM) ? `at most ${metres(errorM)} at every post` : metres(errorM);
  $("bytes").textContent = done ? `${size(bytes)}, all of it` : `${size(bytes)} of ${size(all)}`;
  $("arrived").firstElementChild.style.width = `${all > 0 ? (100 * bytes) / all : 0}%`;
}

function labels() {
  $("detail-row").hidden = $("by-distance").checked;
  $("tolerance-row").hidden = !$("by-distance").checked;
  $("detail-value").textContent = `${Math.round(100 * Number($("detail").value) ** 2)} %`;
  $("tolerance-value").textContent = `${(2 ** Number($("tolerance").value)).toFixed(1)} px`;
}

/// In the middle of what the panel leaves free.
const middleBesideControls = () => (isPhone() || !$("controls").open ? 0 : $("controls").getBoundingClientRect().right / window.innerWidth);

async function main() {
  const picture = new Picture($("picture"));
  fitToWindow(picture.canvas);
  const orbit = new Orbit(picture.canvas);
  foldControls();
  stillIfAsked("turn");
  const datasets = (await fetchDatasets()).filter(({links, state}) => links.progressive && state !== "failed");
  if (datasets.length === 0) return say("No dataset with tiles is served. Start again with a DEM: tind serve dem.tif");
  const asked = new URLSearchParams(location.search);
  if (asked.has("link")) $("link").value = asked.get("link");
  for (const id of ["detail", "tolerance", "by-distance"]) $(id).addEventListener("input", labels);
  labels();
  connectKeys({
    ArrowLeft: () => orbit.turn(-0.08, 0), ArrowRight: () => orbit.turn(0.08, 0), ArrowUp: () => orbit.turn(0, -0.08), ArrowDown: () => orbit.turn(0, 0.08),
    "+": () => orbit.nearer(0.9), "=": () => orbit.nearer(0.9), "-": () => orbit.nearer(1.1),
    w: () => $("wires").click(), t: () => $("turn").click(), a: () => $("again").click(), d: () => $("by-distance").click(),
  });

  let view;
  let layer;
  const dataset = () => datasets.find(({name}) => name === $("dataset").value);
  const open = () => {
    view?.close();
    const opened = (view = new View(dataset(), layer, Number($("level").value), Number($("count").value)));
    picture.load(new Float32Array(0));
    say("Making the first tile …");
    opened.receive().catch(async (error) => {
      if (opened !== view || error.name === "AbortError") return;
      if (!(error instanceof NoAnswer)) return say(`This cannot be shown: ${error.message ?? error}`, [["Send again", open]]);
      await whenBack();
      if (opened === view) open();
    });
  };
  const openDataset = async () => {
    const chosen = dataset();
    layer = await fetchJson(new URL(`../terrain/${encodeURIComponent(chosen.name)}/layer.json`, document.baseURI));
    const deepest = chosen.max_level;
    const first = Math.min(deepest, Math.max(chosen.min_level, DEEPEST_COARSE_LEVEL));
    const levels = Array.from({length: deepest - first + 1}, (_, i) => first + i);
    const wanted = Number(asked.get("level") ?? deepest);
    $("level").replaceChildren(...levels.map((z) => new Option(z, z, false, z === wanted)));
    open();
  };
  await new Promise((chosen, failed) => chooseDataset(datasets.map(({name}) => name), () => openDataset().then(chosen, failed)));
  for (const id of ["level", "count"]) $(id).addEventListener("change", open);
  $("again").addEventListener("click", open);
  window.tind = {get view() { return view; }, orbit}; // for tests and the browser's console

  let last = performance.now();
  const frame = (now) => {
    const seconds = Math.min(now - last, 200) / 1000;
    last = now;
    if ($("turn").checked) orbit.heading += 0.12 * seconds;
    const pose = orbit.pose(view.metres, ((view.low ?? 0) + view.top) / 2);
    const pixels = picture.canvas.width / 2 / Math.tan((FOV * DEGREE) / 2);
    if (view.advance(pose, pixels, seconds)) {
      picture.load(view.soup());
      say("");
    }
    showFigures(view.figures);
    picture.draw(pose, {wires: $("wires").checked ? 0.7 : 0, low: view.low ?? 0, top: view.top, haze: 1e9, middle: middleBesideControls(), near: orbit.distance / 100, far: 10 * orbit.distance});
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

main().catch(sayFailed);
