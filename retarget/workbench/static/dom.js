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

export const fill = (element, ...children) => {
  element.replaceChildren(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return element;
};

// A button with its key in the title, such as button("Undo", "Ctrl+Z", f).
export function button(text, key, act, kind = "") {
  const title = key ? `${text} (${key})` : text;
  return make(`button${kind && "." + kind}`, { type: "button", title, onclick: act }, text);
}

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
