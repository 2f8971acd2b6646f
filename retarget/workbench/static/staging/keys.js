// The keys of who plays, each beside the source's, and how they are corrected.
import { make } from "../shared/dom.js";

const MODEL = /\.(glb|gltf|obj|ply|bvh)$/i;
const kept = new Map(); // name -> address of a small picture, the least recently shown first
const KEPT = 200;

export function keysPanel(bench, cast, { redraw, limbs }) {
  const rows = cast.parts.flatMap((part) => part.keys.filter(({ file }) => !MODEL.test(file)).map((key) => row(bench, part, key, redraw, () => (limbs.open && limbs.close(), redraw.show(part, key)))));
  const bodies = cast.bodies.filter(({ drawing }) => !MODEL.test(drawing)).map(({ drawing }) => {
    const shown = { type: "button", "aria-current": String(limbs.is(drawing)), onclick: () => (redraw.open && redraw.close(), limbs.show(drawing)) };
    return make("li", {}, make("button.key", shown, make("span", {}, drawing.split("/").at(-1)), make("small", {}, "joints")));
  });
  const models = cast.parts.some((part) => [part.drawing, ...part.keys.map(({ file }) => file)].some((file) => MODEL.test(file)));
  return [
    (rows.length > 0 || bodies.length > 0) && make("h2", { title: "Each beside the source's; click one to correct it" }, rows.length ? "Its keys, beside the source's" : "Who it is"),
    rows.length > 0 && make("ol.keys.pairs", {}, ...rows),
    bodies.length > 0 && make("ol.keys", {}, ...bodies),
    models && make("p.none", {}, "A model's keys are morph targets or poses in its file: change them there. Without any they are made after the source's."),
  ];
}

// The tools of the editor that is open, for the rail.
export function keyTools({ redraw, limbs, act }) {
  const tool = (text, title, key, run, pressed = false) =>
    make("button.tool", { type: "button", title: key ? `${title} (${key})` : title, "aria-pressed": String(pressed), onclick: run }, text);
  const open = redraw.open ? redraw : limbs;
  return [
    redraw.svg() && tool("Pull", "Pull the drawing into shape", "V", () => redraw.pen(false), !redraw.draws),
    redraw.svg() && tool("Draw", "Draw a stroke anew", "D", () => redraw.pen(true), redraw.draws),
    redraw.bare() && tool("Outline", "Take the picture's outline in hand, to drag its points", "", () => act("outlines", { part: redraw.part() })),
    limbs.open && !limbs.lined() && tool("Lines", "Give every limb a line, from its joint to its end", "", limbs.give),
    tool("Back", "Back to the stage", "Esc", open.close),
  ];
}

function row(bench, part, key, redraw, show) {
  const said = { type: "button", "aria-current": String(redraw.is(part.name, key.name)), onclick: () => show(key) };
  const many = key.outline.length ? `${key.outline.length} points` : key.file;
  const source = small(bench, { part: part.name, key: key.name, of: "source" }, `source's ${bench.state.folder.at.open} ${part.name} ${key.name}`);
  const own = small(bench, { part: part.name, key: key.name }, `${bench.state.folder.at.open} ${part.name} ${key.name} ${key.file}`);
  return make("li", {}, make("button.key.pair", { ...said, title: `${key.name}: ${many}` }, source, own, make("span", {}, key.name)));
}

// A small picture, asked for once.
function small(bench, fields, name) {
  const image = make("img.thumb", { width: 40, height: 40, alt: "" }); // its name stands below it
  const known = kept.get(name);
  if (known) {
    kept.delete(name);
    kept.set(name, known);
    image.src = known;
    return image;
  }
  bench.look("stage.thumb", fields).then(({ event, view }) => {
    const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
    image.src = URL.createObjectURL(new Blob([bytes], { type: event.type }));
    kept.set(name, image.src);
    for (const [oldest, address] of kept) {
      if (kept.size <= KEPT) break;
      kept.delete(oldest);
      URL.revokeObjectURL(address);
    }
  }, () => image.classList.add("missing"));
  return image;
}
