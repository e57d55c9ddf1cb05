// What lies under the pointer: heights of source and mesh, the tile and its error.

import {$} from "../page.js";
import {heightInTile} from "../quantized_mesh.js";
import {elevation} from "./dataset.js";
import {datumText} from "./legend.js";
import {drawnTile} from "./tiles.js";

const {Cesium} = window;

export function metres(value, digits = 1) {
  const text = value.toLocaleString("en", {minimumFractionDigits: digits, maximumFractionDigits: digits});
  return `${text.replace(/^-(0(?:\.0+)?)$/, "$1").replace("-", "−")} m`;
}
const angle = (degrees, positive, negative) => `${Math.abs(degrees).toFixed(5)}° ${degrees < 0 ? negative : positive}`;
export const positionText = (lon, lat) => `${angle(lat, "N", "S")}, ${angle(lon, "E", "W")}`;

/// {source, tile}: heights of a place in the DEM's own datum and in that of the tiles, with words.
export async function sourceHeights(dataset, lon, lat) {
  if (dataset.kind !== "dem") return {text: "not here: a set of tiles without its DEM"};
  const own = await elevation(dataset.name, lon, lat);
  if (own.coverage !== "value") return {text: own.coverage};
  const same = own.datum === dataset.datum || own.datum === "unknown";
  const tile = same ? own : await elevation(dataset.name, lon, lat, dataset.datum);
  const text = [own, ...(same ? [] : [tile])].map(({height_m, datum}) => `${metres(height_m)} ${datumText(datum)}`).join(", ");
  return {text, own: own.height_m, tile: tile.height_m};
}

const OF_TILE = ["mesh-height", "tile", "tile-size", "tile-error"], ANSWERS = ["source-height", ...OF_TILE];

export class Readout {
  #latest = 0;

  constructor(globe) {
    this.globe = globe;
  }

  /// What it says is of another place until it is updated.
  fade() {
    $("readout").classList.add("stale");
  }

  hide() {
    ++this.#latest; // no answer that is under way shows it again
    $("readout").hidden = true;
  }

  async update(place) {
    const turn = ++this.#latest; // a later pointer wins over a slower answer
    const {scene, dataset, reader} = this.globe;
    const tile = place && drawnTile(scene, place);
    if (!tile) return this.hide();
    const [lon, lat] = [place.longitude, place.latitude].map(Cesium.Math.toDegrees);
    $("position").textContent = positionText(lon, lat);
    if ($("readout").hidden) { // whoever has tapped sees that something is asked
      for (const id of ANSWERS) $(id).textContent = "…";
      $("readout").hidden = false;
    }
    const [source, mesh] = await Promise.allSettled([sourceHeights(dataset, lon, lat), reader.read(tile)]);
    if (turn !== this.#latest) return;
    $("source-height").textContent = source.value?.text ?? "no answer";
    if (mesh.value) this.#showTile(tile, mesh.value, place, source.value?.tile);
    else for (const id of OF_TILE) $(id).textContent = "no answer";
    $("readout").classList.remove("stale");
    $("readout").hidden = false;
  }

  #showTile(tile, mesh, place, sourceMetres) {
    const {dataset, reader} = this.globe;
    const {west, south, width, height} = tile.rectangle;
    const surface = heightInTile(mesh, (place.longitude - west) / width, (place.latitude - south) / height);
    const off = sourceMetres === undefined || surface === undefined ? "" : `, ${surface < sourceMetres ? "" : "+"}${metres(surface - sourceMetres)} from the source`;
    const shift = dataset.shift.at(...[place.longitude, place.latitude].map(Cesium.Math.toDegrees)); // as the source's first height
    const counted = !dataset.facts.source || dataset.ownDatum === dataset.facts.source.datum ? "" : ` ${datumText(dataset.ownDatum)}`; // where the shift is not known
    $("mesh-height").textContent = surface === undefined ? "not known" : metres(surface - shift) + counted + off;
    const name = `${tile.z}-${tile.x}-${tile.y}`;
    const link = (href, text, download) => Object.assign(document.createElement("a"), {href, textContent: text, download});
    const glb = `${dataset.url}/${tile.z}/${tile.x}/${tile.y}.glb`;
    $("tile").replaceChildren(link(reader.url(tile), `${tile.z}/${tile.x}/${tile.y}`, `${name}.terrain`), " ", link(glb, "GLB", `${name}.glb`));
    $("tile-size").textContent = `${(mesh.indices.length / 3).toLocaleString("en")} triangles, ` +
      `${mesh.u.length.toLocaleString("en")} vertices, ${mesh.bytes.toLocaleString("en")} bytes`;
    const bound = mesh.metadata.max_error_m;
    $("tile-error").textContent = bound === undefined ? "not stated" : `at most ${metres(bound, bound < 10 ? 2 : 1)} at every post (between posts it can be more)`;
  }
}
