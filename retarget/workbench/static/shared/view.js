// A picture that can be zoomed and moved, with things painted over it.
// Pixels are the picture's: (0, 0) is the centre of its top-left pixel.
import { cleared, makeCanvas, onceAPicture } from "./canvas.js";

export function makeView(el) {
  const canvas = makeCanvas(el, { role: "img", "aria-label": "The picture" });
  const context = canvas.getContext("2d");
  // Something `beneath` may be drawn in place of the picture, on the same pixels: then it returns true.
  const view = { canvas, scale: 1, x: 0, y: 0, picture: null, frame: -1, size: [1, 1], painters: [], beneath: null, beside: 0 };
  let fitted = true; // until somebody zooms: then the picture stays where it was put

  view.fit = () => {
    const [width, height] = view.size;
    const room = 8;
    const all = width + view.beside; // pixels to its left are seen too
    view.scale = Math.min((canvas.clientWidth - 2 * room) / all, (canvas.clientHeight - 2 * room) / height);
    view.x = (canvas.clientWidth - view.scale * all) / 2 + view.scale * view.beside;
    view.y = (canvas.clientHeight - view.scale * height) / 2;
    fitted = true;
    view.draw();
  };
  view.resize = (width, height) => {
    if (view.size[0] === width && view.size[1] === height) return;
    view.size = [width, height];
    view.fit();
  };
  view.toPicture = (event) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left - view.x) / view.scale - 0.5, (event.clientY - box.top - view.y) / view.scale - 0.5];
  };
  view.toScreen = ([x, y]) => [view.x + (x + 0.5) * view.scale, view.y + (y + 0.5) * view.scale];

  view.draw = onceAPicture(() => {
    if (!cleared(canvas, context)) return;
    if (!view.beneath?.() && view.picture) {
      context.imageSmoothingEnabled = view.scale < 3;
      context.drawImage(view.picture, view.x, view.y, view.scale * view.size[0], view.scale * view.size[1]);
    }
    view.painters.forEach((paint) => paint(context, view));
    view.drawn?.();
  });

  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const scale = Math.min(Math.max(view.scale * Math.exp(-event.deltaY * 0.0015), 0.05), 40);
    view.x = x - ((x - view.x) * scale) / view.scale;
    view.y = y - ((y - view.y) * scale) / view.scale;
    view.scale = scale;
    fitted = false;
    view.draw();
  }, { passive: false });

  // The middle button, or Alt, moves the picture; everything else is for whoever holds the tool.
  let held = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 1 && !event.altKey) return;
    held = [event.clientX - view.x, event.clientY - view.y];
    canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
    event.stopImmediatePropagation();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    [view.x, view.y] = [event.clientX - held[0], event.clientY - held[1]];
    fitted = false;
    view.draw();
    event.stopImmediatePropagation();
  });
  canvas.addEventListener("pointerup", () => (held = null));
  canvas.view = view; // for tests, which must know where a pixel of the picture is
  new ResizeObserver(() => (fitted ? view.fit() : view.draw())).observe(canvas);
  return view;
}

// A closed or open line over the picture, with a dark rim so that it shows on every ground.
export function paintLine(context, view, points, { color, closed = true, width = 2, dash = [] }) {
  if (!points.length) return;
  context.beginPath();
  points.forEach((point, n) => context[n ? "lineTo" : "moveTo"](...view.toScreen(point)));
  if (closed) context.closePath();
  context.setLineDash(dash);
  context.lineJoin = "round";
  context.strokeStyle = "rgba(0, 0, 0, 0.55)";
  context.lineWidth = width + 2;
  context.stroke();
  context.strokeStyle = color;
  context.lineWidth = width;
  context.stroke();
  context.setLineDash([]);
}

// Dots on points, at least 9 pixels of the screen apart; what lies between can be caught all the same.  Without a colour
// of their own they go round the colours, so that the same colour is the same place in all drawings of a part.
export function paintDots(context, view, points, { color = "", radius = 4, marked = -1 }) {
  let last = null;
  points.forEach((point, n) => {
    const [x, y] = view.toScreen(point);
    if (n !== marked && last && Math.hypot(x - last[0], y - last[1]) < 9) return;
    last = [x, y];
    context.beginPath();
    context.arc(x, y, n === marked ? radius + 3 : radius, 0, 2 * Math.PI);
    context.fillStyle = n === marked ? "#fff" : color || `hsl(${(360 * n) / points.length} 85% 62%)`;
    context.strokeStyle = "rgba(0, 0, 0, 0.7)";
    context.lineWidth = 1.5;
    context.fill();
    context.stroke();
    if (n === marked) {
      context.font = "12px system-ui, sans-serif";
      context.strokeText(n, x + 9, y - 9);
      context.fillText(n, x + 9, y - 9);
    }
  });
}
