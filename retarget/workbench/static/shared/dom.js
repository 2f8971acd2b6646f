// Small helpers for elements.

// make("button.primary", {title: "…", onclick: f}, "Capture") -> an element
export function make(what, properties = {}, ...children) {
  const [tag, ...classes] = what.split(".");
  const element = document.createElement(tag || "div");
  if (classes.length) element.className = classes.join(" ");
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-") || name === "role" || name === "for") element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

// New children in the place of all there were.  Whoever worked by keys finds the focus on what is the same in the new ones,
// or, where that cannot have it now, on the whole until it can.
export const fill = (element, ...children) => {
  const held = element.getRootNode().activeElement;
  const inside = Boolean(held) && element.contains(held);
  const sought = !inside ? "" : held === element ? focused.get(element) : named(held);
  const span = inside && held.matches("input[type=text]") && [held.value, held.selectionStart, held.selectionEnd];
  element.replaceChildren(...children.filter((child) => child !== null && child !== undefined && child !== false));
  if (!inside) return element;
  focused.set(element, sought);
  const same = [...element.querySelectorAll(CAN_HOLD)].find((one) => named(one) === sought);
  if (!same && !element.hasAttribute("tabindex")) element.tabIndex = -1;
  (same ?? element).focus({ preventScroll: true });
  if (same && span && same.value === span[0]) same.setSelectionRange(span[1], span[2]);
  return element;
};

const CAN_HOLD = "button:enabled, input:enabled, select:enabled, [tabindex]";
const focused = new WeakMap(); // element -> what in it had the focus, until that can have it again
const named = (one) => [one.tagName, one.getAttribute("aria-label") || one.closest("label")?.textContent || one.title || one.textContent].join();

// A button with its key in the title, such as button("Undo", "Ctrl+Z", f).
export function button(text, key, act, kind = "") {
  const title = key ? `${text} (${key})` : text;
  return make(`button${kind && "." + kind}`, { type: "button", title, onclick: act }, text);
}

const ICONS = {
  first: "M3 2v12h2V2zm10 0L6 8l7 6z",
  back: "M10 2 4 8l6 6 1.5-1.5L7 8l4.5-4.5z",
  play: "M4 2l9 6-9 6z",
  stop: "M4 2h3v12H4zm5 0h3v12H9z",
  on: "M6 2l6 6-6 6-1.5-1.5L9 8 4.5 3.5z",
  last: "M11 2v12h2V2zM3 2l7 6-7 6z",
};

// A small picture for a button; drawn, for not every machine has a font with such signs.
export function icon(name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  return svg;
}

export function iconButton(name, text, act) {
  return make("button.icon", { type: "button", title: text, "aria-label": text, onclick: act }, icon(name));
}

// A canvas that is worked on: its name for who does not see it, and all keys are for it.
export function place(canvas, name) {
  canvas.setAttribute("role", "application");
  canvas.setAttribute("aria-label", name);
}

export const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches; // nothing is to move by itself

// A labelled slider; `changed(value, done)`.
export function slider(text, { min, max, step, value }, changed) {
  const shown = make("output", {}, String(value));
  const input = make("input", { type: "range", min, max, step });
  input.value = value;
  const tell = (done) => {
    shown.textContent = input.value;
    changed(Number(input.value), done);
  };
  input.oninput = () => tell(false);
  input.onchange = () => tell(true);
  return make("label.slider", {}, make("span", {}, text), input, shown);
}

export const PART_COLORS = ["#ff5d5d", "#5b9dff", "#ffb03b", "#b98cff", "#35c9bb", "#ff7ab0"];
