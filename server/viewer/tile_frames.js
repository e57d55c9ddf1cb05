// A reader of many tiles in one response (docs/formats.md, "Tiles in frames").

/// [{level, x, y, status, bytes: Uint8Array}], views into the buffer; throws on damaged bytes.
export function decodeTileFrames(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 12 || view.getUint32(0, true) !== 0x53544e54) throw new Error("not tiles in frames");
  if (view.getUint32(4, true) !== 1) throw new Error("an unknown version");
  const frames = [];
  let at = 12;
  for (let left = view.getUint32(8, true); left > 0; --left) {
    if (at + 20 > buffer.byteLength) throw new Error("a frame is cut off");
    const [level, x, y, status, length] = [0, 4, 8, 12, 16].map((offset) => view.getUint32(at + offset, true));
    at += 20;
    if (at + length > buffer.byteLength) throw new Error("a tile is cut off");
    frames.push({level, x, y, status, bytes: new Uint8Array(buffer, at, length)});
    at += length;
  }
  if (at !== buffer.byteLength) throw new Error("bytes are left over");
  return frames;
}
