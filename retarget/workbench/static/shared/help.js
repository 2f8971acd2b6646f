// The list of keys, made of the tables that the keys act by.
import { fill, make } from "./dom.js";
import { spoken } from "./keys.js";

export function makeHelp(root) {
  const list = make("div.lists");
  const close = make("button", { type: "button", onclick: () => dialog.close() }, "Close (Esc)");
  const dialog = make("dialog.help", { "aria-label": "Keys" }, make("header", {}, make("h2", {}, "Keys"), close), list);
  let before = null; // what had the focus
  dialog.onclose = () => before?.focus?.();
  dialog.addEventListener("keydown", (event) => event.stopPropagation()); // keys are for nobody behind it
  root.append(dialog);

  return (tables) => {
    const said = ({ said: text, what }) => [make("dt", {}, make("kbd", {}, spoken(text))), make("dd", {}, what)];
    fill(list, ...Object.entries(tables).map(([name, table]) => make("section", {}, make("h3", {}, name), make("dl", {}, ...table.flatMap(said)))));
    before = root.getRootNode().activeElement;
    dialog.showModal();
  };
}
