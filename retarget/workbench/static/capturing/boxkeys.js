// A box without a mouse: it begins round what moves, arrows move it, with Shift they change its size.
import { paintLine } from "../shared/view.js";

export function makeBoxKeys(view, { bench, act, time, part, changed }) {
  let box = null; // [x, y, width, height] in the picture's pixels, until it is taken
  const boxed = { get open() { return box !== null; } };

  async function moving() {
    try {
      const { view: data } = await bench.look("capture.moving", { frame: time.frame });
      return JSON.parse(new TextDecoder().decode(data));
    } catch (error) {
      bench.say(error.message);
      return null;
    }
  }

  // Taken as it is: by one click, and what is wrong with it can be drawn anew.
  boxed.atOnce = async () => {
    const found = await moving();
    if (found) await act("box", { frame: time.frame, box: found });
  };

  boxed.begin = async () => {
    view.canvas.focus({ preventScroll: true });
    const one = part();
    if (one?.box && one.keys[0].frame === time.frame) box = [...one.box];
    else {
      const [width, height] = view.size;
      box = (await moving()) ?? [0.3 * width, 0.25 * height, 0.4 * width, 0.5 * height];
    }
    changed();
  };

  boxed.leave = () => {
    box = null;
    changed();
  };

  async function take() {
    const taken = box;
    box = null;
    await act("box", { frame: time.frame, box: taken });
    changed();
  }

  function nudge(axis, by, sizes) {
    const most = view.size[axis];
    if (sizes) box[axis + 2] = Math.min(Math.max(box[axis + 2] + by, 4), most - box[axis]);
    else box[axis] = Math.min(Math.max(box[axis] + by, 0), most - box[axis + 2]);
    changed();
  }

  boxed.key = (event) => {
    if (!box) return false;
    const step = Math.max(1, view.size[0] / 320);
    const ways = { ArrowLeft: [0, -step], ArrowRight: [0, step], ArrowUp: [1, -step], ArrowDown: [1, step] };
    if (ways[event.key]) nudge(...ways[event.key], event.shiftKey);
    else if (event.key === "Enter") take();
    else if (event.key === "Escape") boxed.leave();
    else return false;
    return true;
  };

  boxed.hint = () => `Box ${box.map(Math.round).join(", ")}: arrows move it, Shift with arrows changes its size, Enter takes it, Escape leaves it.`;

  boxed.paint = (context) => {
    if (!box) return;
    const [x, y, width, height] = box;
    paintLine(context, view, [[x, y], [x + width, y], [x + width, y + height], [x, y + height]], { color: "#f0b04a", width: 2.5, dash: [6, 4] });
  };
  return boxed;
}
