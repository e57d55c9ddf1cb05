// What the picture is made of: how many triangles, and how far any post is from them.

import {drawnOf} from "./tiles.js";

/// Of meshes as they are read: {triangles, tiles, bound}; the bound is undefined where one states none.
export function sumOf(meshes) {
  const bounds = meshes.map(({metadata}) => metadata.max_error_m);
  return {
    triangles: meshes.reduce((sum, {indices}) => sum + indices.length / 3, 0), tiles: meshes.length,
    bound: bounds.includes(undefined) ? undefined : Math.max(0, ...bounds),
  };
}

const metres = (bound) => `${bound < 10 ? bound.toFixed(2) : Math.round(bound).toLocaleString("en")} m`;

export function drawnText({triangles, tiles, bound}) {
  const counted = `${triangles.toLocaleString("en")} triangles in ${tiles} ${tiles === 1 ? "tile" : "tiles"}`;
  return bound === undefined ? counted : `${counted}, no post farther off than ${metres(bound)}`;
}

/// The same where there is little room.
export function drawnShort({triangles, bound}) {
  return `${triangles.toLocaleString("en")} triangles${bound === undefined ? "" : `, ±${metres(bound)}`}`;
}

/// Tells it whenever all tiles of a view are there, and each second until then, as coarser ones are drawn: what sumOf()
/// has, or undefined where they cannot be read.
export function onDrawn(globe, tell) {
  let pending, turn = 0;
  const say = async () => {
    pending = undefined;
    if (!globe.dataset || globe.widget.isDestroyed()) return;
    const mine = ++turn; // a later view wins over a slower answer
    const tiles = [...drawnOf(globe.scene, globe.dataset.rectangle).values()];
    const meshes = await Promise.all(tiles.map((tile) => globe.reader.read(tile))).catch(() => []);
    if (mine === turn) tell(meshes.length > 0 ? sumOf(meshes) : undefined);
  };
  const soon = () => {
    clearTimeout(pending);
    pending = setTimeout(say, 200);
  };
  const meanwhile = () => (pending ??= setTimeout(say, 1000));
  globe.scene.camera.moveEnd.addEventListener(soon);
  globe.scene.globe.tileLoadProgressEvent.addEventListener((waiting) => (waiting === 0 ? soon() : meanwhile()));
}
