// The viewer: the globe with its controls. What is drawn is in globe/.

import {$, connectKeys, fetchDatasets, foldControls, isPhone, keepDataset, NO_WEBGL, pause, say, sayFailed} from "./page.js";
import {factsOf, isShowable, ownFacts, showCards} from "./globe/cards.js";
import {inTurnOf, shared} from "./globe/box.js";
import {Compare} from "./globe/compare.js";
import {openDataset} from "./globe/dataset.js";
import {drawnText, onDrawn} from "./globe/drawn.js";
import {Globe} from "./globe/globe.js";
import {isLarge} from "./globe/home.js";
import {connectCompass, showLegend} from "./globe/legend_panel.js";
import {linkOf, viewOf} from "./globe/link.js";
import {objOf} from "./globe/mesh_file.js";
import {matches} from "./globe/places.js";
import {Readout} from "./globe/readout.js";
import {drawnOf, rectangleOf} from "./globe/tiles.js";
import {Tools} from "./globe/tools.js";

const {Cesium} = window;
const MARGIN = 16, GAP = 8; // pixels around the data in the home view, and between it and a panel
const COMING = "Its tiles are coming.", NONE_DRAWN = "None of its tiles is in view.";
const BAR_HIGH = 74, ANSWER_HIGH = 230; // pixels at the bottom of a phone: of the closed controls, of a tool's answer (style.css)

const {camera: LINKED, ...looks} = viewOf(location.hash);
const beside = looks.beside;
delete looks.beside;

// ---- the pointer

/// The readout follows the pointer, and what comes to lie under it when the camera moves or finer
/// tiles arrive. A click is a tool's, where one is chosen.
function connectPointer(globe, tools) {
  const {scene} = globe;
  const readout = new Readout(globe);
  let at, pending;
  const refresh = () => {
    clearTimeout(pending);
    pending = setTimeout(() => at && globe.dataset && readout.update(globe.pick(at)), 60);
  };
  const look = ({endPosition, position}) => {
    at = Cesium.Cartesian2.clone(endPosition ?? position);
    refresh();
  };
  const click = (event) => {
    look(event);
    tools.click(globe.dataset && globe.pick(event.position));
  };
  const handler = new Cesium.ScreenSpaceEventHandler(scene.canvas);
  handler.setInputAction(look, Cesium.ScreenSpaceEventType.MOUSE_MOVE);
  handler.setInputAction(click, Cesium.ScreenSpaceEventType.LEFT_CLICK); // a tap, too
  scene.canvas.addEventListener("keydown", ({key}) => { // without a mouse: in the middle of the picture
    if (key === "Enter") click({position: new Cesium.Cartesian2(scene.canvas.clientWidth / 2, scene.canvas.clientHeight / 2)});
  });
  $("readout-close").addEventListener("click", () => {
    at = undefined;
    readout.hide();
  });
  scene.camera.moveStart.addEventListener(() => readout.fade());
  scene.camera.moveEnd.addEventListener(refresh);
  scene.globe.tileLoadProgressEvent.addEventListener((waiting) => {
    if (waiting === 0) refresh();
    $("loading").hidden = waiting === 0;
    $("loading").textContent = `${waiting} ${waiting === 1 ? "tile" : "tiles"} to come`;
  });
  $("copy-position").addEventListener("click", () => copy($("position").textContent, $("copy-position")));
}

async function copy(text, button) {
  const before = button.textContent;
  const done = await navigator.clipboard?.writeText(text).then(() => true, () => false);
  button.textContent = done ? "copied" : "not allowed";
  setTimeout(() => (button.textContent = before), 1500);
}

/// Keeps the camera where it is above the exaggerated ground. All is reckoned from where it was before
/// the slider was touched, so the way back ends there.
class ExaggeratedCamera {
  #from; // {place, factor, heights}: of the camera, at which exaggeration, over and towards which ground
  #set; // where it was put last

  apply(globe, factor) {
    const {scene, dataset: {low}} = globe;
    const {camera} = scene;
    if (!this.#set || !Cesium.Cartesian3.equals(camera.position, this.#set)) this.#from = this.#look(globe, low);
    const {place, factor: before, heights} = this.#from;
    const lifts = heights.map((height) => (height - low) * (factor - before));
    const height = place.height + (lifts.length > 0 ? Math.max(...lifts) : 0);
    camera.position = Cesium.Cartesian3.fromRadians(place.longitude, place.latitude, height);
    this.#set = Cesium.Cartesian3.clone(camera.position);
  }

  #look(globe, low) {
    const {camera, canvas, globe: earth, verticalExaggeration: factor} = globe.scene;
    const middle = globe.pick(new Cesium.Cartesian2(canvas.clientWidth / 2, canvas.clientHeight / 2));
    const drawn = [earth.getHeight(camera.positionCartographic), middle?.height].filter((height) => height !== undefined);
    return {
      place: Cesium.Cartographic.clone(camera.positionCartographic), factor,
      heights: drawn.map((height) => low + (height - low) / factor),
    };
  }
}

// ---- controls

/// The controls say what the looks are.
function showLooks() {
  $("mode").value = looks.mode;
  $("wireframe").checked = looks.wires;
  $("tiles").checked = looks.tiles;
  $("lighting").checked = !looks.flat;
  $("exaggeration").value = looks.exaggeration;
  $("exaggeration-value").textContent = `${looks.exaggeration}×`;
  $("azimuth").value = looks.sun.azimuth;
  $("azimuth-value").textContent = `${looks.sun.azimuth}°`;
  $("altitude").value = looks.sun.altitude;
  $("altitude-value").textContent = `${looks.sun.altitude}°`;
}

function connectControls(globe, compare, remember) {
  const apply = () => {
    showLooks();
    if (!globe.dataset) return;
    globe.apply({...looks, sun: {...looks.sun}});
    compare.apply();
    showLegend(globe);
    remember();
  };
  const change = (id, set) => $(id).addEventListener("input", () => {
    set($(id));
    apply();
  });
  const camera = new ExaggeratedCamera();
  change("mode", ({value}) => (looks.mode = value));
  change("wireframe", ({checked}) => (looks.wires = checked));
  change("tiles", ({checked}) => (looks.tiles = checked));
  change("lighting", ({checked}) => (looks.flat = !checked));
  change("azimuth", ({value}) => (looks.sun.azimuth = Number(value)));
  change("altitude", ({value}) => (looks.sun.altitude = Number(value)));
  change("exaggeration", ({value}) => {
    looks.exaggeration = Number(value);
    if (globe.dataset) camera.apply(globe, looks.exaggeration);
  });
  $("home").addEventListener("click", () => globe.dataset && globe.home(freeFrame(globe.dataset)));
  $("link").addEventListener("click", () => {
    remember.now();
    copy(location.href, $("link"));
  });
  $("save-picture").addEventListener("click", () => savePicture(globe));
  $("save-mesh").addEventListener("click", () => saveMesh(globe));
  globe.errorsChanged = () => showLegend(globe);
  showLooks();
}

/// What of the picture no panel covers, for Globe.home: a frame and the panels at its corners. On a phone it ends above
/// what is asked and answered at the bottom, so that neither comes to lie over the data; a globe takes all the width.
function freeFrame({box}) {
  const wide = window.innerWidth, high = window.innerHeight;
  const phone = isPhone(), upright = high > wide;
  const frame = {
    left: !phone && $("controls").open ? $("controls").getBoundingClientRect().right + MARGIN : MARGIN, right: wide - MARGIN,
    top: (phone ? $("tools") : $("shell")).getBoundingClientRect().bottom + MARGIN,
    bottom: high - (!phone ? 30 : upright && !isLarge(box) ? ANSWER_HIGH + BAR_HIGH : BAR_HIGH),
  };
  const asShares = ({left, right, top, bottom}) =>
    ({left: (2 * left) / wide - 1, right: (2 * right) / wide - 1, top: 1 - (2 * top) / high, bottom: 1 - (2 * bottom) / high});
  const over = ["legend", "tools", "controls"].map((id) => $(id).getBoundingClientRect())
    .filter(({left, right, top, bottom}) => right > left && left < frame.right && right > frame.left && top < frame.bottom && bottom > frame.top);
  const corners = over.map(({left, right, top, bottom}) =>
    asShares({left: left - GAP, right: right + GAP, top: top - GAP, bottom: bottom + GAP}));
  return {free: asShares(frame), corners};
}

// ---- download

function save(name, blob) {
  const link = Object.assign(document.createElement("a"), {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function savePicture({scene, dataset}) {
  if (!dataset) return;
  scene.render();
  scene.canvas.toBlob((blob) => save(`${dataset.name}.png`, blob));
}

async function saveMesh({scene, dataset, reader}) {
  if (!dataset) return;
  const tiles = [...drawnOf(scene, dataset.rectangle).values()];
  const read = await Promise.all(tiles.map(async (tile) => ({
    name: `${tile.z}-${tile.x}-${tile.y}`, rectangle: inTurnOf(dataset.box, rectangleOf(tile)), mesh: await reader.read(tile)})));
  if (read.length === 0) return say("No tile of the dataset is in view.", [["Show it", () => (say(""), $("home").click())], ["Stay", () => say("")]]);
  save(`${dataset.name}.obj`, new Blob([objOf(read, dataset.datum)], {type: "model/obj"}));
}

// ---- search

function connectSearch(globe, names, open) {
  const [text, list] = [$("search-text"), $("search-found")];
  const choose = (match) => {
    list.hidden = true;
    text.blur();
    const {dataset} = globe;
    if (match.kind === "dataset") return open(match.name);
    const post = match.kind === "highest" ? dataset.summit : match.kind === "lowest" ? dataset.bottom : Cesium.Cartographic.fromDegrees(match.lon, match.lat);
    const ground = match.kind === "place" ? globe.scene.globe.getHeight(post) ?? dataset.low : post.height;
    globe.goTo(post.longitude, post.latitude, ground, Math.max(dataset.extent / 8, 300));
    const at = {west: match.lon, east: match.lon + 1e-9, south: match.lat, north: match.lat + 1e-9};
    if (match.kind === "place" && !shared(dataset.box, at))
      say(`${match.label} lies outside ${dataset.name}.`, [["Back to it", () => (say(""), globe.home(freeFrame(globe.dataset)))], ["Stay", () => say("")]]);
  };
  let found = [];
  text.addEventListener("input", () => {
    found = matches(text.value, names());
    list.replaceChildren(...found.map((match) => {
      const button = Object.assign(document.createElement("button"), {type: "button", textContent: match.label});
      button.addEventListener("click", () => choose(match));
      const item = document.createElement("li");
      item.append(button);
      return item;
    }));
    if (found.length === 0 && text.value.trim()) list.append(Object.assign(document.createElement("li"), {textContent: "Nothing by that name. Write latitude, longitude; summit; or a dataset's name."}));
    list.hidden = !text.value.trim();
  });
  $("search").addEventListener("submit", (event) => {
    event.preventDefault();
    if (found.length > 0 && globe.dataset) choose(found[0]);
  });
  text.addEventListener("keydown", ({key}) => key === "Escape" && (list.hidden = true, text.blur()));
}

// ---- beside

function connectCompare(globe, compare, remember) {
  let latest = 0;
  const show = async () => {
    const name = $("other").value;
    $("other-rows").hidden = !name;
    const slider = $("other-level");
    // At its end it says "all", also of a dataset that has more levels than the one before.
    const level = slider.value === slider.max ? undefined : Number(slider.value);
    $("other-level-value").textContent = name && level !== undefined ? String(level) : "";
    const turn = (latest = latest + 1); // a later choice wins over a slower answer
    try {
      await compare.show(name ? {dataset: name, level, mode: $("other-mode").value || undefined} : undefined);
      if (turn !== latest) return;
      if (name) say(""); // it may have been read first
    } catch (error) {
      if (turn !== latest) return;
      $("other").value = "";
      compare.show(undefined);
      say(`${name} cannot be shown beside it: ${error.message}.`, [["Go on", () => say("")]]);
    }
    if (compare.other) {
      const most = compare.other.dataset.layer.maxzoom;
      slider.max = most;
      slider.value = Math.min(level ?? most, most);
      $("other-level-value").textContent = slider.value;
    }
    remember();
  };
  for (const id of ["other", "other-mode"]) $(id).addEventListener("input", show);
  $("other-level").addEventListener("change", show);
  $("other-level").addEventListener("input", () => ($("other-level-value").textContent = $("other-level").value));
  return show;
}

// ---- keys

function connectGlobeKeys({scene}, tools) {
  const {camera} = scene;
  const step = () => 0.06 * Math.max(camera.positionCartographic.height, 100);
  const turn = Cesium.Math.toRadians(4);
  const look = (angle) => camera.look(Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(camera.position), angle); // stays upright
  const onwards = (metres) => { // level, so that the middle of the picture moves on, too
    const up = Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(camera.position), level = new Cesium.Cartesian3();
    const ahead = Math.abs(Cesium.Cartesian3.dot(camera.direction, up)) > 0.999 ? camera.up : camera.direction;
    Cesium.Cartesian3.subtract(ahead, Cesium.Cartesian3.multiplyByScalar(up, Cesium.Cartesian3.dot(ahead, up), level), level);
    camera.move(Cesium.Cartesian3.normalize(level, level), metres);
  };
  const errorMode = () => {
    $("mode").value = looks.mode === "error" ? "relief" : "error";
    $("mode").dispatchEvent(new Event("input"));
  };
  const moves = {
    ArrowUp: () => onwards(step()), ArrowDown: () => onwards(-step()),
    ArrowLeft: () => look(-turn), ArrowRight: () => look(turn),
    "+": () => camera.zoomIn(step()), "=": () => camera.zoomIn(step()), "-": () => camera.zoomOut(step()),
    w: () => $("wireframe").click(), l: () => $("lighting").click(), h: () => $("home").click(),
    t: () => $("tiles").click(), e: errorMode, "/": () => $("search-text").focus(), Escape: () => tools.choose(undefined),
  };
  const drawn = Object.entries(moves).map(([key, move]) => [key, () => (move(), scene.requestRender())]);
  connectKeys(Object.fromEntries(drawn), () => $("cards").open);
}

// ---- the address

/// The address names the dataset, the camera and the looks, soon after they change; `now` at once.
function rememberer(globe, compare) {
  const now = () => {
    if (!globe.dataset) return;
    const here = new URL(location.href);
    here.searchParams.set("dataset", globe.dataset.name);
    here.hash = linkOf({...looks, camera: globe.camera, beside: compare.asked});
    history.replaceState(null, "", here);
    keepDataset(globe.dataset.name);
  };
  let pending;
  const remember = () => {
    clearTimeout(pending);
    pending = setTimeout(now, 300);
  };
  remember.now = now;
  return remember;
}

// ---- which dataset

/// The names of what is served, also when that is nothing yet.
async function whenServed() {
  for (;;) {
    const datasets = await fetchDatasets();
    if (datasets.length > 0) {
      say("");
      return datasets;
    }
    say("No dataset is served yet. Start with a DEM (tind serve dem.tif), or put one into the catalog's folder: it then shows here by itself.");
    await pause(2000);
  }
}

function show(globe, dataset, first) {
  globe.show(dataset, {...looks, sun: {...looks.sun}});
  $("choose").textContent = dataset.name;
  $("drawn").textContent = COMING;
  $("facts").textContent = factsOf(ownFacts(dataset)).slice(1, 3).join(", ");
  document.body.classList.remove("waiting");
  document.title = `${dataset.name} · tind`;
  showLegend(globe);
  if (first && LINKED) globe.camera = LINKED;
  else globe.home(freeFrame(globe.dataset)); // which the legend is a part of
}

async function main() {
  if (!Cesium) return say("CesiumJS is not here: run scripts/setup, build again and reload.");
  foldControls();
  let datasets = await whenServed();
  let globe;
  try {
    globe = new Globe($("globe"), $("labels"));
  } catch {
    throw new Error(NO_WEBGL);
  }
  const tools = new Tools(globe);
  const compare = new Compare(globe);
  const remember = rememberer(globe, compare);
  const state = {
    get dataset() {
      return globe.dataset;
    },
    async open(name) {
      const turn = (this.turn = (this.turn ?? 0) + 1); // a later choice wins over a slower answer
      say(`Opening ${name} …`);
      try {
        const dataset = await openDataset(name);
        if (turn !== this.turn) return;
        const first = globe.dataset === undefined;
        tools.choose(undefined);
        show(globe, dataset, first);
        say("");
        compare.apply();
        remember.now();
      } catch (error) {
        if (turn !== this.turn) return;
        say(`${name} cannot be shown: ${error.message ?? error}.`, [["Try again", () => this.open(name)], ["Other datasets", choose]]);
      }
    },
  };
  const choose = async () => {
    say("");
    const slow = setTimeout(() => $("message").hidden && say("Asking for the datasets …"), 400); // or nobody sees that the button was pressed
    await showCards(globe.dataset?.name, (name) => state.open(name)).finally(() => clearTimeout(slow));
    say("");
  };
  window.tind = {widget: globe.widget, globe, compare, tools, state, looks}; // for tests and the browser's console
  connectControls(globe, compare, remember);
  connectPointer(globe, tools);
  connectGlobeKeys(globe, tools);
  connectCompass(globe);
  onDrawn(globe, (sum) => ($("drawn").textContent = sum ? drawnText(sum) : globe.scene.globe.tilesLoaded ? NONE_DRAWN : COMING));
  connectSearch(globe, () => datasets, (name) => state.open(name));
  const showOther = connectCompare(globe, compare, remember);
  globe.scene.camera.moveEnd.addEventListener(remember);
  $("choose").addEventListener("click", choose);
  $("cards-close").addEventListener("click", () => $("cards").close());
  const names = datasets.map(({name}) => name), showable = datasets.filter(isShowable).map(({name}) => name);
  $("other").append(...showable.map((name) => new Option(name, name)));

  const asked = new URLSearchParams(location.search).get("dataset");
  if (asked !== null && !names.includes(asked)) {
    return say(`There is no dataset named ${asked} here.`, [...showable.slice(0, 6).map((name) => [`Show ${name}`, () => state.open(name)]), ["All datasets", choose]]);
  }
  await state.open(asked ?? showable[0] ?? names[0]);
  if (beside && names.includes(beside.dataset)) {
    $("other").value = beside.dataset;
    if (beside.level !== undefined) $("other-level").max = Math.max(beside.level + 1, $("other-level").max);
    $("other-level").value = beside.level ?? $("other-level").max;
    $("other-mode").value = beside.mode ?? "";
    await showOther();
  }
}

main().catch(sayFailed);
