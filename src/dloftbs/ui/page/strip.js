// The number of objects over the whole source; a change of the number is a step, so that a flicker is seen.

import { clearedContext, oncePerRefresh } from "./dom.js";

export class Strip {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(index: number) => void} seek
   */
  constructor(canvas, seek) {
    this.canvas = canvas;
    /** @type {[number, number][]} */
    this.objects = [];
    this.length = 0;
    this.at = 0;
    this.paint = oncePerRefresh(() => this.paintNow());
    new ResizeObserver(() => this.paint()).observe(canvas);
    const go = (/** @type {PointerEvent} */ event) => {
      const box = canvas.getBoundingClientRect();
      const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
      seek(Math.round(share * Math.max(this.length - 1, 0)));
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      go(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) go(event);
      this.tip(event);
    });
  }

  /** @param {{objects: [number, number][], length: ?number}} strip */
  show({ objects, length }) {
    this.objects = objects;
    this.length = length ?? 1 + (objects.at(-1)?.[0] ?? 0);
    this.paint();
  }

  /** @param {number} index */
  mark(index) {
    this.at = index;
    this.paint();
  }

  /** The number that most frames have. */
  usual() {
    /** @type {Map<number, number>} */
    const times = new Map();
    for (const [, count] of this.objects) times.set(count, (times.get(count) ?? 0) + 1);
    return [...times.entries()].sort((a, b) => b[1] - a[1])[0]?.[0] ?? 0;
  }

  /** What the bars are, in a line. */
  legend() {
    if (this.objects.length === 0) return "";
    const usual = this.usual();
    const others = this.objects.filter(([, count]) => count !== usual).length;
    const most = `Bars: objects in a frame. Blue: ${usual}, as in most frames.`;
    return others === 0 ? most : `${most} Yellow: another number, in ${others} frame${others > 1 ? "s" : ""}; click on one to look.`;
  }

  /** @param {PointerEvent} event */
  tip(event) {
    const box = this.canvas.getBoundingClientRect();
    const index = Math.floor(((event.clientX - box.left) / box.width) * Math.max(this.length, 1));
    const [at, count] = this.objects.findLast(([each]) => each <= index) ?? [0, null];
    const usual = this.usual();
    const compared = count === usual ? "as in most frames (blue)" : `most frames have ${usual} (yellow)`;
    this.canvas.title = count === null ? "" : `frame ${at + 1}: ${count} object${count === 1 ? "" : "s"}, ${compared}`;
  }

  paintNow() {
    const { context, width, height } = clearedContext(this.canvas);
    const room = Math.max(this.length, 1);
    const most = Math.max(3, ...this.objects.map(([, count]) => count));
    const usual = this.usual();
    context.fillStyle = "#1b2027";
    context.fillRect(0, height - 1, width, 1);
    const step = this.objects.length > 1 ? this.objects[1][0] - this.objects[0][0] : 1;
    for (const [index, count] of this.objects) {
      const left = (index / room) * width;
      const wide = Math.max(1, (step / room) * width + 0.4);
      context.fillStyle = count === usual ? "#56b4e9" : "#f0c95c";
      context.globalAlpha = count === usual ? 0.75 : 1;
      const tall = Math.max(2, (count / most) * (height - 4));
      context.fillRect(left, height - tall, wide, tall);
    }
    context.globalAlpha = 1;
    const x = ((this.at + 0.5) / room) * width;
    context.fillStyle = "#ffffff";
    context.fillRect(Math.min(x - 0.75, width - 1.5), 0, 1.5, height);
  }
}
