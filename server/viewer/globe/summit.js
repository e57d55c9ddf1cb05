// The highest post, marked where it is drawn, with its height as the DEM has it.

const {Cesium} = window;
const INK = Cesium.Color.fromCssColorString("#1d2733");

const TOWARDS_EYE = 0.01, TOWARDS_EYE_M = 1000; // of the extent, at most: the ground in front cuts no half off, a mountain hides the whole

/// A white disc with a dark rim, twice as large as it is drawn.
function ringImage() {
  const canvas = Object.assign(document.createElement("canvas"), {width: 24, height: 24});
  const pen = canvas.getContext("2d");
  pen.arc(12, 12, 8, 0, 2 * Math.PI);
  pen.fillStyle = "#fff";
  pen.fill();
  pen.lineWidth = 4;
  pen.strokeStyle = INK.toCssColorString();
  pen.stroke();
  return canvas;
}

const SPACE_M = 2e6, EDGE = 0.25; // a sine of the eye's height over the horizon
const LABEL_WIDE = 84, LABEL_UP = -16; // pixels

export class Summit {
  constructor(scene) {
    this.scene = scene;
    this.marks = scene.primitives.add(new Cesium.BillboardCollection({scene}));
    this.ring = ringImage();
    this.labels = scene.primitives.add(new Cesium.LabelCollection({scene}));
    scene.preRender.addEventListener(() => this.labels.length > 0 && this.#fit());
  }

  /// Nothing of it where its foot is beyond the horizon: half a label would look over the earth's edge, and none cut by the picture's.
  #fit() {
    const {scene} = this, label = this.labels.get(0);
    const at = Cesium.SceneTransforms.worldToWindowCoordinates(scene, label.position);
    const {positionWC, positionCartographic: {height}} = scene.camera; // who is below the ellipsoid has no horizon on it
    label.show = this.marks.get(0).show = height < 0 || (new Cesium.EllipsoidalOccluder(Cesium.Ellipsoid.WGS84, positionWC).isPointVisible(this.foot) && !this.#isAtEdge(positionWC, height));
    const {LEFT, CENTER, RIGHT} = Cesium.HorizontalOrigin;
    label.horizontalOrigin = at?.x < LABEL_WIDE / 2 ? LEFT : at?.x > scene.canvas.clientWidth - LABEL_WIDE / 2 ? RIGHT : CENTER;
  }

  /// From space, where the globe bends away: the ground before it would cover half of the label.
  #isAtEdge(eye, height) {
    if (height < SPACE_M) return false;
    const up = Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(this.foot), to = Cesium.Cartesian3.subtract(eye, this.foot, new Cesium.Cartesian3());
    return Cesium.Cartesian3.dot(up, Cesium.Cartesian3.normalize(to, to)) < EDGE;
  }

  /// Where its ring and its height are on the picture, in pixels; none where they are not seen.
  get places() {
    const at = this.labels.length > 0 && this.labels.get(0).show ? Cesium.SceneTransforms.worldToWindowCoordinates(this.scene, this.labels.get(0).position) : undefined;
    return at ? [{x: at.x, y: at.y}, {x: at.x, y: at.y + LABEL_UP}] : [];
  }

  set show(yes) {
    this.marks.show = this.labels.show = yes;
  }

  /// Nothing where the highest post is only guessed.
  at({facts, summit: {longitude, latitude, height}, low, high, extent, summitHeight}, exaggeration) {
    this.marks.removeAll();
    this.labels.removeAll();
    if (!facts.highest) return;
    const over = low + (height - low) * exaggeration + 0.004 * (high - low); // not in the ground of a coarse mesh
    this.foot = Cesium.Cartesian3.fromRadians(longitude, latitude);
    const position = Cesium.Cartesian3.fromRadians(longitude, latitude, over);
    const eyeOffset = new Cesium.Cartesian3(0, 0, -Math.min(TOWARDS_EYE * extent, TOWARDS_EYE_M));
    this.marks.add({position, eyeOffset, image: this.ring, scale: 0.5});
    this.labels.add({
      position, eyeOffset, text: `${Math.round(summitHeight ?? height).toLocaleString("en")} m`, font: '600 26px system-ui, "DejaVu Sans", sans-serif', scale: 0.5,
      fillColor: INK, outlineColor: Cesium.Color.WHITE, outlineWidth: 7, style: Cesium.LabelStyle.FILL_AND_OUTLINE,
      horizontalOrigin: Cesium.HorizontalOrigin.CENTER, verticalOrigin: Cesium.VerticalOrigin.BOTTOM, pixelOffset: new Cesium.Cartesian2(0, LABEL_UP / 2),
    });
  }
}
