// A mask as a canvas that is laid over the picture.

const CABLE = 0x8cffffff; // ABGR: white, half transparent, whatever the colour of the cable
const GROUND = 0x80000000; // black: the picture steps back where there is no cable

/**
 * Draw run lengths of ground and cable, in turn, into a canvas.
 * @param {HTMLCanvasElement | OffscreenCanvas} canvas
 * @param {ArrayBuffer} data
 * @param {number} width
 * @param {number} height
 */
export function paintRuns(canvas, data, width, height) {
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const runs = new Uint32Array(data);
  const image = new ImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer);
  let at = 0;
  for (let i = 0; i < runs.length; i += 1) {
    pixels.fill(i % 2 ? CABLE : GROUND, at, at + runs[i]);
    at += runs[i];
  }
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.putImageData(image, 0, 0);
}
