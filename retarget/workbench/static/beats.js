// A dance in beats: a line for each posture, its steps as bars that can be dragged; the wheel makes a step larger.

const [LEFT, RIGHT, TOP, NUMBERS] = [128, 16, 6, 18];
const QUARTER = 0.25; // of a beat, to which steps are put

export function makeBeats(el, { move, drop, put, went }) {
  const canvas = document.createElement("canvas");
  canvas.className = "strip";
  canvas.tabIndex = 0;
  canvas.setAttribute("aria-label", "Beats");
  el.append(canvas);
  const context = canvas.getContext("2d");
  const beats = { canvas, count: 8, steps: [], chosen: "", at: 0 };
  let drag = null;

  const x = (beat) => LEFT + (beat / beats.count) * (canvas.clientWidth - LEFT - RIGHT);
  const lines = () => [...new Set([...beats.steps.map(({ posture }) => posture), ...(beats.chosen ? [beats.chosen] : [])])];
  const tall = () => Math.min(22, (canvas.clientHeight - TOP - NUMBERS) / Math.max(lines().length, 1));
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    const beat = ((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)) * beats.count;
    return { beat, snapped: Math.max(0, Math.round(beat / QUARTER) * QUARTER), line: lines()[Math.floor((event.clientY - box.top - TOP) / tall())] };
  };
  const under = (event) => {
    const { beat, line } = place(event);
    const near = (8 * beats.count) / canvas.clientWidth;
    return beats.steps.findIndex((step) => step.posture === line && Math.abs(step.beat - beat) < near);
  };

  beats.draw = () => {
    const dense = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    if (!wide || !high) return;
    if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(high * dense)) {
      canvas.width = Math.round(wide * dense);
      canvas.height = Math.round(high * dense);
    }
    context.setTransform(dense, 0, 0, dense, 0, 0);
    context.clearRect(0, 0, wide, high);
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = "#1b1c1e";
    context.fillRect(LEFT, TOP, wide - LEFT - RIGHT, high - TOP - NUMBERS);
    for (let beat = 0; beat < beats.count; beat++) {
      context.fillStyle = beat % 4 ? "#33363b" : "#565a61";
      context.fillRect(x(beat), TOP, 1, high - TOP - NUMBERS);
      context.fillStyle = "#b4b7bd";
      context.textAlign = "center";
      context.fillText(beat + 1, x(beat), high - 5);
    }
    const row = tall();
    lines().forEach((posture, n) => {
      const y = TOP + n * row;
      context.fillStyle = posture === beats.chosen ? "#eceded" : "#b4b7bd";
      context.textAlign = "right";
      context.fillText(posture, LEFT - 10, y + row / 2 + 4, LEFT - 16);
      context.fillStyle = "#2a2c30";
      context.fillRect(LEFT, y + row - 1, wide - LEFT - RIGHT, 1);
      beats.steps.forEach((step, index) => {
        if (step.posture !== posture) return;
        const beat = drag?.step === index ? drag.to : step.beat;
        const size = Math.max(4, Math.min(row - 4, (row - 4) * (0.35 + 0.5 * Math.abs(step.extent))));
        context.fillStyle = step.extent < 0 ? "#5b9dff" : "#f0b04a";
        context.beginPath();
        context.roundRect(x(beat) - 5, y + (row - size) / 2, 10, size, 3);
        context.fill();
      });
    });
    context.fillStyle = "#f4f4f4";
    context.fillRect(x(beats.at) - 0.75, TOP - 4, 1.5, high - TOP - NUMBERS + 6);
  };

  canvas.addEventListener("pointerdown", (event) => {
    const step = under(event);
    const { line, beat } = place(event);
    canvas.setPointerCapture(event.pointerId);
    if (step >= 0) drag = { step, to: beats.steps[step].beat };
    else if (line === undefined || beat < 0) went(Math.max(0, beat));
    else drag = { on: beat, line };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (drag?.step === undefined) {
      if (drag) went(place(event).beat);
      return;
    }
    drag.to = Math.min(place(event).snapped, beats.count - QUARTER);
    beats.draw();
  });
  canvas.addEventListener("pointerup", async () => {
    const held = drag;
    if (held?.step !== undefined && held.to !== beats.steps[held.step].beat) await move(held.step, { beat: held.to });
    else if (held?.on !== undefined) went(held.on);
    drag = null;
    beats.draw();
  });
  canvas.addEventListener("dblclick", (event) => {
    const { snapped, line } = place(event);
    const step = under(event);
    if (step >= 0) drop(step);
    else if (line && snapped < beats.count) put(line, snapped);
  });
  canvas.addEventListener("wheel", (event) => {
    const step = under(event);
    if (step < 0) return;
    event.preventDefault();
    move(step, { extent: Math.round((beats.steps[step].extent - Math.sign(event.deltaY) * 0.1) * 10) / 10 });
  }, { passive: false });
  new ResizeObserver(beats.draw).observe(canvas);
  return beats;
}
