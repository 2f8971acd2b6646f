// A pen at a key's drawing: the stroke that is nearest lights up, and what is drawn along it takes its place.
import { paintLine } from "../shared/view.js";

const CATCH = 40; // pixels of the screen within which a stroke is caught
const STEP = 2; // pixels of the screen between places that are kept

export function makePen(bench, view) {
  const pen = { drawing: null, nearest: -1 };
  let strokes = []; // by element: its lines
  let of = "";

  pen.learn = async (part, key) => {
    const name = `${part} ${key.name} ${key.file}`;
    if (name === of) return;
    of = name;
    strokes = [];
    pen.nearest = -1;
    const { view: data } = await bench.look("stage.strokes", { part, key: key.name });
    if (name !== of) return;
    strokes = JSON.parse(new TextDecoder().decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength)));
    view.draw();
  };
  pen.forget = () => {
    of = "";
    strokes = [];
    pen.drawing = null;
  };

  // The stroke nearest to a place; of those as near the one on top.
  pen.hover = ([x, y]) => {
    let best = CATCH / view.scale;
    let found = -1;
    strokes.forEach((lines, number) => {
      for (const line of lines) {
        for (let n = 1; n < line.length; n++) {
          const away = toSegment([x, y], line[n - 1], line[n]);
          if (away <= best) [best, found] = [away, number];
        }
      }
    });
    pen.nearest = found;
    view.draw();
  };

  pen.down = (at) => {
    pen.hover(at);
    if (pen.nearest >= 0) pen.drawing = [at];
    return Boolean(pen.drawing);
  };
  pen.move = (at) => {
    if (!pen.drawing) return pen.hover(at);
    const [x, y] = pen.drawing.at(-1);
    if (Math.hypot(at[0] - x, at[1] - y) * view.scale > STEP) pen.drawing.push(at);
    view.draw();
  };
  pen.up = () => {
    const line = pen.drawing;
    pen.drawing = null;
    return line && line.length > 2 ? { stroke: pen.nearest, line } : null;
  };
  pen.paint = (context) => {
    for (const line of strokes[pen.nearest] ?? []) paintLine(context, view, line, { color: "#5b9dff", closed: false, dash: [6, 5] });
    if (pen.drawing) paintLine(context, view, pen.drawing, { color: "#f0b04a", closed: false });
  };
  return pen;
}

function toSegment([x, y], [x0, y0], [x1, y1]) {
  const [dx, dy] = [x1 - x0, y1 - y0];
  const share = Math.max(0, Math.min(1, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - x0 - share * dx, y - y0 - share * dy);
}
