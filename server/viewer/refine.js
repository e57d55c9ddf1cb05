// A flight over a dataset, with the mesh that POST /refine keeps fit for it. One request is under
// way at a time; each brings what has changed since the last view. From above one sees that the mesh
// is fine only where the camera looks.

import {decodeRefinedMesh, RefinedMesh} from "./refined_mesh.js";

const $ = (id) => document.getElementById(id);
const DEGREE = Math.PI / 180;
const SPEED = 250;
const FOV = 60;

function say(text) {
  $("message").textContent = text;
  $("message").hidden = text === "";
}

// ---- the earth and the camera

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const sum = (...terms) => terms.reduce((v, [s, w]) => v.map((x, i) => x + s * w[i]), [0, 0, 0]);

/// Origin and axes (east, north, up) of a place, earth-centred (WGS84).
function frameAt(lon, lat, height = 0) {
  const [sl, cl, sp, cp] = [Math.sin(lon * DEGREE), Math.cos(lon * DEGREE), Math.sin(lat * DEGREE), Math.cos(lat * DEGREE)];
  const e2 = 6.69437999014e-3;
  const n = 6378137 / Math.sqrt(1 - e2 * sp * sp);
  return {
    origin: [(n + height) * cp * cl, (n + height) * cp * sl, (n * (1 - e2) + height) * sp],
    east: [-sl, cl, 0], north: [-sp * cl, -sp * sl, cp], up: [cp * cl, cp * sl, sp],
  };
}

/// Eye and axes of a camera in a dataset's frame.
function poseOf(camera, frame) {
  const here = frameAt(camera.lon, camera.lat, camera.height_m);
  const local = (v) => [dot(v, frame.east), dot(v, frame.north), dot(v, frame.up)];
  const [h, p] = [camera.heading_deg * DEGREE, camera.pitch_deg * DEGREE];
  const flat = sum([Math.cos(h), here.north], [Math.sin(h), here.east]);
  const ahead = local(sum([Math.cos(p), flat], [Math.sin(p), here.up]));
  const right = local(sum([Math.cos(h), here.east], [-Math.sin(h), here.north]));
  return {eye: local(sum([1, here.origin], [-1, frame.origin])), ahead, right, up: cross(right, ahead)};
}

/// A circle around the middle, above everything, looking inwards and down.
function cameraOnCircle({bounds, top}, metres) {
  const [west, south, east, north] = bounds;
  const lat = (south + north) / 2;
  const perDegree = 111320;
  const radius = 0.3 * perDegree * Math.min((east - west) * Math.cos(lat * DEGREE), north - south);
  const turn = metres / radius - 2.2;
  return {
    lon: (west + east) / 2 + (radius * Math.sin(turn)) / (perDegree * Math.cos(lat * DEGREE)),
    lat: lat + (radius * Math.cos(turn)) / perDegree,
    height_m: 0.75 * top + 400, heading_deg: ((turn / DEGREE + 150) % 360 + 360) % 360, pitch_deg: -13, roll_deg: 0, fov_deg: FOV,
  };
}

// ---- drawing

const VERTEX = `#version 300 es
  in vec3 position;
  uniform vec3 eye, right, up, ahead;
  uniform vec2 lens, depths;
  out vec3 ground, edge;
  void main() {
    vec3 v = position - eye;
    float z = dot(v, ahead);
    ground = position;
    edge = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
    gl_Position = vec4(dot(v, right) * lens.x, dot(v, up) * lens.y, z * depths.x - depths.y, z);
  }`;
const FRAGMENT = `#version 300 es
  precision highp float;
  in vec3 ground, edge;
  uniform vec3 eye;
  uniform float wires, top, haze;
  out vec4 colour;
  void main() {
    vec3 normal = normalize(cross(dFdx(ground), dFdy(ground)));
    normal *= sign(normal.z);
    float light = 0.3 + 0.8 * max(0.0, dot(normal, normalize(vec3(-0.5, 0.5, 0.62))));
    float high = clamp(ground.z / top, 0.0, 1.0);
    vec3 paper = high < 0.45 ? mix(vec3(0.56, 0.66, 0.52), vec3(0.79, 0.75, 0.63), high / 0.45)
                             : mix(vec3(0.79, 0.75, 0.63), vec3(0.98), (high - 0.45) / 0.55);
    vec3 lit = paper * light;
    vec3 width = fwidth(edge);
    vec3 inside = smoothstep(width * 0.4, width * 1.5, edge);
    float line = 1.0 - min(inside.x, min(inside.y, inside.z));
    float small = max(width.x, max(width.y, width.z));
    lit = mix(lit, vec3(0.10, 0.22, 0.36), wires * line * clamp(1.1 - small, 0.25, 0.6));
    colour = vec4(mix(lit, vec3(0.86, 0.91, 0.94), 1.0 - exp(-length(ground - eye) / haze)), 1.0);
  }`;

class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = (this.gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true}));
    if (!gl) throw new Error("this browser has no WebGL 2");
    const program = (this.program = gl.createProgram());
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    const at = gl.getAttribLocation(program, "position");
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.86, 0.91, 0.94, 1);
    this.vertices = 0;
  }

  load(positions) {
    this.gl.bufferData(this.gl.ARRAY_BUFFER, positions, this.gl.DYNAMIC_DRAW);
    this.vertices = positions.length / 3;
  }

  draw(pose, {wires, top, haze}) {
    const {gl, canvas, program} = this;
    const set = (name, ...values) => gl[`uniform${values.length}f`](gl.getUniformLocation(program, name), ...values);
    const focal = 1 / Math.tan((FOV * DEGREE) / 2);
    const [near, far] = [20, 400000];
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const axis of ["eye", "right", "up", "ahead"]) set(axis, ...pose[axis]);
    set("lens", focal, (focal * canvas.width) / canvas.height);
    set("depths", (far + near) / (far - near), (2 * far * near) / (far - near));
    set("wires", wires ? 1 : 0);
    set("top", top);
    set("haze", haze);
    gl.drawArrays(gl.TRIANGLES, 0, this.vertices);
  }
}

// ---- the flight

class Flight {
  mesh = new RefinedMesh();
  metres = 0;
  view = undefined;
  received = 0;
  updates = 0;

  constructor(dataset, picture) {
    Object.assign(this, {dataset, picture, bounds: dataset.bounds, top: 3000});
    this.url = new URL(`../refine/${encodeURIComponent(dataset.name)}`, document.baseURI);
  }

  get tolerance() {
    return 2 ** Number($("tolerance").value);
  }

  async update() {
    const {canvas} = this.picture;
    const camera = {...cameraOnCircle(this, this.metres), width_px: canvas.width, height_px: canvas.height, tolerance_px: this.tolerance};
    const body = JSON.stringify(this.view ? {camera, view: this.view} : {camera});
    const reply = await fetch(this.url, {method: "POST", body});
    if (reply.status === 404 && this.view) return (this.view = undefined); // expired: a whole mesh next
    if (reply.status === 503) return new Promise((resolve) => setTimeout(resolve, 1000));
    if (!reply.ok) throw new Error((await reply.json()).detail);
    const delta = decodeRefinedMesh(await reply.arrayBuffer());
    this.mesh.apply(delta);
    this.frame ??= frameAt(delta.lon, delta.lat);
    this.view = delta.view;
    this.camera = camera;
    if (delta.whole) this.top = [...this.mesh.vertices.values()].reduce((most, v) => Math.max(most, v[2]), 1);
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
    const size = 111320 * Math.max((east - west) * Math.cos(south * DEGREE), north - south);
    const above = {lon: (west + east) / 2, lat: south - 0.25 * (north - south), height_m: 0.95 * size, heading_deg: 0, pitch_deg: -55};
    const high = $("above").checked;
    const pose = poseOf(high ? above : cameraOnCircle(this, this.metres), this.frame);
    this.picture.draw(pose, {wires: $("wires").checked, top: this.top, haze: high ? 1e7 : 1.2 * size});
  }
}

function fit(canvas) {
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  [canvas.width, canvas.height] = [window.innerWidth * scale, window.innerHeight * scale].map(Math.round);
}

async function main() {
  const picture = new Picture($("picture"));
  fit(picture.canvas);
  addEventListener("resize", () => fit(picture.canvas));
  const {datasets} = await (await fetch(new URL("../datasets", document.baseURI))).json();
  const dems = datasets.filter(({kind}) => kind === "dem");
  if (dems.length === 0) return say("No DEM is served: a set of tiles has nothing to refine.");
  const asked = new URLSearchParams(location.search).get("dataset");
  $("dataset").replaceChildren(...dems.map(({name}) => new Option(name, name, false, name === asked)));
  const label = () => ($("tolerance-value").textContent = `${(2 ** Number($("tolerance").value)).toFixed(1)} px`);
  $("tolerance").addEventListener("input", label);
  label();

  const open = () => new Flight(dems.find(({name}) => name === $("dataset").value), picture);
  let flight = open();
  $("dataset").addEventListener("change", () => (flight = open()));
  window.tind = {get flight() { return flight; }}; // for tests and the browser's console

  let last = performance.now();
  const frame = (now) => {
    if ($("fly").checked && flight.camera) flight.metres += (SPEED * Math.min(now - last, 200)) / 1000;
    last = now;
    flight.draw();
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);

  say("Making the dataset ready for refining …");
  for (;;) {
    const current = flight;
    await current.update();
    if (current.camera) say("");
    await new Promise((resolve) => setTimeout(resolve, 30));
  }
}

main().catch((error) => say(`This cannot be shown: ${error.message ?? error}`));
