// Small helpers for the page's elements.

/**
 * Return the element with an id.
 * @param {string} id
 * @returns {any}
 */
export function byId(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`the page lacks #${id}`);
  return element;
}

/**
 * Make an element.
 * @param {string} tag
 * @param {Object<string, string>} [attributes]
 * @param {(Node | string)[]} children
 * @returns {HTMLElement}
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/**
 * Set a toggle button.
 * @param {HTMLElement} button
 * @param {boolean} pressed
 */
export function press(button, pressed) {
  button.setAttribute(button.getAttribute("role") === "tab" ? "aria-selected" : "aria-pressed", String(pressed));
}

/**
 * Send the number that a field of cables holds, empty being null, when it is changed; a wrong one is put back.
 * @param {HTMLInputElement} field
 * @param {(objects: ?number) => void} send
 */
export function bindCables(field, send) {
  field.onchange = () => {
    if (field.checkValidity()) send(field.value === "" ? null : Number(field.value));
    else toast(`Cables is a whole number in ${field.min} to ${field.max}, or empty where it is unknown`, true);
  };
}

/**
 * Show the number of cables in its field, unless it is being written.
 * @param {HTMLInputElement} field
 * @param {?number} objects
 */
export function showCables(field, objects) {
  if (document.activeElement !== field || field.checkValidity()) field.value = objects === null ? "" : String(objects);
}

let hiding = 0;

/**
 * Show a line for some seconds.
 * @param {string} text
 * @param {boolean} [isError]
 */
export function toast(text, isError = false) {
  const box = byId("toast");
  box.textContent = text;
  box.classList.toggle("error", isError);
  box.hidden = false;
  clearTimeout(hiding);
  hiding = setTimeout(() => { box.hidden = true; }, isError ? 8000 : 2500);
}

/**
 * Fill a list with lines, and leave it as it is where they are the same.
 * @param {HTMLElement} list
 * @param {string[]} lines
 */
export function fillList(list, lines) {
  if (list.dataset.lines === JSON.stringify(lines)) return;
  list.dataset.lines = JSON.stringify(lines);
  list.replaceChildren(...lines.map((line) => make("li", {}, line)));
}

/**
 * Give a canvas as many pixels as the screen has, and return its context in CSS pixels, cleared.
 * @param {HTMLCanvasElement} canvas
 * @returns {{context: CanvasRenderingContext2D, width: number, height: number}}
 */
export function clearedContext(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/**
 * Return a function that runs another one at most once a screen refresh.
 * @param {() => void} action
 * @returns {() => void}
 */
export function oncePerRefresh(action) {
  let waiting = false;
  return () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      action();
    });
  };
}
