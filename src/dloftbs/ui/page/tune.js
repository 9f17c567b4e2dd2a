// Tuning: strokes and sliders in, picture, mask and curves back.

import { Brush, paintStroke } from "./brush.js";
import { Unanswered } from "./connection.js";
import { bindCables, byId, fillList, oncePerRefresh, press, showCables, toast } from "./dom.js";
import { Ranges, rangeAround } from "./ranges.js";
import { RegionTool } from "./region.js";
import { Strip } from "./strip.js";

const TOOLS = ["cable", "not", "erase", "delete"];

export class Tune {
  /**
   * @param {import("./stage.js").Stage} stage
   * @param {import("./connection.js").Connection} connection
   */
  constructor(stage, connection) {
    this.stage = stage;
    this.connection = connection;
    /** @type {any} */
    this.state = { strokes: [], ranges: [], method: "strokes", length: 1 };
    this.tool = "cable";
    this.index = 0;
    this.drawnOn = 0; // the frame that was shown at pointer-down
    this.playing = false;
    this.radius = 0; // until the first picture tells how large the image is
    byId("tune").hidden = false;
    byId("show-mask").hidden = false;
    for (const id of ["loop", "restart"]) byId(id).remove();
    this.ranges = new Ranges(byId("ranges"), (ranges, done) => connection.send({ type: "ranges", ranges, done }));
    this.strip = new Strip(byId("strip"), (index) => this.seek(index));
    this.sendDraft = oncePerRefresh(() => this.draft());
    /** @type {[number, number][]} */
    this.waiting = [];
    this.before = { playing: false, live: false };
    this.region = new RegionTool(stage, (region) => connection.send({ type: "region", ...region }), () => this.showTool());
    this.brush = new Brush(stage, {
      tool: () => /** @type {any} */ (this.region.kind || this.state.method === "ranges" || this.tool === "delete" ? "pick" : this.tool),
      radius: () => (this.region.kind ? 1 : this.radius || 4),
      began: () => this.hold(),
      moved: (points) => {
        this.waiting = points;
        if (this.region.kind) this.region.moved(points);
        else if (points.length > 0) this.sendDraft();
        else if (this.draws) this.letGo();
      },
      done: (points) => this.finish(points),
    });
    stage.overlays.unshift((context, view) => this.paintStrokes(context, view));
    this.bindButtons();
  }

  bindButtons() {
    const send = (/** @type {Object} */ message) => () => this.connection.send(message);
    for (const tool of TOOLS) byId(`tool-${tool}`).onclick = () => this.choose(tool);
    byId("method-strokes").onclick = send({ type: "method", method: "strokes" });
    byId("method-ranges").onclick = send({ type: "method", method: "ranges" });
    byId("undo").onclick = send({ type: "undo" });
    byId("redo").onclick = send({ type: "redo" });
    byId("clear").onclick = send({ type: "clear" });
    byId("save").onclick = send({ type: "save" });
    byId("accept").onclick = () => this.accept();
    byId("region-box").onclick = () => this.region.choose("box");
    byId("region-polygon").onclick = () => this.region.choose("polygon");
    byId("region-clear").onclick = () => {
      this.region.choose(null);
      this.connection.send({ type: "region" });
    };
    byId("add-range").onclick = () => this.ranges.add([95, 125, 80, 255, 60, 255]);
    byId("brush").oninput = () => this.setRadius(Number(byId("brush").value));
    byId("scrubber").oninput = () => this.seek(Number(byId("scrubber").value));
    byId("previous").onclick = () => this.seek(this.index - 1);
    byId("next").onclick = () => this.seek(this.index + 1);
    byId("play").onclick = () => this.togglePlay();
    byId("live").onclick = () => this.seek(null);
    byId("copy").onclick = () => this.copy();
    bindCables(byId("cables"), (objects) => this.connection.send({ type: "objects", objects }));
    this.heights = new Unanswered();
    const height = (/** @type {boolean} */ done) => {
      const used = byId("use-height").checked;
      byId("height").disabled = !used;
      byId("height-mm").textContent = `${byId("height").value} mm`;
      const height_m = used ? Number(byId("height").value) / 1000 : null;
      if (done) this.heights.add(height_m);
      this.connection.send({ type: "height", height_m, join: this.state.join, done });
    };
    for (const join of ["and", "or"]) {
      byId(`join-${join}`).onclick = () => {
        this.state.join = join;
        height(true);
      };
    }
    byId("use-height").onchange = () => height(true);
    byId("accept-strokes").onchange = () => {
      this.connection.send({ type: "accept_strokes", accept: byId("accept-strokes").checked });
    };
    byId("height").oninput = () => height(false);
    byId("height").onchange = () => height(true);
  }

  /** @returns {import("./keys.js").Binding[]} */
  keys() {
    return [
      [["ArrowLeft", "ArrowRight"], "Frame back, on; with Shift, ten", (event) => this.stepBy((event.key === "ArrowLeft" ? -1 : 1) * (event.shiftKey ? 10 : 1))],
      [["Home", "End"], "First, last frame", (event) => this.seek(event.key === "Home" ? 0 : this.state.live ? null : this.last)],
      [[" "], "Play, pause", () => this.togglePlay()],
      [["B"], "Draw: cable", () => this.choose("cable")],
      [["N"], "Draw: not cable", () => this.choose("not")],
      [["E"], "Erase", () => this.choose("erase")],
      [["D"], "Delete an object: click on its curve", () => this.choose("delete")],
      [["[", "]"], "Brush smaller, larger", (event) => this.setRadius(this.radius * (event.key === "[" ? 0.8 : 1.25))],
      [["Z"], "Undo; with Shift, redo", (event) => this.connection.send({ type: event.shiftKey ? "redo" : "undo" })],
      [["Y"], "Redo", () => this.connection.send({ type: "redo" })],
      [["R"], "Region of interest: drag a rectangle", () => this.region.choose("box")],
      [["P"], "Region of interest: click the corners of a polygon; Enter closes it, Escape drops it", () => this.region.choose("polygon")],
      [["G"], "Use the first guess", () => this.accept()],
      [["S"], "Save", () => this.connection.send({ type: "save" })],
    ];
  }

  get last() {
    return Math.max((this.state.length ?? this.strip.length ?? 1) - 1, this.stage.header?.index ?? 0);
  }

  get draws() {
    return this.state.method === "strokes" && !this.region.kind;
  }

  get follows() {
    return this.state.live && byId("live").getAttribute("aria-pressed") === "true";
  }

  /** @param {string} tool */
  choose(tool) {
    if (this.state.method !== "strokes") this.connection.send({ type: "method", method: "strokes" });
    this.tool = tool;
    this.region.choose(null);
    for (const each of TOOLS) press(byId(`tool-${each}`), each === tool);
    this.stage.paint();
  }

  /** Show what a press on the picture does. */
  showTool() {
    press(byId("region-box"), this.region.kind === "box");
    press(byId("region-polygon"), this.region.kind === "polygon");
    this.stage.canvas.className = this.draws ? "draws" : "picks";
    this.showHint();
  }

  /** @param {number} radius */
  setRadius(radius) {
    const most = Number(byId("brush").max);
    this.radius = Math.min(Math.max(Math.round(radius * 10) / 10, 1), most);
    byId("brush").value = String(this.radius);
    byId("brush-size").textContent = `${Math.round(2 * this.radius)} px`;
    this.stage.paint();
  }

  /** @param {?number} index */
  seek(index) {
    if (index !== null) this.index = Math.min(Math.max(index, 0), this.last);
    this.connection.send({ type: "seek", index: index === null ? null : this.index });
    if (this.state.live) press(byId("live"), index === null);
    this.showPosition();
  }

  /** @param {number} step */
  stepBy(step) {
    this.stop();
    this.seek(this.index + step);
  }

  stop() {
    this.playing = false;
    this.showPlay();
  }

  /** Stay at the frame that is shown: what the pointer does belongs to it. */
  hold() {
    if (!this.draws) return;
    this.before = { playing: this.playing, live: this.follows };
    this.stop();
    this.drawnOn = this.stage.header.index;
    if (this.follows || this.index !== this.drawnOn) this.seek(this.drawnOn);
  }

  /** Go on as before `hold`; to seek ends the draft. */
  letGo() {
    this.playing = this.before.playing;
    this.showPlay();
    this.seek(this.before.live ? null : this.drawnOn);
  }

  togglePlay() {
    if (this.state.live) {
      this.seek(this.follows ? this.index : null);
      return;
    }
    this.playing = !this.playing;
    this.showPlay();
    if (this.playing) this.seek(this.index >= this.last ? 0 : this.index + 1);
  }

  showPlay() {
    byId("play-shape").setAttribute("d", this.playing ? "M4 3h3v10H4zM9 3h3v10H9z" : "M4 2.5v11l9-5.5z");
  }

  draft() {
    if (!this.brush.drawing || !["cable", "not"].includes(this.tool) || this.state.method !== "strokes") return;
    this.connection.send(this.strokeOf(this.waiting, false));
  }

  /** @param {[number, number][]} points @param {boolean} done */
  strokeOf(points, done) {
    return { type: "draw", frame: this.drawnOn, points, cable: this.tool === "cable", radius_px: this.radius, done };
  }

  /** @param {[number, number][]} points */
  finish(points) {
    if (this.region.kind) this.region.finish(points);
    else if (this.state.method === "ranges") this.pick(points[points.length - 1]);
    else if (this.tool === "delete") this.connection.send({ type: "delete", frame: this.drawnOn, point: points[points.length - 1] });
    else if (this.tool === "erase") this.connection.send({ type: "erase", frame: this.drawnOn, points, radius_px: this.radius });
    else {
      const { type, done, ...stroke } = this.strokeOf(points, true);
      this.state.strokes = [...this.state.strokes, stroke]; // until the server says so too
      this.connection.send({ type, ...stroke, done });
    }
  }

  /** @param {[number, number]} pixel */
  pick(pixel) {
    const colour = this.stage.colourAt(pixel);
    if (colour) this.ranges.add(rangeAround(colour));
  }

  accept() {
    const { header } = this.stage;
    if (header?.offered) this.connection.send({ type: "accept", frame: header.index });
  }

  async copy() {
    const text = byId("command").textContent;
    try {
      await navigator.clipboard.writeText(text);
      toast("Copied");
    } catch {
      getSelection()?.selectAllChildren(byId("command"));
      toast("Selected: press Ctrl+C");
    }
  }

  /** @param {any} state */
  showState(state) {
    this.state = state;
    const isStrokes = state.method === "strokes";
    press(byId("method-strokes"), isStrokes);
    press(byId("method-ranges"), !isStrokes);
    byId("strokes-panel").hidden = !isStrokes;
    byId("ranges-panel").hidden = isStrokes;
    byId("undo").disabled = !state.can_undo;
    byId("redo").disabled = !state.can_redo;
    byId("clear").disabled = state.strokes.length === 0 && state.others === 0 && state.ranges.length === 0 && state.height_m === null;
    byId("live").hidden = !state.live;
    byId("accept-strokes").checked = state.accept_strokes;
    if (this.heights.isNewest(state.height_m)) this.showHeight(state.height_m);
    for (const join of ["and", "or"]) {
      press(byId(`join-${join}`), state.join === join);
      byId(`join-${join}`).disabled = state.height_m === null;
    }
    byId("stroke-count").textContent = told(state.strokes, state.others);
    byId("save").textContent = state.target ? `Save ${state.target.split(/[\\/]/).pop()}` : "Show settings";
    showCables(byId("cables"), state.objects);
    byId("command").textContent = state.command;
    byId("region-clear").disabled = state.roi === null;
    this.ranges.show(state.ranges);
    this.showPosition();
    this.showTool();
    this.stage.paint();
  }

  /** @param {?number} height_m */
  showHeight(height_m) {
    byId("use-height").checked = height_m !== null;
    byId("height").disabled = height_m === null;
    if (height_m !== null) byId("height").value = String(Math.round(1000 * height_m));
    byId("height-mm").textContent = `${byId("height").value} mm`;
  }

  /** @param {any} strip */
  showStrip(strip) {
    this.strip.show(strip);
    byId("strip-legend").textContent = this.strip.legend();
    if (strip.length !== null) this.state.length = strip.length;
    this.stripWarnings = strip.warnings;
    this.showWarnings();
    this.showPosition();
  }

  /** @param {any} saved */
  showSaved(saved) {
    byId("saved").hidden = false;
    const { target } = this.state;
    byId("saved-where").textContent = target ? `Saved ${target}. Next, run:` : "Name a file with --out to save here. Or keep these settings as cable.yaml, and run:";
    byId("command").textContent = saved.command;
    byId("text").textContent = saved.text;
    byId("text-box").open = !target;
    toast(target ? "Saved" : "Settings are below");
  }

  /** @param {any} header */
  async shown(header) {
    if (this.radius === 0) {
      const longer = Math.max(...header.size);
      byId("brush").max = String(Math.round(longer / 32));
      this.setRadius(Math.max(2, longer / 320));
    }
    if (!this.brush.drawing) this.index = header.index;
    byId("accept").hidden = !(header.offered && header.curves.length > 0);
    byId("height-panel").hidden = !header.has_depth;
    this.strip.mark(header.index);
    this.showPosition();
    this.showWarnings();
    this.showHint();
    if (this.playing) this.playOn(header.index);
  }

  /** @param {number} index */
  playOn(index) {
    if (index >= this.last) {
      this.stop();
      return;
    }
    const period = 1000 / Math.min(this.state.fps ?? 25, 30);
    const wait = Math.max(0, (this.due ?? 0) - performance.now());
    this.due = Math.max(this.due ?? 0, performance.now()) + period;
    setTimeout(() => { if (this.playing) this.seek(index + 1); }, wait);
  }

  showPosition() {
    const scrubber = byId("scrubber");
    scrubber.max = String(this.last);
    scrubber.value = String(this.index);
    byId("position").textContent = `${this.index + 1} / ${this.last + 1}`;
  }

  showHint() {
    const { header } = this.stage;
    const hint = byId("hint");
    const empty = this.state.strokes.length === 0 && !this.state.others && this.state.ranges.length === 0 && this.state.height_m === null && !this.state.kept;
    if (this.region.kind) {
      hint.textContent = this.region.hint;
      hint.hidden = this.brush.drawing;
      return;
    }
    const reason = header && !header.suggested && !empty ? header.reason : null;
    const guess = header?.offered && header.curves.length > 0;
    const start = this.state.method === "ranges" ? "Click on a cable to begin with its colour" : guess ? "Draw along a cable, or use this guess" : "Draw along a cable";
    hint.textContent = reason ? `No curve: ${reason}` : start;
    hint.hidden = this.brush.drawing || (!reason && !empty) || !header;
  }

  showWarnings() {
    const { header } = this.stage;
    fillList(byId("warnings"), [...new Set([header?.doubt, ...(this.stripWarnings ?? [])].filter(Boolean))]);
  }

  /** @param {CanvasRenderingContext2D} context @param {any} view */
  paintStrokes(context, view) {
    if (this.state.method !== "strokes") return;
    for (const stroke of this.state.strokes) if (stroke.frame === this.stage.header?.index) paintStroke(context, view, stroke);
  }
}

/** @param {import("./brush.js").Stroke[]} strokes @param {number} others */
function told(strokes, others) {
  if (strokes.length === 0) return others ? "The settings have strokes on other pictures. Clear removes them." : "No strokes yet.";
  const frames = new Set(strokes.map((stroke) => stroke.frame)).size;
  const count = `${strokes.length} stroke${strokes.length > 1 ? "s" : ""}`;
  return `${count} on ${frames} frame${frames > 1 ? "s" : ""}. Where the mask is wrong in another frame, draw there too.`;
}
