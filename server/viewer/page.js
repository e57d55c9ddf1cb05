// What the pages have in common: one line to whoever looks, with a way on, and patience with a
// daemon that is busy, or gone for a while.

export const $ = (id) => document.getElementById(id);
export const NO_WEBGL = "this browser has no WebGL 2, which draws the terrain. Switch on hardware acceleration in its settings, or take another browser; the tiles are served all the same.";

/// Where style.css makes the controls a sheet at the bottom.
export const isPhone = () => matchMedia("(max-width: 640px), (max-height: 480px)").matches;

/// One line over the page; `ways` leads on: [[label, what to do]].
export function say(text, ways = []) {
  const buttons = ways.map(([label, go]) => {
    const button = Object.assign(document.createElement("button"), {type: "button", textContent: label});
    button.addEventListener("click", go);
    return button;
  });
  $("message").replaceChildren(text, ...buttons);
  $("message").hidden = !text;
}

/// What ends a page: it can only begin again.
export const sayFailed = (error) => say(`This cannot be shown: ${error.message ?? error}`, [["Start again", () => location.reload()]]);

export const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/// How long a daemon that answers 503 asks to be left alone.
export const busyFor = (headers) => pause(1000 * Math.min(Math.max(Number(headers.get("retry-after")) || 1, 1), 30));

// ---- a daemon that does not answer

export class NoAnswer extends Error {}

/// For the `catch` of a request and of what is read of it: nobody answered, unless we broke it off.
export function unanswered(error) {
  throw error.name === "AbortError" ? error : new NoAnswer("the daemon does not answer");
}

let back;

/// Says that the daemon does not answer, until it does.
export function whenBack() {
  return (back ??= (async () => {
    say("The daemon does not answer. Is tind serve running, and is there a network? This page goes on by itself.");
    while (!(await fetch(new URL("../datasets", import.meta.url)).catch(() => undefined))) await pause(1500);
    say("");
    back = undefined;
  })());
}

/// JSON, however long the daemon is busy or gone.
export async function fetchJson(url) {
  for (;;) {
    try {
      const reply = await fetch(url, {headers: {Accept: "application/json"}}).catch(unanswered);
      if (reply.ok) return await reply.json().catch(unanswered);
      if (reply.status !== 503) throw new Error(`${url} answers ${reply.status}`);
      await busyFor(reply.headers);
    } catch (error) {
      if (!(error instanceof NoAnswer)) throw error;
      await whenBack();
    }
  }
}

export const fetchDatasets = async () => (await fetchJson(new URL("../datasets", import.meta.url))).datasets;

// ---- the shell

/// The other pages open the same dataset.
export function keepDataset(name) {
  for (const link of document.querySelectorAll("#shell nav a:not(.api)")) {
    const target = new URL(link.href);
    target.searchParams.set("dataset", name);
    link.href = target.href;
  }
}

// ---- controls

/// Fills the list of datasets and opens the one that the URL names, or the first. One that is not
/// there is said, with those that are.
export async function chooseDataset(names, open) {
  const list = $("dataset");
  const choose = (name) => {
    list.querySelector("[value='']")?.remove();
    list.value = name;
    const here = new URL(location.href);
    here.searchParams.set("dataset", name);
    history.replaceState(null, "", here);
    say("");
    keepDataset(name);
    return open(name);
  };
  list.replaceChildren(...names.map((name) => new Option(name, name)));
  list.addEventListener("change", () => choose(list.value));
  const asked = new URLSearchParams(location.search).get("dataset");
  if (asked === null || names.includes(asked)) {
    list.value = asked ?? names[0];
    keepDataset(list.value);
    return open(list.value);
  }
  list.prepend(new Option("choose …", "", true, true));
  say(`There is no dataset named ${asked} here.`, names.slice(0, 6).map((name) => [`Show ${name}`, () => choose(name)]));
}

/// {key: what it does}, letters small. Not while somebody writes; a control keeps the arrows for itself.
export function connectKeys(moves, elsewhere = () => false) {
  document.addEventListener("keydown", (event) => {
    const inText = event.target.matches("input[type=search]"), inControl = event.target.matches("input, select");
    const move = moves[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!move || inText || event.ctrlKey || event.metaKey || event.altKey || (inControl && event.key.startsWith("Arrow")) || elsewhere()) return;
    event.preventDefault();
    move();
  });
}

/// Who asks the system for calm sees nothing move that they have not moved.
export function stillIfAsked(id) {
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) $(id).checked = false;
}

/// The panel begins closed where it would hide the picture.
export function foldControls() {
  if (isPhone()) $("controls").open = false;
}
