// The highest post, marked where it is drawn, with its height as the DEM has it.

const {Cesium} = window;
const INK = Cesium.Color.fromCssColorString("#1d2733");

export class Summit {
  constructor(scene) {
    this.marks = scene.primitives.add(new Cesium.PointPrimitiveCollection());
    this.labels = scene.primitives.add(new Cesium.LabelCollection({scene}));
  }

  set show(yes) {
    this.marks.show = this.labels.show = yes;
  }

  /// Nothing where the highest post is only guessed.
  at({facts, summit: {longitude, latitude, height}, low, high, summitHeight}, exaggeration) {
    this.marks.removeAll();
    this.labels.removeAll();
    if (!facts.highest) return;
    const over = low + (height - low) * exaggeration + 0.004 * (high - low); // not in the ground of a coarse mesh
    const position = Cesium.Cartesian3.fromRadians(longitude, latitude, over);
    this.marks.add({position, pixelSize: 6, color: Cesium.Color.WHITE, outlineColor: INK, outlineWidth: 2});
    this.labels.add({
      position, text: `${Math.round(summitHeight ?? height).toLocaleString("en")} m`, font: '600 26px system-ui, "DejaVu Sans", sans-serif', scale: 0.5,
      fillColor: INK, outlineColor: Cesium.Color.WHITE, outlineWidth: 7, style: Cesium.LabelStyle.FILL_AND_OUTLINE,
      horizontalOrigin: Cesium.HorizontalOrigin.CENTER, verticalOrigin: Cesium.VerticalOrigin.BOTTOM, pixelOffset: new Cesium.Cartesian2(0, -8),
    });
  }
}
