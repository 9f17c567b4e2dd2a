// Curves in space, in metres, turned by dragging or by the arrow keys.

import { clearedContext, oncePerRefresh } from "./dom.js";

export class Space {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** @type {any[]} */
    this.curves = [];
    this.turn = { yaw: 0.6, pitch: -0.5, zoom: 1 };
    /** @type {?{centre: number[], reach: number}} */
    this.box = null;
    this.paint = oncePerRefresh(() => this.paintNow());
    new ResizeObserver(() => this.paint()).observe(canvas);
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) this.turnBy(event.movementX / 120, event.movementY / 120);
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY / 400));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      const step = steps[/** @type {"ArrowLeft"} */ (event.key)];
      if (step) this.turnBy(step[0], step[1]);
      else if (event.key === "+" || event.key === "-") this.zoomBy(event.key === "+" ? 1.2 : 1 / 1.2);
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  /** @param {number} yaw @param {number} pitch */
  turnBy(yaw, pitch) {
    this.turn.yaw += yaw;
    this.turn.pitch = Math.min(Math.max(this.turn.pitch - pitch, -1.55), 1.55);
    this.paint();
  }

  /** @param {number} factor */
  zoomBy(factor) {
    this.turn.zoom = Math.min(Math.max(this.turn.zoom * factor, 0.3), 8);
    this.paint();
  }

  /** @param {any[]} curves */
  show(curves) {
    this.curves = curves.filter((curve) => curve.space);
    if (this.curves.length) this.follow();
    this.paint();
  }

  /** Keep all in view: at once at first, slowly afterwards. */
  follow() {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const { space } of this.curves) {
      space.forEach((/** @type {number} */ value, /** @type {number} */ i) => {
        low[i % 3] = Math.min(low[i % 3], value);
        high[i % 3] = Math.max(high[i % 3], value);
      });
    }
    const centre = low.map((value, i) => (value + high[i]) / 2);
    const reach = Math.max(0.02, Math.hypot(...high.map((value, i) => value - low[i])) / 2);
    const share = this.box ? 0.1 : 1;
    const before = this.box ?? { centre, reach };
    this.box = {
      centre: before.centre.map((value, i) => value + share * (centre[i] - value)),
      reach: Math.max(before.reach + share * (reach - before.reach), 0.02),
    };
  }

  /** @param {number} width @param {number} height */
  projection(width, height) {
    const { yaw, pitch, zoom } = this.turn;
    const { centre, reach } = /** @type {any} */ (this.box);
    const scale = (0.42 * Math.min(width, height * 1.2) * zoom) / reach;
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    return (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) => {
      const [a, b, c] = [x - centre[0], y - centre[1], z - centre[2]];
      const [side, depth] = [cy * a + sy * c, -sy * a + cy * c];
      return /** @type {[number, number]} */ ([width / 2 + scale * side, height / 2 + scale * (cp * b + sp * depth)]);
    };
  }

  paintNow() {
    const { context, width, height } = clearedContext(this.canvas);
    if (!this.box || !this.curves.length) return;
    const project = this.projection(width, height);
    this.paintGrid(context, project);
    context.lineCap = "round";
    context.lineJoin = "round";
    for (const curve of this.curves) this.paintCurve(context, project, curve);
  }

  /** @param {CanvasRenderingContext2D} context @param {any} project */
  paintGrid(context, project) {
    const { centre, reach } = /** @type {any} */ (this.box);
    const size = 10 ** Math.floor(Math.log10(reach)) * (reach / 10 ** Math.floor(Math.log10(reach)) > 4 ? 2 : 1) * 0.5;
    const count = Math.ceil(reach / size);
    const back = centre[2] + reach * 0.6; // behind the curves, as the camera sees them
    context.strokeStyle = "rgba(255, 255, 255, 0.09)";
    context.lineWidth = 1;
    context.beginPath();
    for (let i = -count; i <= count; i += 1) {
      context.moveTo(...project(centre[0] + i * size, centre[1] - count * size, back));
      context.lineTo(...project(centre[0] + i * size, centre[1] + count * size, back));
      context.moveTo(...project(centre[0] - count * size, centre[1] + i * size, back));
      context.lineTo(...project(centre[0] + count * size, centre[1] + i * size, back));
    }
    context.stroke();
    context.fillStyle = "#98a1ae";
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "bottom";
    const unit = size >= 1 ? `${size} m` : size >= 0.01 ? `${Math.round(size * 100)} cm` : `${Math.round(size * 1000)} mm`;
    context.fillText(`grid ${unit}`, 8, this.canvas.clientHeight - 6);
  }

  /** @param {CanvasRenderingContext2D} context @param {any} project @param {any} curve */
  paintCurve(context, project, curve) {
    const count = curve.space.length / 3;
    const at = (/** @type {number} */ i) => project(curve.space[3 * i], curve.space[3 * i + 1], curve.space[3 * i + 2]);
    const unseen = (/** @type {number} */ i) =>
      curve.hidden || curve.inferred_space.some(([a, b]) => (i + 0.5) / (count - 1) > a && (i + 0.5) / (count - 1) < b);
    context.strokeStyle = curve.colour;
    for (let i = 0; i + 1 < count; i += 1) {
      context.globalAlpha = unseen(i) ? 0.35 : 1;
      context.lineWidth = unseen(i) ? 1.4 : 2.6;
      context.beginPath();
      context.moveTo(...at(i));
      context.lineTo(...at(i + 1));
      context.stroke();
    }
    context.globalAlpha = 1;
    if (curve.closed) return;
    context.fillStyle = curve.colour;
    context.beginPath();
    context.arc(...at(0), 4.5, 0, 7);
    context.fill();
    context.beginPath();
    context.arc(...at(count - 1), 4.5, 0, 7);
    context.fillStyle = "#0e1013";
    context.fill();
    context.lineWidth = 2;
    context.stroke();
  }
}
