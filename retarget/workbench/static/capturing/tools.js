// The tools of the capture desk: box, outline, scribbles, colour, and dragging a key's points, or the pivot.
import { makeBoxKeys } from "./boxkeys.js";
import { make } from "../shared/dom.js";
import { makeHandles } from "../shared/handles.js";
import { key, press } from "../shared/keys.js";
import { dragged } from "../shared/outline.js";
import { paintLine } from "../shared/view.js";

const TOOLS = {
  box: ["Box", "b", "Drag a box round the part"],
  outline: ["Outline", "o", "Draw round the part"],
  inside: ["Is part", "s", "Scribble on the part"],
  outside: ["Is not", "d", "Scribble on what is not the part"],
  color: ["Colour", "c", "Click on the part's colour"],
  points: ["Points", "v", "Drag points of a key; Shift drags one alone"],
  pivot: ["Pivot", "p", "Drag the cross that the part turns about"],
};
const NEAR = 12; // pixels of the screen within which a point is caught

export function makeTools(rail, view, { bench, desk, act, time, keyHere, part, changed }) {
  let tool = "box";
  let touched = false; // whether a person chose the tool
  let line = null; // what is being drawn, in the picture's pixels
  let drag = null;
  const buttons = {};
  for (const [name, [text, key, what]] of Object.entries(TOOLS)) {
    buttons[name] = make("button.tool", { type: "button", title: `${what} (${key.toUpperCase()})`, onclick: () => choose(name, true) }, text);
    rail.append(buttons[name]);
  }

  const boxed = makeBoxKeys(view, { bench, act, time, part, changed: () => (changed(), view.draw()) });

  let grip = {}; // the outline from before the point that is held was moved
  const handles = makeHandles(bench, {
    what: "point",
    count: () => keyHere()?.outline.length ?? 0,
    place: (n) => keyHere().outline[n],
    chosen: (n) => {
      desk.point = n;
      if (n >= 0 && tool !== "points") choose("points", true);
      changed();
      view.draw();
    },
    send: async (index, to, gesture) => {
      const [own, name] = [keyHere(), part().name];
      if (grip.gesture !== gesture) grip = { gesture, from: own.outline };
      const moved = (desk.moved = { part: name, key: own.name, points: dragged(grip.from, index, to, desk.reach) });
      view.draw();
      await act("drag_point", { part: name, key: own.name, index, to, reach: desk.reach }, { newest: "drag", gesture });
      if (desk.moved === moved) desk.moved = null;
      view.draw();
    },
  });

  function choose(name, byHand = false) {
    if (boxed.open) boxed.leave();
    if (name === "pivot" && part()) time.go(part().keys[0].frame); // a pivot is told in the first key's frame
    if (name !== "points") handles.leave();
    tool = name;
    touched = byHand;
    for (const [other, element] of Object.entries(buttons)) element.setAttribute("aria-pressed", String(other === name));
    view.canvas.style.cursor = name === "points" ? "default" : name === "pivot" ? "move" : "crosshair";
    desk.toolChanged?.();
    view.draw();
  }
  choose("box");

  function nearest(event) {
    const key = keyHere();
    if (!key) return -1;
    const box = view.canvas.getBoundingClientRect();
    let [best, found] = [NEAR, -1];
    key.outline.forEach((point, n) => {
      const [x, y] = view.toScreen(point);
      const away = Math.hypot(x - (event.clientX - box.left), y - (event.clientY - box.top));
      if (away < best) [best, found] = [away, n];
    });
    return found;
  }

  // The pivot as it was told, or else the middle of the first key's outline; null where that is not known yet.
  function pivot() {
    const one = part();
    if (desk.pivot?.part === one?.name) return desk.pivot.at;
    const outline = one?.keys[0].outline ?? [];
    if (one?.pivot || !outline.length) return one?.pivot ?? null;
    const sum = outline.reduce(([x, y], point) => [x + point[0], y + point[1]], [0, 0]);
    return sum.map((value) => value / outline.length);
  }
  const isPivotHere = () => tool === "pivot" && part() && time.frame === part().keys[0].frame;
  const sendPivot = (at) => act("pivot", { part: desk.pivot.part, at }, { newest: "drag", gesture: desk.pivot.gesture });

  view.canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !part()) return;
    if (boxed.open) boxed.leave();
    view.canvas.setPointerCapture(event.pointerId);
    const at = view.toPicture(event);
    if (tool === "points") {
      const index = nearest(event);
      const key = keyHere();
      desk.point = index;
      if (index >= 0) drag = { index, key: key.name, part: part().name, from: key.outline, reach: event.shiftKey ? 0 : desk.reach, gesture: bench.gesture() };
    } else if (tool === "pivot") {
      if (isPivotHere()) desk.pivot = { part: part().name, at, gesture: bench.gesture() };
    } else if (tool === "color") act("color", { frame: time.frame, at });
    else line = [at, at];
    view.draw();
  });

  view.canvas.addEventListener("pointermove", (event) => {
    const at = view.toPicture(event);
    if (drag) {
      desk.moved = { part: drag.part, key: drag.key, points: dragged(drag.from, drag.index, at, drag.reach) };
      send(at);
    } else if (desk.pivot) {
      desk.pivot.at = at;
      sendPivot(at);
    } else if (line && tool === "box") line[1] = at;
    else if (line && Math.hypot(at[0] - line.at(-1)[0], at[1] - line.at(-1)[1]) > 1.5) line.push(at);
    else if (tool === "points") {
      const index = nearest(event);
      if (index === desk.point) return;
      desk.point = index;
      view.canvas.style.cursor = index >= 0 ? "grab" : "default";
    } else return;
    view.draw();
  });

  const send = (at) =>
    act("drag_point", { part: drag.part, key: drag.key, index: drag.index, to: at, reach: drag.reach }, { newest: "drag", gesture: drag.gesture });

  view.canvas.addEventListener("pointerup", async (event) => {
    if (drag) {
      const moved = desk.moved;
      const sent = moved ? send(view.toPicture(event)) : null;
      drag = null;
      await sent;
      if (desk.moved === moved) desk.moved = null;
    }
    if (desk.pivot) {
      const dropped = desk.pivot;
      await sendPivot(view.toPicture(event));
      if (desk.pivot === dropped) desk.pivot = null;
    }
    if (line) {
      const [drawn, frame] = [line, time.frame];
      line = null;
      const [[x, y], [right, bottom]] = [drawn[0], drawn.at(-1)];
      if (tool === "box") {
        if (Math.hypot(right - x, bottom - y) > 3) await act("box", { frame, box: [x, y, right - x, bottom - y] });
      } else if (tool === "outline") {
        if (drawn.length > 5) await act("outline", { frame, points: drawn });
      } else await act("scribble", { frame, stroke: drawn, inside: tool === "inside" });
    }
    view.draw();
  });

  const keys = [
    ...Object.entries(TOOLS).map(([name, [, letter, what]]) => key(letter, what, () => choose(name, true))),
    key("x", "A box round what moves; arrows then move it", () => (choose("box", true), boxed.begin())),
  ];

  return {
    choose,
    isPivot: () => tool === "pivot",
    // Who has told the part will want to drag points, unless another tool was taken on purpose.
    changed(told) {
      if (!touched || !told) choose(told ? "points" : tool === "points" ? "box" : tool, touched && !told);
    },
    boxed,
    handles,
    keys,
    key: (event) => boxed.key(event) || press(keys, event),
    paint(context) {
      boxed.paint(context);
      if (isPivotHere() && pivot()) paintCross(context, view.toScreen(pivot()));
      if (!line) return;
      if (tool === "box") {
        const [[x, y], [right, bottom]] = line;
        paintLine(context, view, [[x, y], [right, y], [right, bottom], [x, bottom]], { color: "#fff", dash: [6, 4] });
      } else {
        const color = { inside: "#6fd08c", outside: "#ff6a5e" }[tool] ?? "#fff";
        paintLine(context, view, line, { color, closed: tool === "outline", width: tool === "outline" ? 2 : 4 });
      }
    },
  };
}

function paintCross(context, [x, y]) {
  for (const [color, width] of [["rgba(0, 0, 0, 0.8)", 5], ["#fff", 2]]) {
    context.strokeStyle = color;
    context.lineWidth = width;
    context.beginPath();
    context.arc(x, y, 5, 0, 2 * Math.PI);
    for (const [byX, byY] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + 5 * byX, y + 5 * byY);
      context.lineTo(x + 14 * byX, y + 14 * byY);
    }
    context.stroke();
  }
}
