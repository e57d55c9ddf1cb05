// Another globe beside the first, under the same camera, with a divider between them: two methods, two
// levels, two datasets, or the error beside the relief.

import {$} from "../page.js";
import {openDataset} from "./dataset.js";
import {drawnShort, onDrawn} from "./drawn.js";
import {Globe} from "./globe.js";

const {Cesium} = window;

export class Compare {
  #turn = 0;

  constructor(globe) {
    this.main = globe;
    $("divider").addEventListener("input", () => this.#divide());
    globe.scene.postRender.addEventListener(() => this.#follow());
    this.#count(globe);
  }

  get on() {
    return this.asked !== undefined;
  }

  /// {dataset, level?, mode?}, or undefined for nothing.
  async show(asked) {
    const turn = ++this.#turn;
    this.asked = asked;
    $("beside").hidden = $("divider").hidden = $("sides").hidden = !asked;
    if (!asked) {
      this.other?.destroy(); // two of them take twice the memory
      this.#sums.delete(this.other);
      this.other = undefined;
      $("beside-globe").replaceChildren();
      return;
    }
    const known = [this.main.dataset, this.other?.dataset].find((one) => one?.name === asked.dataset);
    const dataset = known ?? await openDataset(asked.dataset);
    if (turn !== this.#turn) return;
    if (!this.other) this.#count(this.other = new Globe($("beside-globe"), $("beside-labels")));
    const {scene} = this.other;
    scene.screenSpaceCameraController.enableInputs = false; // it follows
    this.#divide();
    this.other.show(dataset, this.#looks(), asked.level);
    this.#from = undefined;
    this.#caption();
    this.#follow();
  }

  #looks() {
    return {...this.main.looks, mode: this.asked.mode ?? this.main.looks.mode};
  }

  apply() {
    if (!this.other?.dataset) return;
    this.other.apply(this.#looks());
    this.#caption();
  }

  #sums = new Map(); // by globe: what is drawn of it

  #count(globe) {
    onDrawn(globe, (sum) => {
      this.#sums.set(globe, sum);
      if (this.other?.dataset) this.#caption();
    });
  }

  /// What lies on which side, in as many words as make a difference, and what it is made of.
  #caption() {
    const {main, other, asked} = this;
    const words = ({dataset, deepest, looks: {mode}}) => [dataset.name,
      ...(other.deepest !== main.deepest ? [`up to level ${deepest}`] : []),
      ...(asked.mode && asked.mode !== main.looks.mode ? [document.querySelector(`#mode [value=${mode}]`).textContent] : [])].join(", ");
    for (const [id, globe] of [["side-main", main], ["side-other", other]]) {
      const sum = this.#sums.get(globe);
      $(id).textContent = sum ? `${words(globe)}\n${drawnShort(sum)}` : words(globe);
    }
  }

  #divide() {
    const share = Number($("divider").value);
    $("beside").style.clipPath = `inset(0 0 0 ${share}%)`;
    for (const id of ["beside", "sides"]) $(id).style.setProperty("--at", `${share}%`);
  }

  #from; // the camera as it was copied last

  #follow() {
    if (!this.other) return;
    const {camera} = this.main.scene;
    if (this.#from && Cesium.Matrix4.equals(this.#from, camera.viewMatrix)) return;
    this.#from = Cesium.Matrix4.clone(camera.viewMatrix);
    this.other.scene.camera.setView({destination: camera.positionWC, orientation: {direction: camera.directionWC, up: camera.upWC}});
    this.other.scene.requestRender();
  }
}
