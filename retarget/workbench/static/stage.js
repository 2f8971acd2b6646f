// The stage desk: who plays the captured motion, how they stand, what is behind them; seen live, and exported.
import { button, fill, make, slider } from "./dom.js";
import { makeFrames } from "./frames.js";
import { madeOf } from "./made.js";
import { makePlayers } from "./players.js";
import { makeRedraw } from "./redraw.js";
import { arrived, send } from "./sending.js";
import { makeTimeline } from "./timeline.js";
import { makeView, paintLine } from "./view.js";

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
  const frames = makeFrames(bench, "stage.frame");
  const time = makeTimeline(below, { went: show, keyChosen: ({ frame }) => time.go(frame) });
  const desk = { tool: "look", chosen: new Set(), kind: ".gif", told: null, toldOf: 0, line: null, drag: null, turn: 0, tilt: 0, problem: "" };

  const now = () => bench.state.stage ?? {};
  const act = (name, fields, options) => bench.act(`stage.${name}`, fields, options);
  const players = makePlayers(bench, desk, { changed: () => panel(), load: upload, accepts: DRAWINGS, says: (text) => (hint.textContent = text) });
  const redraw = makeRedraw(bench, view, { changed: () => changed(), act });

  const tools = {};
  for (const [name, [text, key, what]] of Object.entries(TOOLS)) {
    tools[name] = make("button.tool", { type: "button", title: `${what} (${key.toUpperCase()})`, onclick: () => choose(name) }, text);
    rail.append(tools[name]);
  }
  function choose(name) {
    desk.tool = name;
    for (const [other, element] of Object.entries(tools)) element.setAttribute("aria-pressed", String(other === name));
    view.canvas.style.cursor = name === "look" ? "default" : "crosshair";
    explain();
  }

  // Pictures.

  function show() {
    if (!now().number || redraw.open) return;
    if (desk.turn || desk.tilt) return turned();
    const bitmap = frames.want(time.frame);
    if (bitmap) {
      view.picture = bitmap;
      view.frame = time.frame;
      view.number = now().number;
      desk.problem = "";
    }
    view.draw();
    explain();
  }
  frames.came = (number) => number === time.frame && show();

  // A model seen from elsewhere: one picture is asked for at a time, the newest place wins.
  let asking = false;
  let again = false;
  async function turned() {
    again = true;
    if (asking) return;
    asking = true;
    while (again) {
      again = false;
      try {
        const { bitmap } = await bench.picture("stage.turned", { frame: time.frame, turn: desk.turn, tilt: desk.tilt });
        if (desk.turn || desk.tilt) Object.assign(view, { picture: bitmap, frame: time.frame, turn: desk.turn });
        view.draw();
      } catch (error) {
        bench.say(error.message);
      }
    }
    asking = false;
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
    if (redraw.open) return redraw.paint(context);
    if (!now().number) return;
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
    if (redraw.open) return redraw.down(event);
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
      else if (desk.told?.solid) desk.drag = { from: [event.clientX, event.clientY, desk.turn, desk.tilt] };
    }
  });
  view.canvas.addEventListener("pointermove", (event) => {
    if (redraw.open) return redraw.move(event);
    const at = view.toPicture(event);
    if (desk.line && Math.hypot(at[0] - desk.line.at(-1)[0], at[1] - desk.line.at(-1)[1]) > 2) desk.line.push(at);
    else if (desk.drag?.from) {
      const [x, y, turn, tilt] = desk.drag.from;
      desk.turn = turn + (event.clientX - x) / 2;
      desk.tilt = Math.max(-85, Math.min(85, tilt + (event.clientY - y) / 2));
      turned();
    } else if (desk.drag) {
      desk.drag.at = at;
      act("move_pin", { number: desk.drag.n, to: at }, { newest: "pin", gesture: desk.drag.gesture });
    } else return;
    view.draw();
  });
  view.canvas.addEventListener("pointerup", async (event) => {
    if (redraw.open) return redraw.up(event);
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
    if (desk.turn || desk.tilt) [desk.turn, desk.tilt] = [0, 0];
    show();
  });

  // Words.

  function explain() {
    const { motion, cast, number } = now();
    let text = "";
    if (!motion) text = "Nothing was captured yet: do that at the capture desk, or open a *.motion.json.";
    else if (!cast) text = players.hint();
    else if (redraw.open) text = redraw.hint();
    else if (bench.running === "stage.export") text = "Exporting. You may go on.";
    else if (desk.problem) text = desk.problem;
    else if (view.number !== number && !desk.turn) text = "Learning the drawings…";
    else if (desk.turn || desk.tilt) text = "The model from elsewhere; a double click brings it back.";
    else if (desk.tool === "look") text = desk.told?.solid ? "Drag to turn the model round." : desk.told?.said ? `${desk.told.said[0].toUpperCase()}${desk.told.said.slice(1)}.` : "This is what is exported.";
    else text = `${TOOLS[desk.tool][2]}.`;
    hint.textContent = text;
    hint.title = text;
  }

  function panel() {
    const { motion, cast, formats = {} } = now();
    if (!motion) return fill(side, make("h2", {}, "Who plays"), make("p.none", {}, "First a motion must be captured."));
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
    const keys = cast.parts.flatMap((part) => part.keys.map((key) =>
      make("li", {}, make("button.key", { type: "button", "aria-current": String(redraw.is(part.name, key.name)), onclick: () => redraw.show(part, key) }, key.name, make("small", {}, key.outline.length ? `${key.outline.length} points` : key.file)))));
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
      keys.length ? make("h2", {}, "Its keys") : null, keys.length ? make("ol.keys", {}, ...keys) : null, redraw.open && button("Back to the stage", "Esc", redraw.close),
      make("h2", {}, "How it stands"), ...heights, make("label.choice", {}, ground, make("span", {}, "on the source's ground")),
      make("div.row", {}, behind),
      cast.follow.length ? make("div.row", {}, button("Leave the path", "", () => act("follow", { path: [] }))) : null,
      pins.length ? make("h2", {}, "Pins") : null, pins.length ? make("ul.pins", {}, ...pins) : null,
      ...(desk.told?.notes ?? []).slice(0, 3).map((note) => make("p.none", {}, note)),
      make("div.export", {}, make("h2", {}, "Export"), make("div.row", {}, kinds, run), ...madeOf(bench)));
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
      frames.of({ name: `played ${played}`, width: motion.width, height: motion.height, frames: motion.frames, open: bench.state.folder.at.open });
      if (!redraw.open) view.resize(motion.width, motion.height);
    } else view.picture = null;
    if (played !== playedBefore) redraw.refresh(cast);
    playedBefore = played;
    time.go(at);
    panel();
    show();
    learn();
    explain();
  }

  bench.on("progress", () => (panel(), explain()));
  bench.on("ended", () => {
    panel();
    explain();
  });
  choose("look");

  return {
    changed: () => el.hidden || changed(),
    shown: () => (view.fit(), changed()),
    hidden: () => time.playing && time.toggle(),
    dropped(files) {
      const drawn = files.filter(({ name }) => DRAWINGS.split(",").some((ending) => name.toLowerCase().endsWith(ending)));
      if (drawn.length && now().motion) upload(drawn);
      return drawn.length > 0 && Boolean(now().motion);
    },
    key(event) {
      if (event.target.matches?.("button, input") && (event.key === " " || event.key === "Enter")) return false;
      if (event.target.matches?.("input") && /^(Arrow|Home|End|Page)/.test(event.key)) return false; // a slider's own
      if (event.key === "Escape" && redraw.open) return redraw.close(), true;
      if (time.key(event)) return true;
      const tool = Object.entries(TOOLS).find(([, [, key]]) => key === event.key.toLowerCase());
      if (/^[1-9]$/.test(event.key)) {
        const keys = (now().cast?.parts ?? []).flatMap((part) => part.keys.map((key) => [part, key]));
        if (keys[event.key - 1]) redraw.show(...keys[event.key - 1]);
      } else if (event.key === "e") exportIt();
      else if (event.key === "Enter") players.play();
      else if (event.key === "0") view.fit();
      else if (tool) choose(tool[0]);
      else return false;
      return true;
    },
  };
}
