// A GLB as a client decodes it: positions where the node puts them, in double, z up; compressed ones
// by meshoptimizer's decoder from npm.
import {MeshoptDecoder} from "meshoptimizer";

const ARRAYS = {5120: Int8Array, 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array};
const SHAPES = {SCALAR: 1, VEC2: 2, VEC3: 3};
const EXTENSION = "EXT_meshopt_compression";

/// {json, primitives: [{positions, normals, colours, features, indices, edges: {left, ...}, json}]}
export async function decodeGlb(bytes) {
  await MeshoptDecoder.ready;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const text = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + text)));
  const binary = bytes.subarray(28 + text);
  const viewBytes = (index) => {
    const {byteOffset, byteLength, extensions} = json.bufferViews[index];
    const packed = extensions?.[EXTENSION];
    if (!packed) return binary.slice(byteOffset, byteOffset + byteLength);
    const out = new Uint8Array(packed.count * packed.byteStride);
    const source = binary.subarray(packed.byteOffset, packed.byteOffset + packed.byteLength);
    MeshoptDecoder.decodeGltfBuffer(out, packed.count, packed.byteStride, source, packed.mode, packed.filter);
    return out;
  };
  const values = (index) => {
    const {bufferView, componentType, count, type, normalized} = json.accessors[index];
    const numbers = new ARRAYS[componentType](viewBytes(bufferView).buffer), shape = SHAPES[type];
    const stride = (json.bufferViews[bufferView].byteStride ?? shape * numbers.BYTES_PER_ELEMENT) / numbers.BYTES_PER_ELEMENT;
    const largest = normalized ? 2 ** (8 * numbers.BYTES_PER_ELEMENT - (componentType === 5120 ? 1 : 0)) - 1 : 1;
    return Array.from({length: count}, (_, i) => Array.from({length: shape}, (_, k) => numbers[i * stride + k] / largest));
  };
  const node = json.nodes[json.scenes[0].nodes[0]], m = node.matrix;
  const turned = ([x, y, z]) => [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z);
  const primitives = json.meshes[0].primitives.map((primitive) => ({
    json: primitive,
    positions: values(primitive.attributes.POSITION).map((p) => turned(p).map((v, row) => v + m[12 + row])).map(([x, y, z]) => [x, -z, y]),
    normals: values(primitive.attributes.NORMAL),
    colours: primitive.attributes.COLOR_0 === undefined ? undefined : values(primitive.attributes.COLOR_0),
    features: primitive.attributes._FEATURE_ID_0 === undefined ? undefined : values(primitive.attributes._FEATURE_ID_0).flat(),
    indices: values(primitive.indices).flat(),
    edges: Object.fromEntries(Object.entries(primitive.extensions?.CESIUM_tile_edges ?? {}).map(([side, index]) => [side, values(index).flat()])),
  }));
  return {json, node, primitives};
}
