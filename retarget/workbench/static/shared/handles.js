// Points and joints without a mouse: N takes one after the other, arrows move the one that is held.
import { key } from "./keys.js";

// count() of them; place(n) where one is; send(n, to, gesture) moves it; chosen(n) shows which is held, -1 for none; way(right,
// down) is how far a way on the screen goes where they live.
export function makeHandles(bench, { count, place, send, chosen, way = (right, down) => [right, down], what }) {
  let held = null; // {n, to, gesture}
  const handles = { get open() { return held !== null; } };

  handles.leave = () => {
    if (!held) return false;
    held = null;
    chosen(-1);
    return true;
  };

  function next(event) {
    if (!count()) return false;
    const n = held ? held.n + (event.shiftKey ? -1 : 1) : 0;
    held = { n: (n + count()) % count(), to: null, gesture: bench.gesture() };
    chosen(held.n);
    return true;
  }

  function move(event) {
    if (!held || held.n >= count()) return false;
    const [right, down] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const by = way(right * (event.shiftKey ? 8 : 1), down * (event.shiftKey ? 8 : 1));
    held.to = (held.to ?? place(held.n)).map((value, axis) => value + by[axis]);
    send(held.n, held.to, held.gesture);
    return true;
  }

  handles.number = () => held?.n ?? -1;
  handles.hint = () => `Arrows move it, with Shift further; N goes to the next ${what}, Shift+N to the one before, Escape leaves it.`;
  handles.keys = [
    key("n", `The next ${what}; with Shift the one before`, next),
    key("Arrows", `Move the ${what} that is held; with Shift further`, move),
    key("Escape", `Leave the ${what}`, handles.leave),
  ];
  return handles;
}
