// Drawing on the picture with a mouse, a pen or a finger; two fingers move and enlarge.

const NOT = "#ff8266";
const CABLE = "#56b4e9";

/**
 * @typedef {Object} Stroke
 * @property {number} frame
 * @property {[number, number][]} points
 * @property {boolean} cable
 * @property {number} radius_px
 */

export class Brush {
  /**
   * @param {import("./stage.js").Stage} stage
   * @param {{
   *   tool: () => "cable" | "not" | "erase" | "pick" | "none",
   *   radius: () => number,
   *   began: () => void,
   *   moved: (points: [number, number][]) => void, without points where they are dropped
   *   done: (points: [number, number][]) => void,
   * }} hands
   */
  constructor(stage, hands) {
    this.stage = stage;
    this.hands = hands;
    /** @type {Map<number, PointerEvent>} */
    this.pointers = new Map();
    /** @type {?[number, number][]} */
    this.points = null;
    /** @type {?{x: number, y: number}} */
    this.hover = null;
    /** @type {?{pixel: [number, number], distance: number}} */
    this.pinch = null;
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.cancel(event));
    canvas.addEventListener("pointerleave", () => {
      this.hover = null;
      stage.paint();
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      stage.zoomBy(Math.exp(-event.deltaY / 400), event);
    }, { passive: false });
    stage.overlays.push((context, view) => this.paint(context, view));
  }

  get drawing() {
    return this.points !== null;
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (event.button !== 0) return;
    this.stage.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event);
    if (this.pointers.size === 2) {
      this.drop();
      this.pinch = this.grip();
    } else if (this.pointers.size === 1 && this.stage.header && this.hands.tool() !== "none") {
      this.points = [this.stage.pixelAt(event)];
      this.hands.began();
      this.hands.moved(this.points);
    } else if (this.hands.tool() === "none") {
      this.pinch = this.grip();
    }
    this.stage.paint();
  }

  /** @param {PointerEvent} event */
  move(event) {
    const box = this.stage.canvas.getBoundingClientRect();
    this.hover = event.pointerType === "touch" ? null : { x: event.clientX - box.left, y: event.clientY - box.top };
    if (this.pointers.has(event.pointerId)) this.pointers.set(event.pointerId, event);
    if (this.pinch) this.follow(this.pinch);
    else if (this.points && this.pointers.has(event.pointerId)) {
      for (const each of event.getCoalescedEvents?.() ?? [event]) this.add(this.stage.pixelAt(each));
      this.hands.moved(this.points);
    }
    this.stage.paint();
  }

  /** @param {[number, number]} point */
  add(point) {
    if (!this.points) return;
    const last = this.points[this.points.length - 1];
    const near = Math.hypot(point[0] - last[0], point[1] - last[1]) < Math.max(0.5, this.hands.radius() / 3);
    if (!near && this.points.length < 4000) this.points.push(point);
  }

  /** @param {PointerEvent} event */
  up(event) {
    const points = this.points;
    this.release(event);
    if (points) this.hands.done(points);
    this.stage.paint();
  }

  /** @param {PointerEvent} event */
  cancel(event) {
    this.drop();
    this.release(event);
    this.stage.paint();
  }

  drop() {
    const points = this.points;
    this.points = null;
    if (points) this.hands.moved([]);
  }

  /** @param {PointerEvent} event */
  release(event) {
    this.pointers.delete(event.pointerId);
    this.points = null;
    this.pinch = this.pinch && this.pointers.size > 0 ? this.grip() : null;
  }

  /** The pixel between the fingers, and how far these are apart. */
  grip() {
    const { place, distance } = this.fingers();
    return { pixel: this.stage.pixelAt(place), distance };
  }

  fingers() {
    const [a, b = a] = [...this.pointers.values()];
    const place = { clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2 };
    return { place, distance: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY) };
  }

  /** @param {{pixel: [number, number], distance: number}} pinch */
  follow(pinch) {
    const { place, distance } = this.fingers();
    if (distance > 10 && pinch.distance > 10) {
      this.stage.zoomBy(distance / pinch.distance, place);
      pinch.distance = distance;
    }
    this.stage.moveTo(pinch.pixel, place);
  }

  /** @param {CanvasRenderingContext2D} context @param {any} view */
  paint(context, view) {
    const tool = this.hands.tool();
    if (tool === "none" || tool === "pick") return;
    const radius = Math.max(1.5, this.hands.radius() * view.scale);
    const colour = tool === "cable" ? CABLE : tool === "not" ? NOT : "#ffffff";
    if (this.points && tool !== "erase") {
      const cable = tool === "cable";
      paintStroke(context, view, { frame: 0, points: this.points, cable, radius_px: this.hands.radius() });
    }
    if (!this.hover) return;
    for (const [stroke, width] of [["rgba(0, 0, 0, 0.8)", 3.4], [colour, 1.6]]) {
      context.strokeStyle = /** @type {string} */ (stroke);
      context.lineWidth = /** @type {number} */ (width);
      context.beginPath();
      context.arc(this.hover.x, this.hover.y, radius, 0, 7);
      context.stroke();
    }
    context.fillStyle = colour;
    context.fillRect(this.hover.x - 1, this.hover.y - 1, 2, 2);
  }
}

/**
 * Paint a stroke: its brush, and its line, which is dashed for what is not cable.
 * @param {CanvasRenderingContext2D} context
 * @param {any} view
 * @param {Stroke} stroke
 */
export function paintStroke(context, view, stroke) {
  const path = new Path2D();
  stroke.points.forEach(([x, y], i) => {
    const at = /** @type {[number, number]} */ ([view.left + (x + 0.5) * view.scale, view.top + (y + 0.5) * view.scale]);
    if (i === 0) path.moveTo(...at);
    path.lineTo(...at);
  });
  context.save();
  context.lineCap = "round";
  context.lineJoin = "round";
  context.strokeStyle = stroke.cable ? "rgba(86, 180, 233, 0.4)" : "rgba(255, 130, 102, 0.4)";
  context.lineWidth = Math.max(3, 2 * stroke.radius_px * view.scale);
  context.stroke(path);
  context.strokeStyle = stroke.cable ? "#ffffff" : NOT;
  context.lineWidth = 1.5;
  if (!stroke.cable) context.setLineDash([4, 4]);
  context.stroke(path);
  context.restore();
}
