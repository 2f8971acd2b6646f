// Time: buttons to play, and a strip with the misfit of every frame, the worst marked, and the keys.
import { fill, icon, iconButton, make } from "./dom.js";
import { key, press } from "./keys.js";

const [LEFT, RIGHT, TOP, KEYS] = [52, 16, 8, 36]; // pixels round the curves; below them the keys' row, and the numbers

// Of a timeline may be set: curves, worst, keys, lost, and `again`, the frames that would be tracked again, with a colour each.
export function makeTimeline(el, { went, keyChosen }) {
  const strip = make("canvas.strip", { tabIndex: 0, role: "slider", "aria-label": "Frame", "aria-valuenow": "0", "aria-valuemin": "0", "aria-valuemax": "0" });
  const context = strip.getContext("2d");
  const play = iconButton("play", "Play (Space)", () => time.toggle());
  const number = make("output.frame");
  const buttons = make(
    "div.transport",
    {},
    iconButton("first", "First frame (Home)", () => time.go(time.first)),
    iconButton("back", "Back (Left; Shift: 10)", () => time.go(time.frame - 1)),
    play,
    iconButton("on", "On (Right; Shift: 10)", () => time.go(time.frame + 1)),
    iconButton("last", "Last frame (End)", () => time.go(time.last)),
    number,
  );
  el.append(buttons, strip);
  const time = { frame: 0, first: 0, last: 0, fps: 24, playing: false, curves: [], worst: [], keys: [], lost: [], again: [] };
  let began = [0, 0];

  const count = () => time.last - time.first + 1;
  const x = (frame) => LEFT + ((frame - time.first + 0.5) / count()) * (strip.clientWidth - LEFT - RIGHT);
  const frameAt = (event) => {
    const box = strip.getBoundingClientRect();
    return time.first + Math.floor(((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)) * count());
  };

  time.go = (frame) => {
    const to = Math.min(Math.max(Math.round(frame), time.first), time.last);
    number.textContent = `${to} / ${time.last}`;
    const spoken = { valuenow: to, valuemin: time.first, valuemax: time.last, valuetext: told(to) };
    for (const [name, value] of Object.entries(spoken)) strip.setAttribute(`aria-${name}`, String(value));
    const moved = to !== time.frame;
    time.frame = to;
    if (moved) went(to);
    time.draw();
  };

  // What the strip shows at a frame, in words.
  const told = (frame) => {
    const misfits = time.curves.map(({ values, first }) => values[frame - first]).filter((value) => value !== undefined);
    const marks = [
      time.keys.some((key) => key.frame === frame) && "a key",
      misfits.length && `${Math.max(...misfits).toFixed(1)} pixels off`,
      time.worst.some((one) => one.frame === frame) && "one of the worst",
      time.lost.includes(frame) && "not seen",
    ];
    return [`frame ${frame} of ${time.last}`, ...marks.filter(Boolean)].join(", ");
  };

  time.toggle = () => {
    time.playing = !time.playing;
    fill(play, icon(time.playing ? "stop" : "play"));
    play.title = time.playing ? "Stop (Space)" : "Play (Space)";
    play.setAttribute("aria-label", play.title);
    if (!time.playing) return;
    if (time.frame >= time.last) time.go(time.first);
    began = [performance.now(), time.frame];
    requestAnimationFrame(tick);
  };

  function tick(now) {
    if (!time.playing) return;
    const span = time.last - time.first + 1;
    const frame = began[1] + Math.floor(((now - began[0]) / 1000) * time.fps);
    time.go(time.first + ((((frame - time.first) % span) + span) % span));
    requestAnimationFrame(tick);
  }

  time.draw = () => {
    const dense = window.devicePixelRatio || 1;
    const [wide, tall] = [strip.clientWidth, strip.clientHeight];
    if (!wide || !tall) return;
    strip.width = Math.round(wide * dense);
    strip.height = Math.round(tall * dense);
    context.setTransform(dense, 0, 0, dense, 0, 0);
    context.clearRect(0, 0, wide, tall);
    context.font = "11px system-ui, sans-serif";
    const bottom = tall - KEYS;
    const most = Math.max(1, ...time.curves.flatMap(({ values }) => values)) * 1.15;
    const y = (value) => bottom - (value / most) * (bottom - TOP);
    context.fillStyle = "#1b1c1e";
    context.fillRect(LEFT, TOP, wide - LEFT - RIGHT, bottom - TOP);
    context.fillStyle = "#9a9da3";
    context.textAlign = "right";
    if (time.curves.length) {
      context.fillText(`${most.toFixed(1)} px`, LEFT - 5, TOP + 9);
      context.fillText("0", LEFT - 5, bottom);
    }
    context.textAlign = "center";
    const every = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000].find((n) => (n / count()) * wide > 44) ?? 10000;
    for (let frame = every * Math.ceil(time.first / every); frame <= time.last; frame += every) {
      context.fillStyle = "#33363b";
      context.fillRect(x(frame), TOP, 1, bottom - TOP);
      context.fillStyle = "#9a9da3";
      context.fillText(frame, x(frame), tall - 5);
    }
    context.fillStyle = "rgba(150, 150, 150, 0.25)";
    for (const frame of time.lost) context.fillRect(x(frame - 0.5), TOP, x(time.first + 1) - x(time.first), bottom - TOP);
    context.save(); // a capture may reach beyond the stretch that is chosen now
    context.beginPath();
    context.rect(LEFT, 0, wide - LEFT - RIGHT + 6, tall);
    context.clip();
    for (const { first, last, color } of time.again) {
      const [left, right] = [x(first), x(last)];
      context.globalAlpha = 0.16;
      context.fillStyle = color;
      context.fillRect(left, TOP, right - left, bottom - TOP);
      context.globalAlpha = 1;
      context.fillRect(left, bottom - 2, right - left, 3);
      for (const end of [left, right]) context.fillRect(end - 1, bottom - 7, 2, 8);
    }
    for (const { values, first, color, chosen } of time.curves) {
      context.beginPath();
      values.forEach((value, t) => context[t ? "lineTo" : "moveTo"](x(t + first), y(value)));
      context.strokeStyle = color;
      context.lineWidth = chosen ? 2 : 1.2;
      context.stroke();
    }
    for (const { frame, value } of time.worst) {
      context.beginPath();
      context.arc(x(frame), y(value), 4.5, 0, 2 * Math.PI);
      context.fillStyle = "#ff6a5e";
      context.fill();
    }
    for (const { frame, color, chosen } of time.keys) {
      const [at, size] = [x(frame), chosen ? 6 : 4.5];
      context.beginPath();
      context.moveTo(at, bottom + 3);
      context.lineTo(at + size, bottom + 3 + size);
      context.lineTo(at, bottom + 3 + 2 * size);
      context.lineTo(at - size, bottom + 3 + size);
      context.fillStyle = color;
      context.fill();
      if (chosen) {
        context.strokeStyle = "#fff";
        context.lineWidth = 1.5;
        context.closePath();
        context.stroke();
      }
    }
    context.restore();
    context.fillStyle = "#f4f4f4";
    context.fillRect(x(time.frame) - 0.75, TOP - 6, 1.5, bottom - TOP + 8);
  };

  // A click beside a mark goes to the mark; dragging scrubs.
  let scrubbing = false;
  strip.addEventListener("pointerdown", (event) => {
    const box = strip.getBoundingClientRect();
    const at = event.clientX - box.left;
    const key = time.keys.find(({ frame }) => Math.abs(x(frame) - at) < 7);
    const worst = time.worst.find(({ frame }) => Math.abs(x(frame) - at) < 6);
    if (time.playing) time.toggle();
    if (event.clientY - box.top > box.height - KEYS && key) return keyChosen(key);
    scrubbing = true;
    strip.setPointerCapture(event.pointerId);
    time.go(worst ? worst.frame : frameAt(event));
  });
  strip.addEventListener("pointermove", (event) => scrubbing && time.go(frameAt(event)));
  strip.addEventListener("pointerup", () => (scrubbing = false));
  strip.time = time; // for tests
  new ResizeObserver(time.draw).observe(strip);

  const step = (event) => (event.shiftKey ? 10 : 1);
  time.keys = [
    key(" ", "Play and stop", time.toggle),
    key("ArrowLeft", "A frame back; with Shift ten", (event) => time.go(time.frame - step(event))),
    key("ArrowRight", "A frame on; with Shift ten", (event) => time.go(time.frame + step(event))),
    key("Home", "The first frame", () => time.go(time.first)),
    key("End", "The last frame", () => time.go(time.last)),
  ];
  time.key = (event) => press(time.keys, event);
  return time;
}
