// The datasets as cards: extent, posts, datum, levels, state.

import {$, fetchDatasets} from "../page.js";
import {datumText, lengthText} from "./legend.js";

function heightsText(low, high) {
  const [from, to] = [low, high].map((height) => Math.round(height).toLocaleString("en").replace("-", "−"));
  return `${from === to ? "" : `${from} to `}${to} m`;
}

/// What a dataset's heights come from as of one DEM, whatever /datasets has there: of layers the spacing of the finest,
/// the posts of all, and the datum and the accuracy that all have.
export function oneSource(source) {
  const {layers} = source ?? {};
  if (!layers) return source ?? undefined;
  const shared = (of) => (layers.every((layer) => of(layer) === of(layers[0])) ? of(layers[0]) : undefined);
  const finest = layers.reduce((best, layer) => (Math.max(...layer.spacing_m) < Math.max(...best.spacing_m) ? layer : best));
  return {layers, spacing_m: finest.spacing_m, posts: layers.reduce((sum, {columns, rows}) => sum + columns * rows, 0),
    datum: shared(({datum}) => datum), accuracy: shared(({accuracy}) => JSON.stringify(accuracy)) && layers[0].accuracy};
}

function postsText({layers, posts, columns, rows}, spacing) {
  if (layers) return `${layers.length} layers, ${posts.toLocaleString("en")} posts, the finest ${spacing} apart`;
  if (columns * rows === 1) return "a single post";
  return `${columns.toLocaleString("en")} × ${rows.toLocaleString("en")} posts, ${spacing} apart`;
}

/// Lines of text about a dataset, as /datasets has it.
export function factsOf({box, source: from, datum, max_level: deepest, state, share_read: share, highest, lowest}) {
  if (state === "failed") return ["could not be read; the daemon's log says why"];
  const facts = [];
  if (box) {
    const [west, south, east, north] = box;
    const middle = ((south + north) / 2) * (Math.PI / 180);
    facts.push(`${lengthText(111320 * (east - west) * Math.cos(middle))} × ${lengthText(111320 * (north - south))}`);
  }
  const source = oneSource(from);
  facts.push(source ? postsText(source, lengthText(Number(Math.max(...source.spacing_m).toPrecision(3)))) : "tiles without their DEM");
  facts.push(`${highest && lowest ? heightsText(lowest.height_m, highest.height_m) : "heights"} ${datumText(datum)}`);
  facts.push(deepest === undefined ? "no tiles, heights only" : `levels 0 to ${deepest}`);
  if (source?.accuracy) facts.push(`accuracy ${source.accuracy.m} m (${source.accuracy.kind})`);
  if (state === "reading") facts.push(`being read: ${Math.floor(100 * (share ?? 0))}\u00a0%`);
  return facts;
}

/// The same facts of a dataset that is open, its heights as its DEM counts them where that is known.
export function ownFacts({facts, ownDatum, summitHeight: highest, bottomHeight: lowest}) {
  if (highest === undefined || lowest === undefined) return facts;
  return {...facts, datum: ownDatum, highest: {...facts.highest, height_m: highest}, lowest: {...facts.lowest, height_m: lowest}};
}

/// Whether the globe can show it, now or soon.
export const isShowable = ({state, max_level: deepest}) => state !== "failed" && deepest !== undefined;

function card(dataset, current, choose) {
  const button = Object.assign(document.createElement("button"), {type: "button", className: "card"});
  if (dataset.name === current) button.setAttribute("aria-current", "true");
  const line = (name, text) => Object.assign(document.createElement(name), {textContent: text});
  button.append(line("strong", dataset.name), ...factsOf(dataset).map((fact) => line("span", fact)));
  button.disabled = !isShowable(dataset);
  button.addEventListener("click", () => choose(dataset.name));
  return button;
}

export async function showCards(current, choose) {
  const dialog = $("cards");
  const datasets = await fetchDatasets();
  $("cards-list").replaceChildren(...datasets.map((one) => card(one, current, (name) => {
    dialog.close();
    choose(name);
  })));
  if (!dialog.open) dialog.showModal();
  dialog.querySelector("[aria-current]")?.focus();
}
