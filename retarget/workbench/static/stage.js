// The stage desk: who plays the captured motion, how they stand, what is behind them; seen live, and exported.
import { button, fill, make, slider } from "./dom.js";
import { makeLimbs } from "./limbs.js";
import { makeRedraw } from "./redraw.js";
import { SOURCES, makeScene } from "./scene.js";
import { keyTools, keysPanel } from "./stage_keys.js";
import { makeTimeline } from "./timeline.js";
import { makeView, paintLine } from "./view.js";

export const title = "Stage";

const TOOLS = {
  look: ["Look", "v", "Drag a pin elsewhere, or turn a model round"],
  pin: ["Pin", "p", "Click on the place of the character that is to stay where it is"],
  path: ["Path", "o", "Draw the path that the whole goes along"],
};
const PIECE = 300 * 1024; // bytes of a file in one message

export function mount(el, bench) {
  const side = make("aside.side");
  const hint = make("p.hint", { role: "status" });
  const picture = make("div.picture");
  const below = make("footer.below");
  const rail = make("div.rail", { role: "toolbar", "aria-label": "Tools" });
  const stage = make("div.stage", {}, hint, picture);
  el.append(rail, stage, side, below);
  const view = makeView(picture);
  const time = makeTimeline(below, { went: show, keyChosen: ({ frame }) => time.go(frame) });
  const desk = { tool: "look", chosen: new Set(), kind: ".mp4", told: null, toldOf: 0, line: null, drag: null, problem: "", result: "", proposed: -1 };

  const now = () => bench.state.stage ?? {};
  const act = (name, fields, options) => bench.act(`stage.${name}`, fields, options);
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
    else if (!cast) text = "Who plays it? Choose a drawing, a picture or a model at the right.";
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
    const { motion, cast, drawings = [], formats = {} } = now();
    if (!motion) return fill(side, make("h2", {}, "Who plays"), make("p.none", {}, "First a motion must be captured."));
    const asked = make("input", { type: "file", multiple: true, hidden: true, accept: ".svg,.png,.jpg,.jpeg,.webp,.glb,.gltf,.bin,.obj,.ply" });
    asked.onchange = () => upload([...asked.files]);
    const busy = Boolean(bench.running);
    desk.chosen = new Set([...desk.chosen].filter((name) => drawings.includes(name)));
    const shown = grouped(drawings, motion.parts);
    const list = shown.map(({ name, files }) => {
      const box = make("input", { type: "checkbox", checked: files.every((file) => desk.chosen.has(file)) });
      box.onchange = () => {
        for (const file of files) desk.chosen[box.checked ? "add" : "delete"](file);
        panel();
      };
      return make("li", {}, make("label.choice", {}, box, make("span", {}, name), files.length > 1 && make("small", {}, `${files.length} keys`)));
    });
    const play = button("Let it play", "Enter", playChosen, desk.chosen.size && !cast ? "primary" : "");
    const propose = button("Propose keys", "", () => bench.work("stage.propose", { files: [...desk.chosen] }));
    play.disabled = !desk.chosen.size;
    propose.disabled = busy || !desk.chosen.size || [...desk.chosen].some((file) => !/\.(svg|png|jpe?g|webp)$/i.test(file));
    propose.title = "Make all key drawings from the one that is chosen, for you to correct";
    const who = [
      make("h2", {}, "Who plays"),
      list.length ? make("ul.choices", {}, ...list) : make("p.none", {}, "No drawing lies in this folder yet."),
      make("div.row", {}, button("Load…", "", () => asked.click()), play, propose, asked),
    ];
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
    const run = button("Export", "E", exportIt, "primary");
    run.disabled = busy;
    fill(side, ...who,
      ...keysPanel(bench, cast, { redraw, limbs }),
      make("h2", {}, "How it stands"), ...heights, make("label.choice", {}, ground, make("span", {}, "on the source's ground")),
      make("div.row", {}, behind),
      cast.follow.length ? make("div.row", {}, button("Leave the path", "", () => act("follow", { path: [] }))) : null,
      pins.length ? make("h2", {}, "Pins") : null, pins.length ? make("ul.pins", {}, ...pins) : null,
      make("h2", {}, "Export"), make("div.row", {}, kinds, run), desk.result && make("p.result", {}, desk.result),
      ...(desk.told?.notes ?? []).slice(0, 3).map((note) => make("p.none", {}, note)));
  }

  function number(value, label, changedTo) {
    const input = make("input", { type: "number", min: 0, max: time.last, value, "aria-label": label });
    input.onchange = () => changedTo(Math.max(0, Math.round(Number(input.value) || 0)));
    return input;
  }

  // What can be done.

  function playChosen() {
    if (!desk.chosen.size) return;
    hint.textContent = "Learning the drawings…";
    act("play", { files: [...desk.chosen] });
  }

  const exportIt = () => now().cast && !bench.running && bench.work("stage.export", { kind: desk.kind });

  async function upload(files) {
    for (const file of files) {
      const bytes = new Uint8Array(await file.arrayBuffer());
      let at = 0;
      do {
        const piece = bytes.subarray(at, at + PIECE);
        const last = at + piece.length >= bytes.length;
        const done = await act("load", { name: file.name, at, data: base64(piece), last });
        if (!done) return;
        at += piece.length;
      } while (at < bytes.length);
      desk.chosen.add(file.name);
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
  bench.on("ended", ({ work, sentence, made }) => {
    if (work === "stage.propose" && made) desk.proposed = now().number;
    if (work === "stage.export") desk.result = made ? sentence : "";
    panel();
    explain();
  });
  choose("look");

  return {
    changed: () => el.hidden || changed(),
    shown: () => (view.fit(), changed()),
    hidden: () => time.playing && time.toggle(),
    key(event) {
      if (event.target.matches?.("button, input") && (event.key === " " || event.key === "Enter")) return false;
      if (event.target.matches?.("input") && /^(Arrow|Home|End|Page)/.test(event.key)) return false; // a slider's own
      if (event.key === "Escape" && editor()) return editor().close(), true;
      if (redraw.svg() && /^[dv]$/.test(event.key)) return redraw.pen(event.key === "d"), true;
      if (time.key(event)) return true;
      const tool = Object.entries(TOOLS).find(([, [, key]]) => key === event.key.toLowerCase());
      if (/^[1-9]$/.test(event.key)) {
        const keys = (now().cast?.parts ?? []).flatMap((part) => part.keys.map((key) => [part, key]));
        if (keys[event.key - 1]) redraw.show(...keys[event.key - 1]);
      } else if (event.key === "e") exportIt();
      else if (event.key === "Enter") playChosen();
      else if (event.key === "g") scene.next(), compare();
      else if (event.key === "0") view.fit();
      else if (tool) choose(tool[0]);
      else return false;
      return true;
    },
  };
}

// Files whose names differ only in a key's name at the end are one character's drawings.
function grouped(drawings, parts) {
  const keys = parts.flatMap((part) => part.keys.map((key) => key.toLowerCase()));
  const found = new Map();
  for (const file of drawings) {
    const stem = file.replace(/\.[^.]+$/, "");
    const key = keys.find((name) => stem.toLowerCase().endsWith(`_${name}`));
    const name = key ? stem.slice(0, -key.length - 1) : file;
    found.set(name, [...(found.get(name) ?? []), file]);
  }
  return [...found].map(([name, files]) => ({ name: files.length > 1 ? name : files[0], files }));
}

function base64(bytes) {
  let text = "";
  for (let n = 0; n < bytes.length; n += 8192) text += String.fromCharCode(...bytes.subarray(n, n + 8192));
  return btoa(text);
}
