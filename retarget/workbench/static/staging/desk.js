// The stage desk: who plays the captured motion, how they stand, what is behind them; seen live, and exported.
import { button, fill, make, place, slider } from "../shared/dom.js";
import { key, ownKey, press } from "../shared/keys.js";
import { makeLimbs } from "./limbs.js";
import { madeOf } from "../shared/made.js";
import { makePlayers } from "./players.js";
import { makeRedraw } from "./redraw.js";
import { SOURCES, makeScene } from "./scene.js";
import { arrived, send } from "../shared/sending.js";
import { keyTools, keysPanel } from "./keys.js";
import { makeTimeline } from "../shared/timeline.js";
import { makeView, paintLine } from "../shared/view.js";

export const title = "Stage";

const TOOLS = {
  look: ["Look", "v", "Drag a pin elsewhere, or turn a model round"],
  pin: ["Pin", "p", "Click on the place of the character that is to stay where it is"],
  path: ["Path", "o", "Draw the path that the whole goes along"],
};
const DRAWINGS = ".svg,.png,.jpg,.jpeg,.webp,.glb,.gltf,.bin,.mtl,.obj,.ply";

export function mount(el, bench) {
  const side = make("aside.side");
  const hint = make("p.hint", { role: "status" });
  const picture = make("div.picture");
  const below = make("footer.below");
  const rail = make("div.rail", { role: "toolbar", "aria-label": "Tools" });
  const stage = make("div.stage", {}, hint, picture);
  el.append(rail, stage, side, below);
  const view = makeView(picture);
  place(view.canvas, "The stage");
  const time = makeTimeline(below, { went: show, keyChosen: ({ frame }) => time.go(frame) });
  const desk = { tool: "look", chosen: new Set(), kind: ".gif", told: null, toldOf: 0, line: null, drag: null, problem: "", proposed: -1 };

  const now = () => bench.state.stage ?? {};
  const act = (name, fields, options) => bench.act(`stage.${name}`, fields, options);
  const players = makePlayers(bench, desk, { changed: () => (panel(), explain()), load: upload, accepts: DRAWINGS, says: (text) => (hint.textContent = text) });
  const scene = makeScene(picture, view, bench, { came: () => show(), source: () => bench.state.capture?.clip, away: () => editor() !== null });
  const redraw = makeRedraw(bench, view, { changed: () => changed(), act });
  const limbs = makeLimbs(bench, view, { changed: () => changed(), act });
  const editor = () => (redraw.open ? redraw : limbs.open ? limbs : null); // of a key or body, in place of the stage

  const tools = {};
  for (const [name, [text, key, what]] of Object.entries(TOOLS)) {
    tools[name] = make("button.tool", { type: "button", title: `${what} (${key.toUpperCase()})`, onclick: () => choose(name) }, text);
  }
  const over = button("", "", () => (scene.next(), compare()));
  over.classList.add("over");
  below.firstElementChild.append(over);
  function compare() {
    over.textContent = SOURCES[scene.shows];
    over.disabled = !bench.state.capture?.clip;
    over.title = over.disabled ? "The clip that this was captured from is not here" : "The source's frame over the result, or beside it (G)";
  }
  compare();
  function choose(name) {
    desk.tool = name;
    for (const [other, element] of Object.entries(tools)) element.setAttribute("aria-pressed", String(other === name));
    cursor();
    explain();
  }

  const cursor = () => (view.canvas.style.cursor = (editor() ? redraw.drawing() : desk.tool !== "look") ? "crosshair" : "default");

  function show() {
    if (!now().number || editor()) return;
    if (scene.show(time.frame)) desk.problem = "";
    explain();
  }

  async function learn() {
    const number = now().number;
    if (!number || number === desk.toldOf) return;
    desk.toldOf = number;
    try {
      const { view: data } = await bench.look("stage.told");
      const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
      desk.told = JSON.parse(new TextDecoder().decode(bytes));
      desk.problem = "";
    } catch (error) {
      if (number === now().number) desk.problem = error.message;
    }
    panel();
    explain();
    view.draw();
  }

  const pinsHere = () => (now().cast?.keep ?? []).map((keep, n) => ({ ...keep, n, place: desk.drag?.n === n ? desk.drag.at : desk.told?.pins[n] ?? keep.at }));

  view.painters.push((context) => {
    if (editor()) return editor().paint(context);
    if (!now().number) return;
    scene.paint(context);
    const path = now().cast.follow;
    if (path.length) paintLine(context, view, path, { color: "#35c9bb", closed: false, dash: [8, 6] });
    if (desk.line) paintLine(context, view, desk.line, { color: "#35c9bb", closed: false });
    for (const { frames: span, place } of pinsHere()) {
      if (!place || !span) continue;
      const holds = time.frame >= span[0] && time.frame <= span[1];
      paintPin(context, view.toScreen(place), holds);
    }
  });

  function paintPin(context, [x, y], holds) {
    context.beginPath();
    context.arc(x, y, 6, 0, 2 * Math.PI);
    context.moveTo(x - 10, y);
    context.lineTo(x + 10, y);
    context.moveTo(x, y - 10);
    context.lineTo(x, y + 10);
    context.strokeStyle = "rgba(0, 0, 0, 0.6)";
    context.lineWidth = 4;
    context.stroke();
    context.strokeStyle = holds ? "#f0b04a" : "#c9ccd2";
    context.lineWidth = 2;
    context.stroke();
  }

  // The pointer.

  view.canvas.addEventListener("pointerdown", async (event) => {
    if (event.button !== 0 || !now().number) return;
    if (editor()) return editor().down(event);
    view.canvas.setPointerCapture(event.pointerId);
    const at = view.toPicture(event);
    if (desk.tool === "pin") {
      const last = Math.min(time.frame + Math.round(now().motion.fps / 2), time.last);
      await act("pin", { frame: time.frame, at, last });
      choose("look");
    } else if (desk.tool === "path") desk.line = [at];
    else {
      const box = view.canvas.getBoundingClientRect();
      const pin = pinsHere().find(({ place, frames: span }) => {
        if (!place || !span) return false;
        const [x, y] = view.toScreen(place);
        return Math.hypot(x - event.clientX + box.left, y - event.clientY + box.top) < 12;
      });
      if (pin) desk.drag = { n: pin.n, at, gesture: bench.gesture() };
      else if (desk.told?.solid) desk.drag = { turn: scene.grab(event) };
    }
  });
  view.canvas.addEventListener("pointermove", (event) => {
    if (editor()) return editor().move(event);
    const at = view.toPicture(event);
    if (desk.line && Math.hypot(at[0] - desk.line.at(-1)[0], at[1] - desk.line.at(-1)[1]) > 2) desk.line.push(at);
    else if (desk.drag?.turn) {
      desk.drag.turn(event);
      show();
    } else if (desk.drag) {
      desk.drag.at = at;
      act("move_pin", { number: desk.drag.n, to: at }, { newest: "pin", gesture: desk.drag.gesture });
    } else return;
    view.draw();
  });
  view.canvas.addEventListener("pointerup", async (event) => {
    if (editor()) return editor().up(event);
    const [line, drag] = [desk.line, desk.drag];
    desk.line = null;
    desk.drag = null;
    if (line) {
      await act("follow", { path: line.length > 5 ? line : [] });
      choose("look");
    }
    if (drag?.gesture) panel();
    view.draw();
  });
  view.canvas.addEventListener("dblclick", () => {
    scene.home();
    show();
  });

  // Words.

  function explain() {
    const { motion, cast, number } = now();
    let text = "";
    if (!motion) text = "Nothing was captured yet: do that at the capture desk, or open a *.motion.json.";
    else if (desk.learning) text = "Learning the drawings…";
    else if (!cast) text = players.hint();
    else if (editor()) text = editor().hint();
    else if (desk.proposed === number) text = "Proposed: compare each key with the source's at the right; click one to correct it. Undo takes them back.";
    else if (bench.running === "stage.export") text = "Exporting. You may go on.";
    else if (desk.problem) text = desk.problem;
    else if (view.number !== number && !scene.turned()) text = "Learning the drawings…";
    else if (scene.turned()) text = scene.hint();
    else if (desk.tool === "look") text = desk.told?.solid ? "Drag to turn the model round." : desk.told?.said ? `${desk.told.said[0].toUpperCase()}${desk.told.said.slice(1)}.` : "This is what is exported.";
    else text = `${TOOLS[desk.tool][2]}.`;
    hint.textContent = text;
    hint.title = text;
  }

  function panel() {
    cursor();
    fill(rail, ...(editor() ? keyTools({ redraw, limbs, act }) : Object.values(tools)));
    const { motion, cast, formats = {} } = now();
    if (!motion) return fill(side, make("h2", {}, "Who plays"), make("p.none", {}, "First a motion must be captured."),
      make("div.row", {}, bench.state.capture?.clip && button("To the capture desk", "", () => bench.show("capture"), "primary")),
      make("div.row", {}, button("Open something else", "", () => bench.act("folder.close"), bench.state.capture?.clip ? "" : "primary")));
    const busy = Boolean(bench.running);
    const who = players.panel();
    side.classList.toggle("chosen", Boolean(cast));
    if (!cast) return fill(side, ...who);
    const standing = [...cast.parts.map(({ name, height }) => [name, height]), ...cast.bodies.map(({ drawing, height }) => [drawing, height])];
    const gestures = {};
    const heights = standing.map(([name, height]) =>
      slider(standing.length > 1 ? name : "Height", { min: 0.2, max: 3, step: 0.05, value: height }, (value, done) => {
        gestures[name] ??= bench.gesture();
        act("stand", { who: name, height: value }, { newest: "height", gesture: gestures[name] });
        if (done) delete gestures[name];
      }));
    const behind = make("input", { type: "text", value: cast.background, placeholder: "none, a colour, or a file", "aria-label": "Background" });
    behind.onchange = () => act("background", { what: behind.value.trim() });
    const ground = make("input", { type: "checkbox", checked: cast.ground });
    ground.onchange = () => act("ground", { on: ground.checked });
    const pins = cast.keep.map(({ part, frames: span }, n) =>
      make("li", {}, span ? make("span.pin", {}, part, number(span[0], "first frame", (first) => act("move_pin", { number: n, first })), "–", number(span[1], "last frame", (last) => act("move_pin", { number: n, last }))) : make("span.pin", {}, part, make("small", {}, "on the ground")),
        make("button.gone", { type: "button", "aria-label": `Take pin ${n + 1} out`, title: "Take it out", onclick: () => act("unpin", { number: n }) }, "×")));
    const kinds = make("select", { "aria-label": "Export as", onchange: () => (desk.kind = kinds.value) },
      ...Object.entries(formats).map(([kind, text]) => make("option", { value: kind, selected: kind === desk.kind }, text)));
    const isDone = now().made?.some(({ of }) => of === now().number);
    const run = button("Export", "E", exportIt, isDone ? "" : "primary");
    run.disabled = busy;
    fill(side, ...who,
      ...keysPanel(bench, cast, { redraw, limbs }),
      make("h2", {}, "How it stands"), ...heights, make("label.choice", {}, ground, make("span", {}, "on the source's ground")),
      make("div.row", {}, behind),
      cast.follow.length ? make("div.row", {}, button("Leave the path", "", () => act("follow", { path: [] }))) : null,
      pins.length ? make("h2", {}, "Pins") : null, pins.length ? make("ul.pins", {}, ...pins) : null,
      ...(desk.told?.notes ?? []).slice(0, 3).map((note) => make("p.none", {}, note)),
      make("div.export", {}, make("h2", {}, "Export"), make("div.row", {}, kinds, run), ...madeOf(bench, "stage")));
  }

  function number(value, label, changedTo) {
    const input = make("input", { type: "number", min: 0, max: time.last, value, "aria-label": label });
    input.onchange = () => changedTo(Math.max(0, Math.round(Number(input.value) || 0)));
    return input;
  }

  // What can be done.

  const exportIt = () => now().cast && !bench.running && bench.work("stage.export", { kind: desk.kind });

  async function upload(files) {
    for (const file of files) {
      if (!(await send(bench, "stage.load", file))) return;
      const { file: name } = await arrived(bench, file.name);
      desk.chosen.add(name);
    }
    changed();
  }

  let playedBefore = 0;
  function changed() {
    const { motion, cast, number: played } = now();
    if (!motion) {
      view.picture = null;
      panel();
      return explain();
    }
    const at = time.frame;
    Object.assign(time, { first: 0, last: motion.frames - 1, fps: motion.fps });
    time.keys = (cast?.keep ?? []).filter((keep) => keep.frames).map((keep) => ({ frame: keep.frames[0], color: "#f0b04a", chosen: false }));
    if (played) {
      scene.of(motion, played, bench.state.folder.at.open);
      if (!editor()) view.resize(motion.width, motion.height);
    } else view.picture = null;
    scene.fit();
    compare();
    if (played !== playedBefore) [redraw, limbs].forEach((one) => one.refresh(cast));
    playedBefore = played;
    time.go(at);
    panel();
    show();
    learn();
    explain();
  }

  bench.on("progress", () => (panel(), explain()));
  bench.on("ended", ({ work, made }) => {
    if (work === "stage.propose" && made) desk.proposed = now().number;
    panel();
    explain();
  });
  choose("look");

  const drawn = (number) => (now().cast?.parts ?? []).flatMap((part) => part.keys.map((one) => [part, one]))[number - 1];
  const keys = [
    ...time.keys,
    key("1-9", "A key drawing, to correct it", (event) => (drawn(event.key) ? redraw.show(...drawn(event.key)) : false)),
    key("Escape", "Back to the stage", () => (editor() ? editor().close() : false)),
    key("d", "Draw a line of a key anew, while it is open", () => (redraw.svg() ? redraw.pen(true) : false)),
    key("v", "Pull a key's lines, while it is open", () => (redraw.svg() ? redraw.pen(false) : false)),
    key("g", "The source over the result, or beside it", () => (scene.next(), compare())),
    key("Enter", "Let the chosen drawings play", () => players.play()),
    key("e", "Export", exportIt),
    ...Object.entries(TOOLS).map(([name, [, letter, what]]) => key(letter, what, () => choose(name))),
    key("0", "All of the picture", view.fit),
  ];

  return {
    changed: () => el.hidden || changed(),
    shown: () => (view.fit(), changed()),
    hidden: () => time.playing && time.toggle(),
    keys,
    key: (event) => !ownKey(event) && press(keys, event),
    dropped(files) {
      const drawn = files.filter(({ name }) => DRAWINGS.split(",").some((ending) => name.toLowerCase().endsWith(ending)));
      if (drawn.length && now().motion) upload(drawn);
      return drawn.length > 0 && Boolean(now().motion);
    },
  };
}
