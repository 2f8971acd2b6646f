// A key's own drawing at the stage desk: points of its outline are dragged, an SVG is pulled into shape or redrawn.
import { makePen } from "./pen.js";
import { dragged } from "../shared/outline.js";
import { paintDots, paintLine } from "../shared/view.js";

const NEAR = 14;

export function makeRedraw(bench, view, { changed, act }) {
  const redraw = { open: false, draws: false }; // an SVG is redrawn by the pen, or pulled
  const pen = makePen(bench, view);
  let which = null; // {part, key, size, svg}
  let drag = null;
  let reach = 60; // pixels of the drawing
  let asking = false;
  let wanted = null;
  let times = 0; // that it was closed: what was asked for before is not shown after

  redraw.is = (part, key) => redraw.open && which.part === part && which.key.name === key;

  redraw.show = async (part, key) => {
    await fetch(part.name, key);
    changed();
  };

  async function fetch(part, key, pull = {}) {
    const before = times;
    try {
      const { bitmap, svg } = await bench.picture("stage.drawing", { part, key: key.name, ...pull });
      if (before !== times) return;
      const first = !redraw.open || which.part !== part || which.key.name !== key.name;
      which = { part, key, svg };
      redraw.open = true;
      view.picture = bitmap;
      view.resize(bitmap.width, bitmap.height);
      if (svg && !pull.at) pen.learn(part, key).catch((error) => bench.say(error.message));
      if (first) reach = Math.max(bitmap.width, bitmap.height) / 8;
      view.draw();
    } catch (error) {
      bench.say(error.message);
    }
  }

  redraw.close = () => {
    redraw.open = false;
    times++;
    which = drag = null;
    pen.forget();
    changed();
  };

  // The cast has changed: what is shown of it must be what it is now.
  redraw.refresh = (cast) => {
    if (!redraw.open) return;
    const key = cast?.parts.find(({ name }) => name === which.part)?.keys.find(({ name }) => name === which.key.name);
    if (!key) return redraw.close();
    if (!drag && key.file !== which.key.file) fetch(which.part, key);
    which.key = key;
    view.draw();
  };

  redraw.svg = () => redraw.open && which.svg;
  redraw.bare = () => redraw.open && !which.svg && !which.key.outline.length; // a picture whose outline nobody has told
  redraw.part = () => which.part;
  redraw.pen = (on) => {
    redraw.draws = on;
    changed();
  };
  redraw.drawing = () => redraw.open && drawing();
  const drawing = () => redraw.draws && which.svg && !which.key.outline.length;

  redraw.hint = () =>
    which.key.outline.length ? "Drag points of the outline; Shift drags one alone."
    : drawing() ? "Draw along a stroke, from where it is to change to where it goes on as it was; or round, for all of it."
    : which.svg ? "Pull the drawing into shape; the wheel with Shift changes how much comes along. The file that came is kept."
    : "This picture's outline comes of itself: take it in hand, then drag its points.";

  const outline = () => drag?.points ?? which.key.outline;

  redraw.paint = (context) => {
    if (outline().length) {
      paintLine(context, view, outline(), { color: "#5b9dff" });
      paintDots(context, view, outline(), { color: "#5b9dff", marked: drag?.index ?? -1 });
    } else if (drawing()) pen.paint(context);
    else if (drag) {
      const [x, y] = view.toScreen(drag.to);
      context.beginPath();
      context.arc(x, y, reach * view.scale, 0, 2 * Math.PI);
      context.strokeStyle = "rgba(240, 176, 74, 0.8)";
      context.lineWidth = 1.5;
      context.stroke();
    }
  };

  redraw.down = (event) => {
    const at = view.toPicture(event);
    if (drawing()) return pen.down(at) && view.canvas.setPointerCapture(event.pointerId);
    const points = which.key.outline;
    if (!points.length) {
      if (which.svg) drag = { at, to: at };
    } else {
      const away = points.map(([x, y]) => Math.hypot(x - at[0], y - at[1]) * view.scale);
      const index = away.indexOf(Math.min(...away));
      if (away[index] < NEAR) drag = { index, from: points, points, reach: event.shiftKey ? 0 : reach / 2, gesture: bench.gesture() };
    }
    if (drag) view.canvas.setPointerCapture(event.pointerId);
    view.draw();
  };

  redraw.move = (event) => {
    if (drawing()) return pen.move(view.toPicture(event));
    if (!drag) return;
    const to = view.toPicture(event);
    if (drag.from) {
      drag.points = dragged(drag.from, drag.index, to, drag.reach);
      send(to);
    } else {
      drag.to = to;
      preview();
    }
    view.draw();
  };

  const send = (to) =>
    act("drag_point", { part: which.part, key: which.key.name, index: drag.index, to, reach: drag.reach }, { newest: "outline", gesture: drag.gesture });

  async function preview() {
    wanted = { at: drag.at, to: drag.to, reach };
    if (asking) return;
    asking = true;
    while (wanted && drag) {
      const pull = wanted;
      wanted = null;
      await fetch(which.part, which.key, pull);
    }
    asking = false;
  }

  redraw.up = async (event) => {
    const drawn = drawing() && pen.up();
    if (drawn) await act("draw", { part: which.part, key: which.key.name, ...drawn });
    if (!drag) return view.draw();
    const held = drag;
    const to = view.toPicture(event);
    if (held.from) {
      const sent = send(to);
      await sent;
      drag = null;
    } else {
      drag = wanted = null;
      if (Math.hypot(to[0] - held.at[0], to[1] - held.at[1]) > 1) await act("pull", { part: which.part, key: which.key.name, at: held.at, to, reach });
      else fetch(which.part, which.key);
    }
    view.draw();
  };

  view.canvas.addEventListener("wheel", (event) => {
    if (!redraw.open || !event.shiftKey) return;
    reach = Math.min(Math.max(reach * Math.exp(-(event.deltaY || event.deltaX) * 0.0015), 4), 4000);
    event.preventDefault();
    event.stopImmediatePropagation();
    view.draw();
  }, { passive: false, capture: true });
  return redraw;
}
