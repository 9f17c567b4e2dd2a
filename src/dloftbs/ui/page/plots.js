// Little plots over the last frames: milliseconds of the stages, stacked, and frames per second.

import { byId, clearedContext, make, oncePerRefresh } from "./dom.js";

const KEPT = 150;
const COLOURS = ["#56b4e9", "#e69f00", "#1fc38f", "#e08bc0", "#f0e442", "#eb5a20", "#4c7dff", "#b9bec6", "#8d6cc9", "#5fd3d0"];

export class Plots {
  constructor() {
    /** @type {Map<string, number>[]} */
    this.frames = [];
    /** @type {number[]} */
    this.rates = [];
    /** @type {number[]} */
    this.times = [];
    /** @type {string[]} */
    this.names = [];
    this.paint = oncePerRefresh(() => this.paintNow());
    new ResizeObserver(() => this.paint()).observe(byId("stages"));
  }

  /** @param {any} header */
  add(header) {
    this.frames.push(new Map(header.stages));
    this.times.push(performance.now());
    const recent = this.times.slice(-20);
    const seconds = (recent[recent.length - 1] - recent[0]) / 1000;
    this.shown = seconds > 0 ? (recent.length - 1) / seconds : 0;
    this.rates.push(this.shown);
    for (const list of [this.frames, this.rates, this.times]) if (list.length > KEPT) list.shift();
  }

  /** @param {any} header of the newest frame */
  show(header) {
    for (const [name] of header.stages) if (!this.names.includes(name)) this.addName(name);
    const total = header.stages.reduce((/** @type {number} */ sum, /** @type {[string, number]} */ [, ms]) => sum + ms, 0);
    byId("total-ms").textContent = `${total.toFixed(2)} ms`;
    byId("rate-now").textContent = `${(this.shown ?? 0).toFixed(0)} frames/s here, ${header.rate.toFixed(0)} tracked`;
    this.paint();
  }

  /** @param {string} name */
  addName(name) {
    this.names.push(name);
    const swatch = make("i");
    swatch.style.background = this.colour(name);
    byId("legend").append(make("li", {}, swatch, name));
  }

  /** @param {string} name */
  colour(name) {
    return COLOURS[this.names.indexOf(name) % COLOURS.length];
  }

  paintNow() {
    this.paintStages();
    const { context, width, height } = clearedContext(byId("rate"));
    const most = Math.max(30, ...this.rates);
    context.strokeStyle = "#56b4e9";
    context.lineWidth = 1.6;
    context.beginPath();
    this.rates.forEach((rate, i) => context.lineTo((i / (KEPT - 1)) * width, height - 2 - (rate / most) * (height - 6)));
    context.stroke();
    axis(context, width, height, `${Math.round(most)}`);
  }

  paintStages() {
    const { context, width, height } = clearedContext(byId("stages"));
    const sums = this.frames.map((stages) => [...stages.values()].reduce((sum, ms) => sum + ms, 0));
    // A frame that took far longer than the others would make them flat.
    const sorted = [...sums].sort((a, b) => a - b);
    const most = Math.max(1, 1.25 * (sorted[Math.floor(0.97 * (sorted.length - 1))] ?? 1));
    const wide = width / KEPT;
    this.frames.forEach((stages, i) => {
      let below = 0;
      for (const name of this.names) {
        const ms = stages.get(name) ?? 0;
        context.fillStyle = this.colour(name);
        context.fillRect(i * wide, height - ((below + ms) / most) * height, wide + 0.3, (ms / most) * height + 0.3);
        below += ms;
      }
    });
    axis(context, width, height, `${most.toFixed(most < 10 ? 1 : 0)} ms`);
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {string} top */
function axis(context, width, height, top) {
  context.fillStyle = "rgba(255, 255, 255, 0.12)";
  context.fillRect(0, height - 1, width, 1);
  context.fillStyle = "#98a1ae";
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "right";
  context.textBaseline = "top";
  context.fillText(top, width - 2, 1);
}
