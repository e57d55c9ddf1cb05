// The viewer: one dataset of this daemon as terrain in CesiumJS, shaded by its own heights and
// normals (no imagery, no request to any other host), and a readout of the tile under the pointer.

import {decodeQuantizedMesh, heightInTile} from "./quantized_mesh.js";

const {Cesium} = window;
const $ = (id) => document.getElementById(id);
const EXTENSIONS_ACCEPT =
  "application/vnd.quantized-mesh;extensions=octvertexnormals-metadata,application/octet-stream;q=0.9,*/*;q=0.01";
const SURVEY_POSTS = 33; // per side, to find relief and the highest point of a dataset

// Height tints like those of printed maps, as shares of the dataset's relief; steep ground is rock.
const TINTS = [
  [0.0, "#7f9a76"],
  [0.25, "#a8b58a"],
  [0.5, "#cbbf9b"],
  [0.72, "#c3b6a8"],
  [0.86, "#e4e2de"],
  [1.0, "#fbfcfd"],
];

// ---- what the daemon serves

async function fetchJson(url) {
  const response = await fetch(url, {headers: {Accept: "application/json"}});
  if (!response.ok) throw new Error(`${url} answers ${response.status}`);
  return response.json();
}

/// [{name, kind: "dem" | "store", ...}]
const fetchDatasets = async () => (await fetchJson("datasets")).datasets;

function say(text) {
  $("message").textContent = text;
  $("message").hidden = !text;
}

// ---- the globe

function createGlobe() {
  Cesium.Ion.defaultAccessToken = ""; // nothing here asks Cesium's own service
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit('<a href="https://cesium.com/cesiumjs/">CesiumJS</a>', true);
  const widget = new Cesium.CesiumWidget("globe", {
    baseLayer: false,
    skyBox: false,
    scene3DOnly: true,
    requestRenderMode: true,
    maximumRenderTimeChange: Infinity,
    contextOptions: {webgl: {antialias: true, preserveDrawingBuffer: true}},
  });
  const {scene} = widget;
  scene.backgroundColor = Cesium.Color.fromCssColorString("#e6edf0");
  scene.skyAtmosphere.saturationShift = -0.12;
  scene.globe.showGroundAtmosphere = false;
  scene.globe.baseColor = Cesium.Color.fromCssColorString("#a8b58a");
  scene.fog.renderable = false; // the material has its own haze
  scene.globe.tileCacheSize = 300;
  scene.screenSpaceCameraController.minimumZoomDistance = 30;
  scene.renderError.addEventListener(() => say("Drawing failed: this browser's WebGL gave up. Reload the page."));
  const canvas = scene.canvas;
  canvas.tabIndex = 0;
  canvas.setAttribute("aria-label", "Terrain: arrow keys move, plus and minus zoom");
  return widget;
}

/// Printed-map looks: height tints mixed with rock where the ground is steep, soft light with cool
/// shades, and haze over what lies farther than the dataset is wide.
function terrainMaterial({low, high, extent}) {
  const ramp = document.createElement("canvas");
  ramp.width = 256;
  ramp.height = 1;
  const pen = ramp.getContext("2d");
  const gradient = pen.createLinearGradient(0, 0, 256, 0);
  for (const [at, colour] of TINTS) gradient.addColorStop(at, colour);
  pen.fillStyle = gradient;
  pen.fillRect(0, 0, 256, 1);
  return new Cesium.Material({
    translucent: false,
    fabric: {
      uniforms: {
        ramp: ramp.toDataURL(),
        low,
        high: Math.max(high, low + 1),
        haze: 2.5 * extent,
        light: 1,
        ink: 0,
        rock: Cesium.Color.fromCssColorString("#8d8379"),
        air: Cesium.Color.fromCssColorString("#dbe7ec"),
      },
      source: `
        czm_material czm_getMaterial(czm_materialInput materialInput) {
          czm_material material = czm_getDefaultMaterial(materialInput);
          float share = clamp((materialInput.height - low) / (high - low), 0.005, 0.995);
          float steep = smoothstep(0.6, 1.1, materialInput.slope) * (1.0 - 0.4 * share);
          vec3 ground = mix(texture(ramp, vec2(share, 0.5)).rgb, rock.rgb, steep);
          float facing = clamp(0.5 + 0.5 * dot(materialInput.normalEC, czm_lightDirectionEC), 0.0, 1.0);
          vec3 shade = mix(vec3(0.14, 0.20, 0.31), vec3(1.26, 1.21, 1.12), pow(facing, 1.9));
          ground *= mix(vec3(1.0), shade, light);
          ground *= 1.0 - 0.55 * ink;
          float far = length(materialInput.positionToEyeEC) / haze;
          material.diffuse = mix(ground, air.rgb, 1.0 - exp(-far * far));
          return material;
        }`,
    },
  });
}

/// Light from the north-west, as on every shaded map, 38 degrees high where the dataset lies.
function lightFromNorthWest(center) {
  const frame = Cesium.Transforms.eastNorthUpToFixedFrame(Cesium.Cartesian3.fromRadians(center.longitude, center.latitude));
  const [azimuth, altitude] = [Cesium.Math.toRadians(315), Cesium.Math.toRadians(38)];
  const toLight = new Cesium.Cartesian3(
    Math.cos(altitude) * Math.sin(azimuth), Math.cos(altitude) * Math.cos(azimuth), Math.sin(altitude));
  const direction = Cesium.Matrix4.multiplyByPointAsVector(frame, toLight, new Cesium.Cartesian3());
  return new Cesium.DirectionalLight({direction: Cesium.Cartesian3.negate(direction, direction), intensity: 1});
}

// ---- a dataset

/// Heights on a coarse lattice, read from the tiles themselves: relief, and where the summit is.
async function survey(provider, rectangle, deepest) {
  const posts = [];
  for (let row = 0; row < SURVEY_POSTS; ++row) {
    for (let col = 0; col < SURVEY_POSTS; ++col) {
      posts.push(new Cesium.Cartographic(
        Cesium.Math.lerp(rectangle.west, rectangle.east, (col + 0.5) / SURVEY_POSTS),
        Cesium.Math.lerp(rectangle.south, rectangle.north, (row + 0.5) / SURVEY_POSTS)));
    }
  }
  // The level whose tiles are about as large as the dataset: a handful of requests.
  const span = Math.max(rectangle.width, rectangle.height);
  const level = Math.max(0, Math.ceil(Math.log2(Math.PI / span)));
  await Cesium.sampleTerrain(provider, Math.min(level, deepest), posts);
  const known = posts.filter((post) => Number.isFinite(post.height));
  if (known.length === 0) throw new Error("no tile of the dataset could be read");
  known.sort((a, b) => a.height - b.height);
  return {low: known[0].height, high: known[known.length - 1].height, summit: known[known.length - 1]};
}

async function openDataset({name, kind}) {
  const url = new URL(`terrain/${encodeURIComponent(name)}`, document.baseURI).href; // CesiumJS needs it whole
  const layer = await fetchJson(`${url}/layer.json`);
  const provider = await Cesium.CesiumTerrainProvider.fromUrl(url, {requestVertexNormals: true, requestMetadata: true});
  const rectangle = Cesium.Rectangle.fromDegrees(...layer.bounds);
  const {latitude} = Cesium.Rectangle.center(rectangle);
  const extent = 6371000 * Math.min(rectangle.width * Math.cos(latitude), rectangle.height, 2);
  return {name, kind, url, layer, provider, rectangle, extent, ...(await survey(provider, rectangle, layer.maxzoom))};
}

/// From the south-west, low enough for a skyline, aimed below the summit.
function fly(scene, {summit, low, extent}) {
  const relief = summit.height - low;
  const target = Cesium.Cartesian3.fromRadians(summit.longitude, summit.latitude, low + 0.55 * relief);
  const range = Math.max(0.5 * extent, 4 * relief);
  const pitch = Cesium.Math.toRadians(extent > 2e6 ? -60 : -16);
  scene.camera.lookAt(target, new Cesium.HeadingPitchRange(Cesium.Math.toRadians(35), pitch, range));
  scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY); // free again
}

function show(scene, dataset) {
  const {globe} = scene;
  globe.terrainProvider = dataset.provider;
  globe.material = terrainMaterial(dataset);
  applyLooks(scene);
  scene.light = lightFromNorthWest(Cesium.Rectangle.center(dataset.rectangle));
  scene.verticalExaggerationRelativeHeight = dataset.low;
  fly(scene, dataset);
  document.title = `${dataset.name} · tind`;
  scene.requestRender();
}

// ---- the tile under the pointer

/// The drawn tile at a place, by the addresses of the tile set (TMS: y counts from the south).
/// CesiumJS draws a missing child from its parent's mesh; the answer is then the real ancestor.
function drawnTile(scene, place) {
  const drawn = scene.globe._surface._tilesToRender; // no public way to ask
  let tile = drawn.find((candidate) => Cesium.Rectangle.contains(candidate.rectangle, place));
  while (tile?.parent && (!tile.data?.terrainData || tile.data.terrainData.wasCreatedByUpsampling())) tile = tile.parent;
  return tile && {z: tile.level, x: tile.x, y: 2 ** tile.level - 1 - tile.y, rectangle: tile.rectangle};
}

/// Fetches and decodes tiles for the readout; the browser's cache mostly has them already.
class TileReader {
  #meshes = new Map();

  read(dataset, {z, x, y}) {
    const url = this.url(dataset, {z, x, y});
    if (!this.#meshes.has(url)) {
      if (this.#meshes.size >= 64) this.#meshes.delete(this.#meshes.keys().next().value);
      this.#meshes.set(url, this.#fetch(url));
    }
    return this.#meshes.get(url);
  }

  url(dataset, {z, x, y}) {
    const template = dataset.layer.tiles[0].replace("{version}", dataset.layer.version);
    return `${dataset.url}/${template.replace("{z}", z).replace("{x}", x).replace("{y}", y)}`;
  }

  async #fetch(url) {
    const response = await fetch(url, {headers: {Accept: EXTENSIONS_ACCEPT}});
    if (!response.ok) throw new Error(`${url} answers ${response.status}`);
    return decodeQuantizedMesh(await response.arrayBuffer());
  }
}

const metres = (value, digits = 1) => `${value.toFixed(digits).replace(/^-(0\.0+)$/, "$1").replace("-", "−")} m`;
const angle = (radians, positive, negative) =>
  `${Math.abs(Cesium.Math.toDegrees(radians)).toFixed(5)}° ${radians < 0 ? negative : positive}`;

/// What the source says of a place, in words; `metres` where it says a height.
async function sourceHeight(dataset, place) {
  if (dataset.kind !== "dem") return {text: "not here: a set of tiles without its DEM"};
  const [lon, lat] = [place.longitude, place.latitude].map((value) => Cesium.Math.toDegrees(value).toFixed(8));
  const {coverage, height_m, datum} = await fetchJson(`elevation/${encodeURIComponent(dataset.name)}?lon=${lon}&lat=${lat}`);
  if (coverage !== "value") return {text: coverage};
  return {text: `${metres(height_m)}, ${datum}`, metres: height_m};
}

class Readout {
  #reader = new TileReader();
  #latest = 0;

  async update(scene, dataset, place) {
    const turn = ++this.#latest; // a later pointer wins over a slower answer
    const tile = place && drawnTile(scene, place);
    if (!tile) return ($("readout").hidden = true);
    $("position").textContent = `${angle(place.latitude, "N", "S")}, ${angle(place.longitude, "E", "W")}`;
    const [source, mesh] = await Promise.allSettled([sourceHeight(dataset, place), this.#reader.read(dataset, tile)]);
    if (turn !== this.#latest) return;
    $("source-height").textContent = source.value?.text ?? "no answer";
    if (mesh.value) this.#showTile(dataset, tile, mesh.value, place, source.value?.metres);
    $("readout").hidden = false;
  }

  #showTile(dataset, tile, mesh, place, sourceMetres) {
    const {west, south, width, height} = tile.rectangle;
    const surface = heightInTile(mesh, (place.longitude - west) / width, (place.latitude - south) / height);
    const off = sourceMetres === undefined || surface === undefined ? "" : `, ${surface < sourceMetres ? "" : "+"}${metres(surface - sourceMetres)}`;
    $("mesh-height").textContent = surface === undefined ? "not known" : metres(surface) + off;
    const link = Object.assign(document.createElement("a"), {
      href: this.#reader.url(dataset, tile), textContent: `${tile.z}/${tile.x}/${tile.y}`, download: `${tile.z}-${tile.x}-${tile.y}.terrain`});
    $("tile").replaceChildren(link);
    $("tile-size").textContent = `${(mesh.indices.length / 3).toLocaleString("en")} triangles, ` +
      `${mesh.u.length.toLocaleString("en")} vertices, ${mesh.bytes.toLocaleString("en")} bytes`;
    const bound = mesh.metadata.max_error_m;
    $("tile-error").textContent = bound === undefined ? "not stated" : `at most ${metres(bound, bound < 10 ? 2 : 1)} at every post`;
  }
}

// ---- controls

/// Wires are drawn darker and on plain paper: through them one would see the sky below the ground.
function applyLooks(scene) {
  const wires = $("wireframe").checked;
  const {uniforms} = scene.globe.material ?? {uniforms: {}}; // none before a dataset is open
  uniforms.light = $("lighting").checked ? 1 : 0;
  uniforms.ink = wires ? 1 : 0;
  scene.skyAtmosphere.show = !wires;
  scene.globe._surface.tileProvider._debug.wireframe = wires; // as CesiumJS's own inspector does
}

function pointerPlace(scene, position) {
  const hit = scene.globe.pick(scene.camera.getPickRay(position), scene);
  return hit && Cesium.Cartographic.fromCartesian(hit);
}

function connectPointer(scene, state) {
  const readout = new Readout();
  let pending;
  const look = ({endPosition, position}) => {
    const at = Cesium.Cartesian2.clone(endPosition ?? position);
    clearTimeout(pending);
    pending = setTimeout(() => state.dataset && readout.update(scene, state.dataset, pointerPlace(scene, at)), 60);
  };
  const handler = new Cesium.ScreenSpaceEventHandler(scene.canvas);
  handler.setInputAction(look, Cesium.ScreenSpaceEventType.MOUSE_MOVE);
  handler.setInputAction(look, Cesium.ScreenSpaceEventType.LEFT_CLICK); // a tap
}

function connectControls(scene, state) {
  const change = (id, apply) => $(id).addEventListener("input", () => {
    apply($(id));
    scene.requestRender();
  });
  change("exaggeration", ({value}) => {
    scene.verticalExaggeration = Number(value);
    $("exaggeration-value").textContent = `${Number(value)}×`;
  });
  change("wireframe", () => applyLooks(scene));
  change("lighting", () => applyLooks(scene));
  $("home").addEventListener("click", () => state.dataset && fly(scene, state.dataset));
  $("dataset").addEventListener("change", ({target}) => {
    history.replaceState(null, "", `?dataset=${encodeURIComponent(target.value)}`);
    state.open(target.value);
  });
}

function connectKeys(scene) {
  const {camera} = scene;
  const step = () => 0.06 * Math.max(camera.positionCartographic.height, 100);
  const turn = Cesium.Math.toRadians(4);
  const moves = {
    ArrowUp: () => camera.moveForward(step()), ArrowDown: () => camera.moveBackward(step()),
    ArrowLeft: () => camera.lookLeft(turn), ArrowRight: () => camera.lookRight(turn),
    "+": () => camera.zoomIn(step()), "=": () => camera.zoomIn(step()), "-": () => camera.zoomOut(step()),
    w: () => $("wireframe").click(), l: () => $("lighting").click(), h: () => $("home").click(),
  };
  document.addEventListener("keydown", (event) => {
    const inControl = event.target.matches("input, select");
    const move = moves[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!move || event.ctrlKey || event.metaKey || event.altKey || (inControl && event.key.startsWith("Arrow"))) return;
    event.preventDefault();
    move();
    scene.requestRender();
  });
}

async function main() {
  if (!Cesium) return say("CesiumJS is not here: run scripts/setup, build again and reload.");
  const datasets = await fetchDatasets();
  const widget = createGlobe();
  const {scene} = widget;
  const state = {
    dataset: undefined,
    async open(name) {
      say(`Opening ${name} …`);
      try {
        state.dataset = await openDataset(datasets.find((one) => one.name === name));
        show(scene, state.dataset);
        say("");
      } catch (error) {
        say(`${name} cannot be shown: ${error.message ?? error}`);
      }
    },
  };
  window.tind = {widget, state}; // for tests and the browser's console

  connectControls(scene, state);
  connectPointer(scene, state);
  connectKeys(scene);
  const names = datasets.map(({name}) => name);
  if (names.length === 0) return say("No dataset is served. Start again with a DEM: tind serve dem.tif");
  const asked = new URLSearchParams(location.search).get("dataset");
  $("dataset").replaceChildren(...names.map((name) => new Option(name, name, false, name === asked)));
  if (asked && !names.includes(asked)) return say(`There is no dataset named ${asked}.`);
  if (window.innerWidth <= 640) $("controls").open = false;
  await state.open(asked ?? names[0]);
}

main().catch((error) => say(`The viewer cannot start: ${error.message ?? error}`));
