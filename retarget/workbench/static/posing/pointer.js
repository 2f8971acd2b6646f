// The pointer over a figure: joints are caught, dragged and pinned; beside them the view is turned, or the paper moved.
const NEAR = 22; // pixels of the screen within which a joint is caught

export function makePointer(sticks, bench, desk, { act, now, show, unready }) {
  const canvas = sticks.canvas;
  const pointer = {};

  pointer.pose = () => {
    const { pose: places = [] } = now();
    if (!desk.drag) return places;
    const moved = [...places];
    moved[desk.drag.joint] = desk.drag.to; // the hand sees at once what it does; the rest comes when it is known
    return moved;
  };
  pointer.pin = (joint) => joint >= 0 && act("pin", { joint, on: !now().pinned.includes(joint) });

  // What hangs on nothing, and on which nothing hangs, is no joint: a light, or a camera.
  const isJoint = (joint) => {
    const { parents } = now().figure;
    return parents[joint] >= 0 || parents.includes(joint);
  };

  pointer.paint = (context) => {
    const { figure, pinned = [] } = now();
    if (!figure || desk.mode !== "pose") return;
    pointer.pose().forEach((place, joint) => {
      if (!isJoint(joint)) return;
      const [x, y] = sticks.seen(place);
      const pin = pinned.includes(joint);
      context.beginPath();
      if (pin) context.rect(x - 6, y - 6, 12, 12);
      else context.arc(x, y, joint === desk.hover ? 7 : figure.drawn ? 4.5 : 3.5, 0, 2 * Math.PI);
      context.fillStyle = pin ? "#ff6a5e" : joint === desk.hover ? "#fff" : "rgba(20, 20, 22, 0.75)";
      context.strokeStyle = joint === desk.hover && figure.drawn ? "#1a1b1d" : "rgba(255, 255, 255, 0.85)";
      context.lineWidth = 1.5;
      context.fill();
      context.stroke();
    });
    if (desk.hover < 0) return;
    const [x, y] = sticks.seen(pointer.pose()[desk.hover]);
    Object.assign(context, { font: "12px system-ui, sans-serif", textAlign: "left", fillStyle: "#fff", strokeStyle: "rgba(20, 20, 22, 0.85)", lineWidth: 3, lineJoin: "round" });
    context.strokeText(figure.names[desk.hover], x + 12, y - 8);
    context.fillText(figure.names[desk.hover], x + 12, y - 8);
  };

  function nearest(event) {
    const box = canvas.getBoundingClientRect();
    let [best, found] = [NEAR, -1];
    (now().pose ?? []).forEach((place, joint) => {
      if (!isJoint(joint)) return;
      const [x, y] = sticks.seen(place);
      const away = Math.hypot(x - event.clientX + box.left, y - event.clientY + box.top);
      if (away < best) [best, found] = [away, joint];
    });
    return found;
  }

  let paper = null; // where a hand took it
  canvas.addEventListener("pointerdown", (event) => {
    const { figure } = now();
    if (!figure) return;
    const joint = desk.mode === "pose" && event.button === 0 ? nearest(event) : -1;
    if (joint >= 0 && event.shiftKey) return pointer.pin(joint);
    if (joint >= 0 && !desk.ready) unready();
    if (joint < 0 || !desk.ready) {
      if (!figure.drawn || desk.mode === "rubber") return sticks.orbit(event);
      paper = [event.clientX, event.clientY, ...sticks.middle];
      return canvas.setPointerCapture(event.pointerId);
    }
    canvas.setPointerCapture(event.pointerId);
    const from = now().pose[joint];
    desk.drag = { joint, from, to: from, x: event.clientX, y: event.clientY, gesture: bench.gesture(), moved: false };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (paper) {
      sticks.middle = [paper[2] - (event.clientX - paper[0]) / sticks.scale, paper[3] + (event.clientY - paper[1]) / sticks.scale, paper[4]];
      return sticks.draw();
    }
    if (!desk.drag) {
      const hover = desk.mode === "pose" && event.buttons === 0 ? nearest(event) : desk.hover;
      if (hover === desk.hover) return;
      desk.hover = hover;
      canvas.style.cursor = hover >= 0 ? "grab" : "default";
      return sticks.draw();
    }
    const way = sticks.way(event.clientX - desk.drag.x, event.clientY - desk.drag.y);
    desk.drag.to = desk.drag.from.map((value, axis) => value + way[axis]);
    desk.drag.moved = true;
    act("drag", { joint: desk.drag.joint, to: desk.drag.to }, { newest: "joint", gesture: desk.drag.gesture });
    show();
  });
  const released = async () => {
    paper = null;
    const drag = desk.drag;
    if (!drag) return;
    if (drag.moved) await act("drag", { joint: drag.joint, to: drag.to }, { newest: "joint", gesture: drag.gesture });
    if (desk.drag === drag) desk.drag = null;
    show();
  };
  canvas.addEventListener("pointerup", released);
  canvas.addEventListener("pointercancel", released);
  return pointer;
}
