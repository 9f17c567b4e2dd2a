// Keys, and the sheet that tells them.

import { byId, make } from "./dom.js";

/** @typedef {[keys: string[], meaning: string, action: (event: KeyboardEvent) => void]} Binding */

const SHOWN = { ArrowLeft: "←", ArrowRight: "→", " ": "Space" };

/**
 * Listen to keys, and fill the sheet.
 * @param {Binding[]} bindings
 */
export function bindKeys(bindings) {
  const help = byId("help");
  const all = /** @type {Binding[]} */ ([...bindings, [["?"], "This sheet", () => help.showModal()]]);
  byId("keys").replaceChildren(
    ...all.flatMap(([keys, meaning]) => [
      make("dt", {}, ...keys.flatMap((key, i) => [i ? " " : "", make("kbd", {}, SHOWN[/** @type {" "} */ (key)] ?? key)])),
      make("dd", {}, meaning),
    ]),
  );
  byId("help-button").onclick = () => help.showModal();
  document.addEventListener("keydown", (event) => {
    if (help.open || event.altKey) return;
    const target = /** @type {HTMLElement} */ (event.target);
    const slides = target instanceof HTMLInputElement && target.type === "range" && target.id !== "scrubber";
    const isWritten = target instanceof HTMLInputElement && target.type === "number";
    if (isWritten) return;
    const arrows = event.key.startsWith("Arrow") || event.key === "Home" || event.key === "End";
    if (arrows && (slides || target.id === "space")) return;
    if (event.key === " " && target instanceof HTMLButtonElement) return;
    if ((event.ctrlKey || event.metaKey) && !["z", "y", "s"].includes(event.key.toLowerCase())) return;
    const key = event.key.length === 1 ? event.key.toUpperCase() : event.key;
    const found = all.find(([keys]) => keys.includes(key));
    if (!found) return;
    event.preventDefault();
    found[2](event);
  });
}
