// The beginning: one connection, one stage, and what the server says it shows.

import { Connection } from "./connection.js";
import { byId, press, toast } from "./dom.js";
import { bindKeys } from "./keys.js";
import { Stage } from "./stage.js";
import { Tune } from "./tune.js";
import { View } from "./view.js";

const PATIENCE_MS = 1500; // before the page says that it waits

const stage = new Stage(byId("canvas"));
/** @type {?(Tune | View)} */
let mode = null;
let waiting = setTimeout(() => { byId("busy").hidden = false; }, PATIENCE_MS);

/** @type {Object<string, (message: any) => void>} */
const texts = {
  state(state) {
    byId("source").textContent = state.name;
    byId("mode").textContent = state.mode;
    document.title = `${state.mode} ${state.name} - dloftbs`;
    if (mode === null) begin(state);
    mode?.showState(state);
  },
  strip(strip) {
    if (mode instanceof Tune) mode.showStrip(strip);
  },
  saved(saved) {
    if (mode instanceof Tune) mode.showSaved(saved);
  },
  error(error) {
    toast(error.message, true);
  },
};

const connection = new Connection(
  (message) => texts[message.type]?.(message),
  async (picture) => {
    clearTimeout(waiting);
    byId("busy").hidden = true;
    await stage.show(picture);
    await mode?.shown(picture.header);
  },
  (open) => {
    document.body.classList.toggle("offline", !open);
    byId("offline").hidden = open;
  },
);

/** @param {any} state */
function begin(state) {
  mode = state.mode === "tune" ? new Tune(stage, connection) : new View(stage, connection);
  const layers = /** @type {const} */ (["picture", "mask", "curves"]);
  const toggle = (/** @type {typeof layers[number]} */ layer) => press(byId(`show-${layer}`), stage.toggle(layer));
  for (const layer of layers) document.getElementById(`show-${layer}`)?.addEventListener("click", () => toggle(layer));
  byId("zoom-in").onclick = () => stage.zoomBy(1.5);
  byId("zoom-out").onclick = () => stage.zoomBy(1 / 1.5);
  byId("zoom-fit").onclick = () => stage.fit();
  const maskKeys = /** @type {import("./keys.js").Binding[]} */ ([[["2"], "Show or hide the mask", () => toggle("mask")]]);
  bindKeys([
    ...mode.keys(),
    [["1"], "Show or hide the picture", () => toggle("picture")],
    ...(mode instanceof Tune ? maskKeys : []),
    [["3"], "Show or hide the curves", () => toggle("curves")],
    [["+", "-"], "Larger, smaller; two fingers or a drag move", (event) => stage.zoomBy(event.key === "+" ? 1.5 : 1 / 1.5)],
    [["0"], "Whole picture", () => stage.fit()],
  ]);
}
