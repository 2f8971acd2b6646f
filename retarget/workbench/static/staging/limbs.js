// A body's own drawing at the stage desk: where its parts turn, and where they end, is dragged.
import { PART_COLORS } from "../shared/dom.js";
import { paintLine } from "../shared/view.js";

const NEAR = 14;

export function makeLimbs(bench, view, { changed, act }) {
  const limbs = { open: false };
  let who = "";
  let seen = []; // {part, joint, end, told}
  let drag = null; // {limb, end, to}
  let times = 0; // that it was closed: what was asked for before is not shown after

  limbs.is = (name) => limbs.open && who === name;
  limbs.lined = () => seen.some(({ end }) => end);

  limbs.show = async (name) => {
    who = name;
    await fetch();
    changed();
  };

  async function fetch() {
    const before = times;
    try {
      const { bitmap, limbs: told } = await bench.picture("stage.body", { who });
      if (before !== times) return;
      seen = told;
      limbs.open = true;
      view.picture = bitmap;
      view.resize(bitmap.width, bitmap.height);
      view.draw();
    } catch (error) {
      bench.say(error.message);
    }
  }

  limbs.close = () => {
    limbs.open = false;
    times++;
    drag = null;
    changed();
  };
  limbs.refresh = (cast) => {
    if (!limbs.open) return;
    if (!cast?.bodies.some(({ drawing }) => drawing === who)) return limbs.close();
    fetch().then(changed);
  };
  limbs.hint = () => (limbs.lined() ? "Drag a joint, or a limb's end: what lies along its line is its own." : "Drag a joint: there the part turns. What was not dragged is where the source's is.");
  limbs.give = () => act("lines", { who });

  limbs.paint = (context) => {
    seen.forEach((limb, n) => {
      const at = (end) => (drag?.limb === limb && drag.end === end ? drag.to : end ? limb.end : limb.joint);
      const color = PART_COLORS[n % PART_COLORS.length];
      if (limb.end) {
        paintLine(context, view, [at(false), at(true)], { color, closed: false, width: 3 });
        dot(context, at(true), color, 4, true);
      }
      dot(context, at(false), color, 7, limb.told);
      const [x, y] = view.toScreen(at(false));
      context.font = "12px system-ui, sans-serif";
      context.lineWidth = 3;
      context.strokeStyle = "rgba(0, 0, 0, 0.75)";
      context.fillStyle = "#fff";
      context.strokeText(limb.part, x + 11, y + 4);
      context.fillText(limb.part, x + 11, y + 4);
    });
  };

  // Full where a person put it, a ring where it is the source's.
  function dot(context, place, color, radius, told) {
    context.beginPath();
    context.arc(...view.toScreen(place), radius, 0, 2 * Math.PI);
    context.fillStyle = told ? color : "rgba(30, 31, 33, 0.85)";
    context.strokeStyle = told ? "rgba(0, 0, 0, 0.7)" : color;
    context.lineWidth = told ? 1.5 : 2.5;
    context.fill();
    context.stroke();
  }

  limbs.down = (event) => {
    const [x, y] = view.toPicture(event);
    let best = NEAR / view.scale;
    for (const limb of seen) {
      for (const end of limb.end ? [false, true] : [false]) {
        const place = end ? limb.end : limb.joint;
        const away = Math.hypot(place[0] - x, place[1] - y);
        if (away < best) [best, drag] = [away, { limb, end, to: place }];
      }
    }
    if (drag) view.canvas.setPointerCapture(event.pointerId);
    view.draw();
  };
  limbs.move = (event) => {
    if (!drag) return;
    drag.to = view.toPicture(event);
    view.draw();
  };
  limbs.up = async (event) => {
    if (!drag) return;
    const { limb, end } = drag;
    const to = view.toPicture(event);
    await act("joint", { who, part: limb.part, to, end });
    drag = null;
    view.draw();
  };
  return limbs;
}
