// The picture with what lies over it, and the way from the screen to its pixels.

import { clearedContext, oncePerRefresh } from "./dom.js";
import { drawCurves } from "./curves.js";
import { paintRuns } from "./mask.js";
import { paintRegion } from "./region.js";

const MAX_ZOOM = 40;

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.mask = document.createElement("canvas");
    /** @type {?ImageBitmap} */
    this.picture = null;
    /** @type {?any} */
    this.header = null;
    this.shows = { picture: true, mask: true, curves: true };
    this.zoom = 1;
    this.centre = { x: 0.5, y: 0.5 }; // of the view, as shares of the picture
    /** @type {((context: CanvasRenderingContext2D, view: any) => void)[]} */
    this.overlays = [];
    /** @type {(() => void)[]} */
    this.painted = [];
    this.paint = oncePerRefresh(() => this.paintNow());
    new ResizeObserver(() => this.paint()).observe(canvas);
  }

  /**
   * Show a picture; resolves when it is on the screen.
   * @param {import("./connection.js").Picture} picture
   */
  async show({ header, parts }) {
    if (parts.image) {
      const bitmap = await createImageBitmap(new Blob([parts.image], { type: "image/jpeg" }));
      this.picture?.close();
      this.picture = bitmap;
    }
    if (parts.mask) paintRuns(this.mask, parts.mask, header.size[0], header.size[1]);
    this.header = header;
    await new Promise((resolve) => {
      this.painted.push(() => resolve(undefined));
      this.paint();
    });
  }

  /** The place of the picture on the screen: pixels of the frame to CSS pixels. */
  view() {
    const [width, height] = this.header?.size ?? [16, 9];
    const { clientWidth, clientHeight } = this.canvas;
    const scale = Math.min(clientWidth / width, clientHeight / height) * this.zoom;
    const along = (/** @type {number} */ room, /** @type {number} */ size, /** @type {number} */ at) =>
      size <= room ? (room - size) / 2 : Math.min(0, Math.max(room - size, room / 2 - at * size));
    return {
      scale,
      left: along(clientWidth, width * scale, this.centre.x),
      top: along(clientHeight, height * scale, this.centre.y),
      width: width * scale,
      height: height * scale,
    };
  }

  /**
   * Return the pixel of the frame at a place of the page.
   * @param {{clientX: number, clientY: number}} place
   * @returns {[number, number]}
   */
  pixelAt({ clientX, clientY }) {
    const box = this.canvas.getBoundingClientRect();
    const view = this.view();
    const rounded = (/** @type {number} */ value) => Math.round(10 * value) / 10;
    return [
      rounded((clientX - box.left - view.left) / view.scale - 0.5),
      rounded((clientY - box.top - view.top) / view.scale - 0.5),
    ];
  }

  /**
   * Enlarge about a place of the page, or about the middle.
   * @param {number} factor
   * @param {{clientX: number, clientY: number}} [place]
   */
  zoomBy(factor, place) {
    const box = this.canvas.getBoundingClientRect();
    const about = place ?? { clientX: box.left + box.width / 2, clientY: box.top + box.height / 2 };
    const [x, y] = this.pixelAt(about);
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), MAX_ZOOM);
    this.moveTo([x, y], about);
  }

  /**
   * Move the view so that a pixel lies at a place of the page.
   * @param {[number, number]} pixel
   * @param {{clientX: number, clientY: number}} place
   */
  moveTo([x, y], { clientX, clientY }) {
    const box = this.canvas.getBoundingClientRect();
    const [width, height] = this.header?.size ?? [16, 9];
    const { scale } = this.view();
    const share = (/** @type {number} */ at, /** @type {number} */ from, /** @type {number} */ room, /** @type {number} */ size) => {
      const half = Math.min(0.5, room / 2 / (size * scale));
      return Math.min(Math.max((at + 0.5 + (room / 2 - from) / scale) / size, half), 1 - half);
    };
    this.centre = {
      x: share(x, clientX - box.left, box.width, width),
      y: share(y, clientY - box.top, box.height, height),
    };
    this.paint();
  }

  fit() {
    this.zoom = 1;
    this.centre = { x: 0.5, y: 0.5 };
    this.paint();
  }

  /** @param {"picture" | "mask" | "curves"} layer */
  toggle(layer) {
    this.shows[layer] = !this.shows[layer];
    this.paint();
    return this.shows[layer];
  }

  /**
   * Return the colour [red, green, blue] around a pixel of the frame; null beside the picture.
   * @param {[number, number]} pixel
   */
  colourAt([x, y]) {
    if (!this.picture || !this.header) return null;
    const share = this.picture.width / this.header.size[0];
    const probe = new OffscreenCanvas(3, 3);
    const context = /** @type {any} */ (probe.getContext("2d", { willReadFrequently: true }));
    context.drawImage(this.picture, Math.round(x * share) - 1, Math.round(y * share) - 1, 3, 3, 0, 0, 3, 3);
    const data = context.getImageData(0, 0, 3, 3).data;
    if (data[19] === 0) return null;
    const middle = (/** @type {number} */ channel) => [...Array(9).keys()].map((i) => data[4 * i + channel]).sort((a, b) => a - b)[4];
    return [middle(0), middle(1), middle(2)];
  }

  paintNow() {
    const { context } = clearedContext(this.canvas);
    const view = this.view();
    context.imageSmoothingEnabled = view.scale < 3;
    if (this.picture && this.shows.picture) context.drawImage(this.picture, view.left, view.top, view.width, view.height);
    if (this.header) {
      if (this.shows.mask && this.mask.width > 1) {
        context.globalAlpha = this.header.suggested ? 0.55 : 1;
        context.drawImage(this.mask, view.left, view.top, view.width, view.height);
        context.globalAlpha = 1;
      }
      if (this.header.roi) paintRegion(context, view, this.header.roi);
      if (this.shows.curves) drawCurves(context, this.header.curves, view, { faint: this.header.suggested });
    }
    for (const overlay of this.overlays) overlay(context, view);
    for (const done of this.painted.splice(0)) done();
  }
}
