// Scales that a reader can take numbers from.

/// Round steps (1, 2, 5 times a power of ten): those within [low, high], at most `most` of them.
export function ticks(low, high, most) {
  if (!(high > low)) return [low];
  const rough = (high - low) / most;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * ten).find((s) => Math.floor(high / s) - Math.ceil(low / s) < most);
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i) values.push(Number((i * step).toPrecision(12)));
  return values;
}

/// The longest round length that is no longer than `most` metres.
export function roundLength(most) {
  const ten = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((m) => m * ten).find((length) => length <= most);
}

/// An interval of contours: about 25 of them.
export const contourInterval = (low, high) => Math.max(roundLength(Math.max((high - low) / 20, 0.01)), 0.01);

export function lengthText(metres) {
  if (metres >= 999.95) // which would be 1000 m
    return `${Number((metres / 1000).toPrecision(4)).toLocaleString("en")} km`;
  return metres >= 1 ? `${Number(metres.toPrecision(4))} m` : `${Number((metres * 100).toPrecision(3))} cm`;
}

export function areaText(squareMetres) {
  if (squareMetres >= 0.99995e6) return `${Number((squareMetres / 1e6).toPrecision(4)).toLocaleString("en")} km²`;
  if (squareMetres >= 1e4) return `${Number((squareMetres / 1e4).toPrecision(4))} ha`;
  return `${Number(squareMetres.toPrecision(4))} m²`;
}

const DATUMS = {ellipsoid: "above the ellipsoid", egm84: "above the sea (EGM84)", egm96: "above the sea (EGM96)", egm2008: "above the sea (EGM2008)", unknown: "of unknown datum"};
export const datumText = (datum) => (datum ? DATUMS[datum] ?? `above ${datum}` : DATUMS.unknown); // sets of tiles need not say it
