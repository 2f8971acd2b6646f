// Figures of joints and links in space, seen without perspective; dragging beside them turns the view.
import { cleared, makeCanvas, onceAPicture } from "../shared/canvas.js";

const FLOOR = 8; // lines each way, half a metre apart

export function makeSticks(el) {
  const canvas = makeCanvas(el);
  const context = canvas.getContext("2d", { willReadFrequently: true }); // drawn by the processor: thin lines are quicker so
  const sticks = { canvas, turn: 0.35, tilt: 0.12, scale: 200, middle: [0, 0.85, 0], figures: [], painters: [], floor: true };

  // To the screen, with depth as the third number, larger nearer to the viewer.
  sticks.seen = ([x, y, z]) => {
    const [right, up, near] = turned([x - sticks.middle[0], y - sticks.middle[1], z - sticks.middle[2]], sticks.turn, sticks.tilt);
    return [canvas.clientWidth / 2 + right * sticks.scale, canvas.clientHeight / 2 - up * sticks.scale, near];
  };

  // How far in space a way on the screen goes, in the plane that is looked at.
  sticks.way = (right, down) => back([right / sticks.scale, -down / sticks.scale, 0], sticks.turn, sticks.tilt);

  // The whole of some places in view.
  sticks.fit = (places) => {
    if (!places.length || !canvas.clientWidth) return;
    const low = [0, 1, 2].map((axis) => Math.min(...places.map((place) => place[axis])));
    const high = [0, 1, 2].map((axis) => Math.max(...places.map((place) => place[axis])));
    sticks.middle = low.map((least, axis) => (least + high[axis]) / 2);
    const wide = Math.hypot(high[0] - low[0], high[2] - low[2]);
    sticks.scale = Math.min((canvas.clientWidth * 0.85) / Math.max(wide, 0.5), (canvas.clientHeight * 0.78) / Math.max(high[1] - low[1], 0.5));
    sticks.draw();
  };

  sticks.draw = onceAPicture(() => {
    if (!cleared(canvas, context)) return;
    if (sticks.floor) floor();
    for (const figure of sticks.figures) paint(figure);
    sticks.painters.forEach((paintMore) => paintMore(context));
    sticks.drawn?.();
  });

  function floor() {
    const [x, , z] = sticks.middle.map((value) => Math.round(value * 2) / 2);
    context.strokeStyle = "rgba(255, 255, 255, 0.08)";
    context.lineWidth = 1;
    context.beginPath();
    for (let n = -FLOOR; n <= FLOOR; n++) {
      for (const [from, to] of [[[x + n / 2, 0, z - FLOOR / 2], [x + n / 2, 0, z + FLOOR / 2]], [[x - FLOOR / 2, 0, z + n / 2], [x + FLOOR / 2, 0, z + n / 2]]]) {
        context.moveTo(...sticks.seen(from).slice(0, 2));
        context.lineTo(...sticks.seen(to).slice(0, 2));
      }
    }
    context.stroke();
  }

  // A figure: {places, parents, color(joint), seamless}; links from the farthest to the nearest, each with a rim, or all
  // with one round them where many short ones are to look like one soft limb.
  function paint({ places, parents, color, width = 0.05, seamless = false }) {
    const at = places.map(sticks.seen);
    const links = parents.map((parent, joint) => [parent, joint]).filter(([parent]) => parent >= 0);
    links.sort((a, b) => at[a[0]][2] + at[a[1]][2] - at[b[0]][2] - at[b[1]][2]);
    const thick = Math.max(2, width * sticks.scale);
    context.lineCap = "round";
    const stroke = ([parent, joint], style, wide) => {
      context.beginPath();
      context.moveTo(at[parent][0], at[parent][1]);
      context.lineTo(at[joint][0], at[joint][1]);
      context.strokeStyle = style;
      context.lineWidth = wide;
      context.stroke();
    };
    if (seamless) links.forEach((link) => stroke(link, "#1a1b1d", thick + 3));
    for (const link of links) {
      if (!seamless) stroke(link, "#1a1b1d", thick + 3);
      stroke(link, color(link[1]), thick);
    }
  }

  let held = null;
  sticks.orbit = (event) => {
    held = [event.clientX, event.clientY, sticks.turn, sticks.tilt];
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    sticks.turn = held[2] + (event.clientX - held[0]) / 150;
    sticks.tilt = Math.max(-1.4, Math.min(1.4, held[3] + (event.clientY - held[1]) / 200));
    sticks.draw();
  });
  canvas.addEventListener("pointerup", () => (held = null));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    sticks.scale = Math.min(Math.max(sticks.scale * Math.exp(-event.deltaY * 0.0015), 10), 4000);
    sticks.draw();
  }, { passive: false });
  canvas.sticks = sticks; // for tests, which must know where a joint is
  new ResizeObserver(sticks.draw).observe(canvas);
  return sticks;
}

function turned([x, y, z], turn, tilt) {
  const [right, near] = [x * Math.cos(turn) + z * Math.sin(turn), z * Math.cos(turn) - x * Math.sin(turn)];
  return [right, y * Math.cos(tilt) - near * Math.sin(tilt), near * Math.cos(tilt) + y * Math.sin(tilt)];
}

function back([right, up, near], turn, tilt) {
  const [y, z] = [up * Math.cos(tilt) + near * Math.sin(tilt), near * Math.cos(tilt) - up * Math.sin(tilt)];
  return [right * Math.cos(turn) - z * Math.sin(turn), y, z * Math.cos(turn) + right * Math.sin(turn)];
}

// Where joints are in frame t of float32 (T, J, 3).
export function placesAt({ points, shape }, t) {
  const [, count] = shape;
  return Array.from({ length: count }, (_, joint) => {
    const at = 3 * (t * count + joint);
    return [points[at], points[at + 1], points[at + 2]];
  });
}
