// Viewing: curves over the video as they are tracked, objects, space, times.

import { bindCables, byId, fillList, make, press, showCables } from "./dom.js";
import { Brush } from "./brush.js";
import { Plots } from "./plots.js";
import { Space } from "./space.js";

const PANEL_MS = 80;

export class View {
  /**
   * @param {import("./stage.js").Stage} stage
   * @param {import("./connection.js").Connection} connection
   */
  constructor(stage, connection) {
    this.stage = stage;
    this.connection = connection;
    /** @type {any} */
    this.state = {};
    byId("view").hidden = false;
    this.plots = new Plots();
    this.space = new Space(byId("space"));
    new Brush(stage, { tool: () => "none", radius: () => 1, began: () => {}, moved: () => {}, done: () => {} });
    for (const id of ["previous", "live", "strip", "strip-legend", "scrubber", "show-mask"]) byId(id).remove();
    byId("timeline").append(make("progress", { id: "progress", max: "1", value: "0", "aria-label": "Progress" }));
    byId("play").onclick = () => this.togglePlay();
    byId("next").onclick = () => connection.send({ type: "step" });
    byId("loop").onclick = () => this.toggleLoop();
    byId("restart").onclick = () => connection.send({ type: "restart" });
    bindCables(byId("view-objects"), (objects) => connection.send({ type: "objects", objects }));
  }

  /** @returns {import("./keys.js").Binding[]} */
  keys() {
    return [
      [[" "], "Pause, go on", () => this.togglePlay()],
      [["ArrowRight"], "One frame on", () => this.connection.send({ type: "step" })],
      [["L"], "Loop", () => this.toggleLoop()],
      [["Home"], "From the beginning", () => this.connection.send({ type: "restart" })],
    ];
  }

  togglePlay() {
    if (!this.state.controls) return;
    const { ended, paused } = this.state;
    if (ended) this.connection.send({ type: "restart" });
    this.connection.send({ type: "pause", paused: !ended && !paused });
  }

  toggleLoop() {
    if (this.state.controls && !this.state.live) this.connection.send({ type: "loop", loop: !this.state.loop });
  }

  /** @param {any} state */
  showState(state) {
    this.state = state;
    byId("transport").hidden = byId("view-cables").hidden = !state.controls;
    showCables(byId("view-objects"), state.objects);
    byId("loop").hidden = byId("restart").hidden = state.live;
    byId("play").disabled = state.ended && state.live;
    press(byId("loop"), state.loop);
    const stands = state.paused || state.ended;
    byId("play-shape").setAttribute("d", stands ? "M4 2.5v11l9-5.5z" : "M4 3h3v10H4zM9 3h3v10H9z");
    byId("play").setAttribute("aria-label", stands ? "Play" : "Pause");
    fillList(byId("view-warnings"), [state.error, ...state.warnings].filter(Boolean));
    const hint = byId("hint");
    hint.textContent = state.error ? "Ended by an error" : "The source has ended";
    hint.hidden = !state.ended;
    byId("progress").hidden = state.length === null;
  }

  /** @param {any} header */
  async shown(header) {
    this.plots.add(header);
    this.header = header;
    // The panel need not follow each picture: it would cost as much as the picture.
    this.refreshing ??= setTimeout(() => {
      this.refreshing = undefined;
      this.showPanel(this.header);
    }, PANEL_MS);
  }

  /** @param {any} header */
  showPanel(header) {
    const inSpace = header.curves.some((/** @type {any} */ curve) => curve.space);
    if (inSpace) byId("space-panel").hidden = false;
    this.space.show(header.curves);
    this.plots.show(header);
    byId("object-count").textContent = String(header.curves.length);
    byId("reason").textContent = header.reason ? `Nothing found: ${header.reason}` : "";
    byId("objects").replaceChildren(...header.curves.map(describe));
    byId("delay").textContent = header.delay_ms === null ? "" : `${header.delay_ms.toFixed(0)} ms behind`;
    byId("position").textContent = this.state.length ? `${header.index + 1} / ${this.state.length}` : `frame ${header.index}`;
    byId("progress").value = String((header.index + 1) / (this.state.length || 1));
  }
}

/** @param {any} curve */
function describe(curve) {
  const swatch = make("i", { class: "swatch" });
  swatch.style.background = curve.colour;
  const length = curve.length_m === null ? `${curve.length.toFixed(0)} px` : `${curve.length_m.toFixed(3)} m`;
  const width = curve.width_px === null ? "" : `, ${curve.width_px.toFixed(1)} px wide`;
  const meter = make("i");
  meter.style.width = `${100 * curve.confidence}%`;
  meter.style.background = curve.colour;
  const state = curve.state === "confirmed" || curve.state === "detected" ? "" : curve.state;
  return make(
    "li",
    { title: `confidence ${curve.confidence.toFixed(2)}` },
    swatch,
    make("b", {}, curve.label),
    make("span", { class: "muted number" }, `${length}${width}`),
    make("span", { class: "muted" }, state || `${Math.round(100 * curve.confidence)} %`),
    make("span", { class: "meter" }, meter),
  );
}
