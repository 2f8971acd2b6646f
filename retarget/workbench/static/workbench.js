// The workbench: a bar with what is open, undo and the desks' tabs; below it one desk at a time.
// A plain ES module after anywidget's front-end contract: the same in a page of its own and in a notebook.
//
// A desk is a module with `title` and mount(el, bench) -> {changed(sections), key(event), shown(), hidden()}:
// `changed` is called after every change of the state (bench.state holds all of it) while the desk is seen, `shown` and
// `hidden` when its tab comes and goes; `key` returns true where it took a key.  `dropped(files)`, if there is one,
// returns true where the desk took what was dropped on the page.
import { makeArrivals } from "./shared/arrivals.js";
import { makeBench } from "./bench.js";
import * as capture from "./capturing/desk.js";
import { button, fill, make } from "./shared/dom.js";
import { filesPanel } from "./files.js";
import { makeHelp } from "./shared/help.js";
import { key, press } from "./shared/keys.js";
import * as posing from "./posing/desk.js";
import * as stage from "./staging/desk.js";

const DESKS = { capture, stage, posing };

function render({ model, el }) {
  const bench = makeBench(model);
  const desks = {}; // name -> {tab, place, desk}
  let current = "";

  const opened = make("span.opened");
  const tabs = make("nav.tabs", { role: "tablist", "aria-label": "Desks" });
  const undo = button("Undo", "Ctrl+Z", () => bench.act("undo"));
  const redo = button("Redo", "Ctrl+Shift+Z", () => bench.act("redo"));
  const files = button("Open…", "", () => bench.act("folder.close"));
  const keys = button("?", "", () => help());
  const work = make("div.work", { hidden: true });
  const bar = make("header.bar", {}, make("h1.brand", {}, "tooncap"), files, opened, tabs, make("div.space"), work, undo, redo, keys);
  const said = make("div.said", { role: "status", "aria-live": "polite", hidden: true });
  const room = make("main.room");
  const start = make("section.start");
  const root = make("div.tooncap", { tabIndex: -1 }, bar, room, said);
  room.append(start);
  el.append(root);

  for (const [name, desk] of Object.entries(DESKS)) {
    const place = make("section.desk", { hidden: true, role: "tabpanel", "aria-label": desk.title });
    const tab = make("button.tab", { type: "button", role: "tab", onclick: () => choose(name) }, desk.title);
    tabs.append(tab);
    room.append(place);
    desks[name] = { tab, place, desk: desk.mount(place, bench) };
  }
  const takes = (files) => isOpen() && Boolean(desks[current]?.desk.dropped?.(files));
  const panel = filesPanel(start, bench, makeArrivals(root, bench, takes));

  function choose(name) {
    if (desks[current]) desks[current].desk.hidden?.();
    current = name;
    const held = focused();
    for (const [other, { tab, place }] of Object.entries(desks)) {
      place.hidden = other !== name || !isOpen();
      tab.setAttribute("aria-selected", String(other === name));
    }
    if (isOpen()) desks[name].desk.shown?.();
    settle(held);
  }

  // What had the focus may be hidden now, or have nothing more to do: then it goes to where the work goes on.
  const focused = () => [root.getRootNode().activeElement].find((one) => root.contains(one));
  function settle(held) {
    const now = focused();
    if (!held || (now?.checkVisibility() && !now.disabled)) return;
    const next = held === undo ? redo : held === redo ? undo : null;
    if (next && !next.disabled && next.checkVisibility()) next.focus();
    else (isOpen() ? desks[current].place.querySelector("canvas.view") : start.querySelector("button:enabled"))?.focus({ preventScroll: true });
  }

  // Where there is no clip there is nothing to capture: a figure is posed, a motion is lent to others.
  const firstDesk = () => (bench.state.posing.figure ? "posing" : bench.state.stage.motion && !bench.state.capture.clip ? "stage" : "capture");
  bench.show = choose; // for what a desk cannot do itself, such as to capture

  const wantsDrawing = () => Boolean(bench.state.capture.motion && !bench.state.capture.stale && !bench.state.stage.cast);
  const isOpen = () => Boolean(bench.state.folder?.at?.open);

  let timer = 0;
  function say(sentence, { stays = false, good = false, more = [] } = {}) {
    fill(said, sentence, ...more);
    said.classList.toggle("good", good);
    said.hidden = !sentence;
    clearTimeout(timer);
    if (!stays) timer = setTimeout(() => (said.hidden = true), 7000);
  }

  bench.on("refused", (sentence) => say(sentence));
  bench.on("told", (event) => {
    const again = button("Read it again", "", () => (say(""), bench.act("reload")));
    say(event.sentence, { stays: event.why !== "saved", good: event.why === "saved", more: event.why === "elsewhere" ? [again] : [] });
  });
  bench.on("connection", ({ open }) => say(open ? "" : "The workbench is not running: start it again, this page will find it.", { stays: !open }));
  bench.on("progress", ({ label, done, total }) => {
    const share = total ? ` ${done} of ${total}` : "…";
    const meter = make("progress", { "aria-label": label, ...(total ? { max: total, value: done } : {}) });
    fill(work, make("span", {}, label + share), meter, button("Cancel", "Esc", () => bench.act("cancel")));
    work.hidden = false;
  });
  bench.on("ended", ({ sentence, made }) => {
    work.hidden = true;
    if (sentence) say(sentence === "stopped" ? "Stopped; what is done is kept." : sentence, { good: made });
  });
  bench.on("state", (changed) => {
    const wasOpen = !start.hidden;
    const held = focused();
    const at = bench.state.folder.at;
    opened.textContent = at.open;
    document.title = at.open ? `${at.open} · tooncap` : "tooncap";
    start.hidden = isOpen();
    tabs.hidden = files.hidden = undo.hidden = redo.hidden = !isOpen();
    undo.disabled = !bench.undo;
    redo.disabled = !bench.redo;
    undo.title = bench.undo ? `Undo: ${bench.undo} (Ctrl+Z)` : "Nothing to undo";
    redo.title = bench.redo ? `Redo: ${bench.redo} (Ctrl+Shift+Z)` : "Nothing to redo";
    work.hidden = work.hidden || !bench.running;
    panel.changed(changed);
    desks.stage.tab.classList.toggle("next", wantsDrawing());
    if (!current || wasOpen !== !isOpen()) choose(firstDesk());
    else if (isOpen()) desks[current].desk.changed?.(changed);
    settle(held);
  });

  const beside = (by) => {
    const names = Object.keys(DESKS);
    choose(names[(names.indexOf(current) + by + names.length) % names.length]);
    if (root.contains(root.getRootNode().activeElement)) desks[current].tab.focus();
  };
  const WITH_COMMAND = [
    key("z", "Undo; with Shift redo", (event) => bench.act(event.shiftKey ? "redo" : "undo"), "Ctrl+Z"),
    key("y", "Redo", () => bench.act("redo"), "Ctrl+Y"),
  ];
  const ALWAYS = [
    key("Escape", "Stop what is running", () => (bench.running ? bench.act("cancel") : said.hidden ? false : say("")), "Esc"),
    key("PageDown", "The next desk", () => isOpen() && beside(1)),
    key("PageUp", "The desk before", () => isOpen() && beside(-1)),
    key("?", "This list", () => help()),
  ];
  const show = makeHelp(root);
  const help = () => show({ ...(isOpen() && { [DESKS[current].title]: desks[current].desk.keys ?? [] }), Everywhere: [...WITH_COMMAND, ...ALWAYS] });

  root.addEventListener("keydown", (event) => {
    if (event.target.matches?.("input:not([type=range], [type=checkbox], [type=radio]), textarea, select")) return;
    const command = event.ctrlKey || event.metaKey;
    let taken;
    if (command && press(WITH_COMMAND, event)) taken = true;
    else if (event.altKey) taken = false;
    else if (event.target.matches?.("[role=tab]") && /^Arrow(Left|Right)$/.test(event.key)) beside(event.key === "ArrowLeft" ? -1 : 1), (taken = true);
    else taken = (isOpen() && desks[current]?.desk.key?.(event)) || (!command && press(ALWAYS, event));
    if (taken) event.preventDefault();
  });
  // In a page of its own keys work wherever the focus is.
  const everywhere = (event) => {
    if (!root.contains(event.target)) root.dispatchEvent(new KeyboardEvent("keydown", event));
  };
  if (el.classList.contains("whole-page")) document.addEventListener("keydown", everywhere);
  window.tooncap = bench; // for the browser's console, and tests
  return () => {
    document.removeEventListener("keydown", everywhere);
    bench.close();
  };
}

export default { render };
