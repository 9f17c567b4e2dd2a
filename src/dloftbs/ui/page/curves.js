// Curves as vectors, drawn as the package draws its overlays: halos, arrows, ends, crossings, dashes, labels.

const INK = "rgba(20, 22, 26, 0.75)";
const PAPER = "#f0f0f0";
const FONT = "600 12px system-ui, sans-serif";

/**
 * @typedef {Object} Curve
 * @property {string} label
 * @property {string} colour
 * @property {number[]} points x, y in turn, at even u
 * @property {boolean} closed
 * @property {?number} width_px
 * @property {[number, number][]} inferred
 * @property {boolean} hidden
 * @property {number[]} below
 * @property {number[]} unordered
 * @property {number[]} crossed
 * @property {number} confidence
 */

/** A line on the screen, measured along its length. */
export class Line {
  /**
   * @param {number[]} points
   * @param {{scale: number, left: number, top: number}} view
   */
  constructor(points, view) {
    const count = points.length / 2;
    this.x = new Float32Array(count);
    this.y = new Float32Array(count);
    this.s = new Float32Array(count);
    for (let i = 0; i < count; i += 1) {
      // Whole coordinates are the centres of pixels.
      this.x[i] = view.left + (points[2 * i] + 0.5) * view.scale;
      this.y[i] = view.top + (points[2 * i + 1] + 0.5) * view.scale;
      if (i > 0) this.s[i] = this.s[i - 1] + Math.hypot(this.x[i] - this.x[i - 1], this.y[i] - this.y[i - 1]);
    }
    this.length = this.s[count - 1];
  }

  /** @param {number} u */
  arcAt(u) {
    const at = Math.min(Math.max(u, 0), 1) * (this.s.length - 1);
    const i = Math.min(Math.floor(at), this.s.length - 2);
    return this.s[i] + (this.s[i + 1] - this.s[i]) * (at - i);
  }

  /**
   * @param {number} s
   * @returns {[number, number]}
   */
  point(s) {
    const i = this.before(s);
    const span = this.s[i + 1] - this.s[i];
    const share = span > 0 ? Math.min(Math.max((s - this.s[i]) / span, 0), 1) : 0;
    return [this.x[i] + (this.x[i + 1] - this.x[i]) * share, this.y[i] + (this.y[i + 1] - this.y[i]) * share];
  }

  /** @param {number} s */
  before(s) {
    let [low, high] = [0, this.s.length - 2];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.s[middle] <= s) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /**
   * @param {Path2D} path
   * @param {number} from
   * @param {number} to
   */
  addPiece(path, from, to) {
    path.moveTo(...this.point(from));
    for (let i = this.before(from) + 1; i < this.s.length && this.s[i] < to; i += 1) path.lineTo(this.x[i], this.y[i]);
    path.lineTo(...this.point(to));
  }
}

/**
 * Draw curves.
 * @param {CanvasRenderingContext2D} context
 * @param {Curve[]} curves
 * @param {{scale: number, left: number, top: number}} view
 * @param {{faint?: boolean}} [options]
 */
export function drawCurves(context, curves, view, options = {}) {
  const drawn = curves.filter((curve) => curve.points.length >= 4).map((curve) => ({ curve, line: new Line(curve.points, view) }));
  context.save();
  context.lineCap = "round";
  context.lineJoin = "round";
  context.globalAlpha = options.faint ? 0.75 : 1;
  for (const { curve, line } of drawn) drawLine(context, curve, line, view.scale);
  for (const { curve, line } of drawn) drawMarkers(context, curve, line);
  if (!options.faint) for (const { curve, line } of drawn) drawLabel(context, curve, line);
  context.restore();
}

/** @param {Curve} curve @param {number} scale */
function lineWidth(curve, scale) {
  return curve.width_px === null ? 2.6 : Math.max(1.4, Math.min(2.8, (curve.width_px * scale) / 3));
}

/**
 * Return the seen and the inferred pieces of a line; the lower of two that cross is interrupted.
 * @param {Curve} curve
 * @param {Line} line
 * @param {number} width
 */
export function pieces(curve, line, width) {
  const inferred = (curve.hidden ? [[0, 1]] : curve.inferred).map(([a, b]) => [line.arcAt(a), line.arcAt(b)]);
  const cut = curve.below.map((u) => [line.arcAt(u) - 3 * width, line.arcAt(u) + 3 * width]);
  const bounds = [0, line.length, ...inferred.flat(), ...cut.flat()].filter((s) => s >= 0 && s <= line.length);
  bounds.sort((a, b) => a - b);
  const seen = [];
  const dashed = [];
  for (let i = 0; i + 1 < bounds.length; i += 1) {
    const [from, to] = [bounds[i], bounds[i + 1]];
    const middle = (from + to) / 2;
    const within = (/** @type {number[]} */ span) => middle > span[0] && middle < span[1];
    if (to - from < 0.05 || cut.some(within)) continue;
    (inferred.some(within) ? dashed : seen).push([from, to]);
  }
  return { seen, dashed };
}

/** @param {CanvasRenderingContext2D} context @param {Curve} curve @param {Line} line @param {number} scale */
function drawLine(context, curve, line, scale) {
  const width = lineWidth(curve, scale);
  const { seen, dashed } = pieces(curve, line, width);
  const [whole, broken] = [new Path2D(), new Path2D()];
  for (const [from, to] of seen) line.addPiece(whole, from, to);
  for (const [from, to] of dashed) line.addPiece(broken, from, to);
  for (const [colour, thick] of [[INK, width + 2.6], [curve.colour, width]]) {
    context.strokeStyle = /** @type {string} */ (colour);
    context.lineWidth = /** @type {number} */ (thick);
    context.setLineDash([]);
    context.stroke(whole);
    context.setLineDash([7, 9]);
    context.stroke(broken);
  }
  context.setLineDash([]);
}

/** @param {CanvasRenderingContext2D} context @param {Curve} curve @param {Line} line */
function drawMarkers(context, curve, line) {
  for (const s of arrowPlaces(curve, line)) drawArrow(context, line, s, curve.colour);
  for (const u of curve.unordered) ring(context, line.point(line.arcAt(u)), 4, PAPER, 1.4);
  if (curve.closed) return;
  const [x, y] = line.point(0);
  context.fillStyle = INK;
  context.beginPath();
  context.arc(x, y, 6.3, 0, 7);
  context.fill();
  context.fillStyle = curve.colour;
  context.beginPath();
  context.arc(x, y, 5, 0, 7);
  context.fill();
  ring(context, line.point(line.length), 5.4, curve.colour, 2.4);
}

/** @param {CanvasRenderingContext2D} context @param {[number, number]} at @param {number} radius @param {string} colour @param {number} width */
function ring(context, [x, y], radius, colour, width) {
  for (const [stroke, thick] of [[INK, width + 2.4], [colour, width]]) {
    context.strokeStyle = /** @type {string} */ (stroke);
    context.lineWidth = /** @type {number} */ (thick);
    context.beginPath();
    context.arc(x, y, radius, 0, 7);
    context.stroke();
  }
}

/** @param {Curve} curve @param {Line} line */
function arrowPlaces(curve, line) {
  const count = Math.max(1, Math.round(line.length / 120));
  const taken = curve.crossed.map((u) => line.arcAt(u));
  const hidden = curve.inferred.map(([a, b]) => [line.arcAt(a), line.arcAt(b)]);
  return Array.from({ length: count }, (_, i) => (line.length * (i + 0.5)) / count).filter(
    (s) => taken.every((t) => Math.abs(t - s) > 18) && hidden.every(([a, b]) => s < a - 8 || s > b + 8),
  );
}

/** @param {CanvasRenderingContext2D} context @param {Line} line @param {number} s @param {string} colour */
function drawArrow(context, line, s, colour) {
  const [x, y] = line.point(s);
  const [[ax, ay], [bx, by]] = [line.point(s - 5), line.point(s + 5)];
  context.save();
  context.translate(x, y);
  context.rotate(Math.atan2(by - ay, bx - ax));
  context.beginPath();
  context.moveTo(8, 0);
  context.lineTo(-5.5, -6);
  context.lineTo(-5.5, 6);
  context.closePath();
  context.lineWidth = 2.2;
  context.strokeStyle = INK;
  context.stroke();
  context.fillStyle = colour;
  context.fill();
  context.restore();
}

/** @param {CanvasRenderingContext2D} context @param {Curve} curve @param {Line} line */
function drawLabel(context, curve, line) {
  const sure = curve.confidence < 0.95 ? `  ${Math.round(100 * curve.confidence)} %` : "";
  const text = `${curve.label}${sure}`;
  context.font = FONT;
  const [width, height] = [context.measureText(text).width + 12, 19];
  const [[x, y], [nx, ny]] = [line.point(0), line.point(Math.min(24, line.length))];
  // Away from where the curve goes.
  const left = nx >= x ? x - width - 9 : x + 9;
  const top = ny >= y ? y - height - 5 : y + 5;
  const { clientWidth, clientHeight } = context.canvas;
  const [a, b] = [Math.min(Math.max(left, 2), clientWidth - width - 2), Math.min(Math.max(top, 2), clientHeight - height - 2)];
  context.fillStyle = "rgba(14, 16, 19, 0.86)";
  context.beginPath();
  context.roundRect(a, b, width, height, 5);
  context.fill();
  context.fillStyle = curve.colour;
  context.textBaseline = "middle";
  context.fillText(text, a + 6, b + height / 2 + 0.5);
}
