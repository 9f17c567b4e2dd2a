// The region of interest: what is left out is dimmed; a drag makes a rectangle, clicks the corners of a polygon.

const EDGE = "#f0f0f0";
const INK = "rgba(20, 22, 26, 0.75)";
const NEAR_PX = 10; // of the first corner, on the screen: a click there closes the polygon

/** @typedef {[number, number]} Corner */

/**
 * @param {any} view
 * @param {Corner[]} corners
 */
function pathOf(view, corners) {
  const path = new Path2D();
  corners.forEach(([x, y], i) => {
    const at = /** @type {Corner} */ ([view.left + (x + 0.5) * view.scale, view.top + (y + 0.5) * view.scale]);
    if (i === 0) path.moveTo(...at);
    else path.lineTo(...at);
  });
  return path;
}

/** @param {CanvasRenderingContext2D} context @param {Path2D} path */
function strokeEdge(context, path) {
  for (const [colour, width] of [[INK, 3.2], [EDGE, 1.2]]) {
    context.strokeStyle = /** @type {string} */ (colour);
    context.lineWidth = /** @type {number} */ (width);
    context.stroke(path);
  }
}

/**
 * Dim what lies outside of a region, and draw its outline.
 * @param {CanvasRenderingContext2D} context
 * @param {any} view
 * @param {Corner[]} corners
 */
export function paintRegion(context, view, corners) {
  const edge = pathOf(view, corners);
  edge.closePath();
  const outside = new Path2D();
  outside.rect(view.left, view.top, view.width, view.height);
  outside.addPath(edge);
  context.save();
  context.fillStyle = "rgba(14, 16, 19, 0.55)";
  context.fill(outside, "evenodd");
  strokeEdge(context, edge);
  context.restore();
}

export class RegionTool {
  /**
   * @param {import("./stage.js").Stage} stage
   * @param {(region: {box: number[]} | {corners: Corner[]}) => void} send
   * @param {() => void} changed
   */
  constructor(stage, send, changed) {
    this.stage = stage;
    this.send = send;
    this.changed = changed;
    /** @type {?("box" | "polygon")} */
    this.kind = null;
    /** @type {Corner[]} */
    this.corners = [];
    stage.overlays.push((context, view) => this.paint(context, view));
    document.addEventListener("keydown", (event) => {
      if (this.kind === null || (event.key !== "Enter" && event.key !== "Escape")) return;
      event.preventDefault(); // of the button that was pressed last
      if (event.key === "Enter") this.close();
      else this.choose(null);
    });
  }

  get hint() {
    if (this.kind === "box") return "Drag a rectangle around the cables";
    return this.corners.length < 3 ? "Click the corners of a polygon around the cables" : "Click the first corner, or press Enter, to close it";
  }

  /** @param {?("box" | "polygon")} kind */
  choose(kind) {
    this.kind = kind === this.kind ? null : kind;
    this.corners = [];
    this.changed();
    this.stage.paint();
  }

  /**
   * Return the pixel of the frame that is nearest to a place.
   * @param {Corner} place
   * @returns {Corner}
   */
  within([x, y]) {
    const [width, height] = this.stage.header?.size ?? [1, 1];
    return [Math.min(Math.max(Math.round(x), 0), width - 1), Math.min(Math.max(Math.round(y), 0), height - 1)];
  }

  /** @param {Corner[]} points */
  moved(points) {
    if (this.kind === "box" && points.length > 0) this.corners = [this.within(points[0]), this.within(points[points.length - 1])];
    if (points.length === 0 && this.kind === "box") this.corners = [];
  }

  /** @param {Corner[]} points */
  finish(points) {
    if (this.kind === "polygon") {
      this.click(this.within(points[points.length - 1]));
      return;
    }
    this.moved(points);
    const [[ax, ay], [bx, by]] = this.corners;
    this.corners = [];
    if (Math.abs(ax - bx) < 1 || Math.abs(ay - by) < 1) return; // a click is no rectangle
    this.send({ box: [Math.min(ax, bx), Math.min(ay, by), Math.abs(ax - bx) + 1, Math.abs(ay - by) + 1] });
    this.choose(null);
  }

  /** @param {Corner} corner */
  click(corner) {
    const [first] = this.corners;
    const far = first ? Math.hypot(corner[0] - first[0], corner[1] - first[1]) * this.stage.view().scale : Infinity;
    if (this.corners.length >= 3 && far <= NEAR_PX) {
      this.close();
      return;
    }
    this.corners.push(corner);
    this.changed();
  }

  close() {
    if (this.kind !== "polygon" || this.corners.length < 3) return;
    this.send({ corners: this.corners });
    this.choose(null);
  }

  /** @param {CanvasRenderingContext2D} context @param {any} view */
  paint(context, view) {
    if (this.corners.length === 0) return;
    const [[ax, ay], [bx, by]] = [this.corners[0], this.corners[this.corners.length - 1]];
    const drawn = this.kind === "box" ? [[ax, ay], [bx, ay], [bx, by], [ax, by], [ax, ay]] : this.corners;
    strokeEdge(context, pathOf(view, /** @type {Corner[]} */ (drawn)));
    context.fillStyle = EDGE;
    for (const [x, y] of this.kind === "polygon" ? this.corners : []) {
      context.fillRect(view.left + (x + 0.5) * view.scale - 2.5, view.top + (y + 0.5) * view.scale - 2.5, 5, 5);
    }
  }
}
