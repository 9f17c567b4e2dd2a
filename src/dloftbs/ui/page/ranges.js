// Sliders for ranges of hue, saturation and value; a hue may wrap around 0.

import { Unanswered } from "./connection.js";
import { make } from "./dom.js";

/** @typedef {[number, number, number, number, number, number]} Range hue, saturation and value, each from and to */

const BOUNDS = /** @type {const} */ ([["Hue", 179, 0], ["Saturation", 255, 2], ["Value", 255, 4]]);

/**
 * Return a range around a colour.
 * @param {number[]} rgb
 * @returns {Range}
 */
export function rangeAround([r, g, b]) {
  const [high, low] = [Math.max(r, g, b), Math.min(r, g, b)];
  const chroma = high - low;
  let hue = 0;
  if (chroma > 0) {
    if (high === r) hue = ((g - b) / chroma + 6) % 6;
    else if (high === g) hue = (b - r) / chroma + 2;
    else hue = (r - g) / chroma + 4;
  }
  const h = Math.round(hue * 30);
  const s = high > 0 ? Math.round((255 * chroma) / high) : 0;
  const clamp = (/** @type {number} */ value) => Math.min(255, Math.max(0, value));
  if (s < 50) return [0, 179, 0, clamp(s + 45), clamp(high - 55), clamp(high + 55)]; // grey: no hue to speak of
  return [(h + 171) % 180, (h + 9) % 180, clamp(s - 80), 255, clamp(high - 90), 255];
}

export class Ranges {
  /**
   * @param {HTMLElement} box
   * @param {(ranges: Range[], done: boolean) => void} changed
   */
  constructor(box, changed) {
    this.box = box;
    this.unanswered = new Unanswered();
    this.changed = (/** @type {Range[]} */ ranges, /** @type {boolean} */ done) => {
      if (done) this.unanswered.add(ranges); // a draft has no answer
      changed(ranges, done);
    };
    /** @type {Range[]} */
    this.ranges = [];
    this.dragging = false;
  }

  /** @param {Range[]} ranges */
  show(ranges) {
    const isNewest = this.unanswered.isNewest(ranges);
    if (this.dragging || !isNewest || JSON.stringify(ranges) === JSON.stringify(this.ranges)) return;
    this.ranges = ranges.map((range) => /** @type {Range} */ ([...range]));
    this.box.replaceChildren(...this.ranges.map((_, i) => this.row(i)));
  }

  /** @param {Range} range */
  add(range) {
    this.changed([...this.ranges, range], true);
  }

  /** @param {number} index */
  row(index) {
    const remove = make("button", { title: "Remove this range" }, "Remove");
    remove.onclick = () => this.changed(this.ranges.filter((_, i) => i !== index), true);
    const head = make("div", { class: "range-head" }, `Range ${index + 1}`, remove);
    return make("div", { class: "range" }, head, ...BOUNDS.map(([name, most, at]) => this.bounds(index, name, most, at)));
  }

  /** @param {number} index @param {string} name @param {number} most @param {number} at */
  bounds(index, name, most, at) {
    const range = this.ranges[index];
    const track = /** @type {HTMLCanvasElement} */ (make("canvas", { width: "256", height: "1" }));
    const told = make("span", { class: "number" });
    const refresh = () => {
      told.textContent = `${range[at]} to ${range[at + 1]}${range[at] > range[at + 1] ? ", through 0" : ""}`;
      paintTrack(track, name, most, range[at], range[at + 1], range[0], range[1]);
    };
    const sliders = [0, 1].map((side) => {
      const label = `${name} ${side ? "to" : "from"}, range ${index + 1}`;
      const slider = /** @type {HTMLInputElement} */ (
        make("input", { type: "range", min: "0", max: String(most), value: String(range[at + side]), "aria-label": label })
      );
      slider.oninput = () => {
        range[at + side] = Number(slider.value);
        if (name !== "Hue" && range[at] > range[at + 1]) range[at + (1 - side)] = range[at + side];
        this.dragging = true;
        sliders.forEach((each, i) => { each.value = String(range[at + i]); });
        this.box.querySelectorAll("canvas").forEach((canvas) => canvas.dispatchEvent(new Event("refresh")));
        this.changed(this.ranges, false);
      };
      slider.onchange = () => {
        this.dragging = false;
        this.changed(this.ranges, true);
      };
      return slider;
    });
    track.addEventListener("refresh", refresh);
    refresh();
    return make("div", { class: "bounds" }, make("span", {}, name), told, make("div", { class: "double" }, track, ...sliders));
  }
}

/**
 * Paint a slider's track: the colours in the range bright, the others dark.
 * @param {HTMLCanvasElement} canvas @param {string} name @param {number} most
 * @param {number} low @param {number} high @param {number} hueLow @param {number} hueHigh
 */
function paintTrack(canvas, name, most, low, high, hueLow, hueHigh) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const span = hueLow <= hueHigh ? hueHigh - hueLow : hueHigh + 180 - hueLow;
  const hue = span > 120 ? null : 2 * ((hueLow + span / 2) % 180); // none where nearly all are in
  for (let i = 0; i < 256; i += 1) {
    const value = (i / 255) * most;
    const inside = low <= high ? value >= low && value <= high : value >= low || value <= high;
    const share = (100 * value) / most;
    let colour = `hsl(${2 * value} 85% 55%)`;
    if (name === "Saturation") colour = hue === null ? `hsl(0 0% ${75 - share / 2}%)` : `hsl(${hue} ${share}% 55%)`;
    if (name === "Value") colour = hue === null ? `hsl(0 0% ${share}%)` : `hsl(${hue} 70% ${share * 0.6}%)`;
    context.globalAlpha = 1;
    context.fillStyle = "#0e1013";
    context.fillRect(i, 0, 1, 1);
    context.globalAlpha = inside ? 1 : 0.16;
    context.fillStyle = colour;
    context.fillRect(i, 0, 1, 1);
  }
}
