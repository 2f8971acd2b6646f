// The posing desk: joints dragged on springs, postures mixed, kept and put on beats; a clip beside it made rubber.
import { makeBeats } from "./beats.js";
import { button, calm, fill, icon, iconButton, make, place, slider } from "./dom.js";
import { makeHandles } from "./handles.js";
import { key, ownKey, press } from "./keys.js";
import { makeSticks, placesAt } from "./sticks.js";

export const title = "Pose";

const DANCE = {
  bpm: ["Beats a minute", { min: 40, max: 220, step: 1, value: 120 }],
  quick: ["Quickness", { min: 0.5, max: 6, step: 0.1, value: 2.2 }],
  damping: ["Damping", { min: 0.05, max: 1.5, step: 0.05, value: 0.8 }],
  clumsy: ["Clumsy", { min: -1, max: 1, step: 0.1, value: 0 }],
  stiff: ["Stiff", { min: -1, max: 1, step: 0.1, value: 0 }],
  wild: ["Wild", { min: -1, max: 1, step: 0.1, value: 0 }],
  extent: ["Extent", { min: 0, max: 2, step: 0.05, value: 1 }],
};
const RUBBER = {
  omega: ["Omega", { min: 1, max: 8, step: 0.1, value: 3 }],
  sigma: ["Sigma (s)", { min: 0.03, max: 0.6, step: 0.01, value: 0.15 }],
  follow: ["Follow-through", { min: 0, max: 1, step: 0.05, value: 0.5 }],
  squash: ["Squash", { min: 0, max: 1, step: 0.05, value: 0.5 }],
  hose: ["Hose", { min: 0, max: 1, step: 0.05, value: 1 }],
};
const MODES = { pose: "Pose", dance: "Dance", rubber: "Rubber" };
const NEAR = 22; // pixels of the screen within which a joint is caught

export function mount(el, bench) {
  const side = make("aside.side");
  const hint = make("p.hint", { role: "status" });
  const picture = make("div.picture");
  const below = make("footer.below");
  const rail = make("div.rail", { role: "toolbar", "aria-label": "What is done" });
  el.append(rail, make("div.stage", {}, hint, picture), side, below);
  const sticks = makeSticks(picture);
  place(sticks.canvas, "The figure");
  const desk = { mode: "pose", hover: -1, drag: null, sliders: {}, played: null, clip: null, problem: "", frame: 0, playing: false, began: [0, 0], open: "", posture: "", seed: 0 };
  for (const [name, [, { value }]] of Object.entries({ ...DANCE, ...RUBBER })) desk.sliders[name] = value;

  const now = () => bench.state.posing ?? {};
  const act = (name, fields, options) => bench.act(`posing.${name}`, fields, options);

  const play = iconButton("play", "Play (Space)", toggle);
  const clock = make("output.frame");
  const seed = button("Make one up", "", () => act("invent", { seed: desk.seed++ }));
  below.append(make("div.transport", {}, play, clock, seed));
  const beats = makeBeats(below, {
    move: (step, to) => act("move", { step, ...to }),
    drop: (step) => act("drop", { step }),
    put: (posture, beat) => act("put", { posture, beat }),
    went: (beat) => {
      if (desk.mode === "pose") return;
      desk.playing = false;
      const last = (desk.played?.shape[0] ?? 1) - 1;
      go(Math.round(desk.mode === "dance" ? (beat * 60 * 24) / desk.sliders.bpm : (beat / beats.count) * last));
    },
  });

  const handles = makeHandles(bench, {
    what: "joint",
    count: () => (desk.mode === "pose" ? now().pose?.length ?? 0 : 0),
    place: (joint) => now().pose[joint],
    chosen: (joint) => ((desk.hover = joint), explain(), sticks.draw()),
    send: (joint, to, gesture) => act("drag", { joint, to }, { newest: "joint", gesture }),
    way: (right, down) => sticks.way(4 * right, 4 * down),
  });

  const modes = {};
  for (const [name, text] of Object.entries(MODES)) {
    modes[name] = make("button.tool", { type: "button", onclick: () => choose(name) }, text);
    rail.append(modes[name]);
  }
  function choose(name) {
    handles.leave();
    desk.mode = name;
    desk.played = null;
    desk.playing = name !== "pose" && !calm();
    desk.problem = "";
    desk.frame = 0;
    desk.began = [performance.now(), 0];
    for (const [other, element] of Object.entries(modes)) element.setAttribute("aria-pressed", String(other === name));
    panel();
    want();
    show();
    explain();
    if (desk.playing) requestAnimationFrame(tick);
  }

  // What is played: asked for anew whenever a slider or the dance changes, and it plays on meanwhile.

  let asking = false;
  let again = false;
  async function want() {
    again = true;
    if (asking) return;
    asking = true;
    while (again && desk.mode !== "pose") {
      again = false;
      const mode = desk.mode;
      const names = Object.keys(mode === "dance" ? DANCE : RUBBER);
      const fields = Object.fromEntries(names.map((name) => [name, desk.sliders[name]]));
      try {
        const first = !desk.played;
        if (mode === "rubber") desk.clip ??= await fetch("posing.clip", {});
        const played = await fetch(mode === "dance" ? "posing.danced" : "posing.rubber", fields);
        if (desk.mode !== mode) continue;
        desk.played = played;
        desk.problem = "";
        if (first) frameAll();
      } catch (error) {
        if (desk.mode === mode) Object.assign(desk, { problem: error.message, played: null });
      }
      show();
      explain();
    }
    asking = false;
  }
  async function fetch(look, fields) {
    const { event, view } = await bench.look(look, fields);
    const points = new Float32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
    return { ...event, points };
  }

  const apart = () => {
    const { points, shape } = desk.clip;
    let wide = 0;
    for (let joint = 0; joint < shape[1]; joint++) wide = Math.max(wide, Math.abs(points[3 * joint] - points[0]));
    return Math.max(1, 2.4 * wide);
  };

  function frameAll() {
    const all = [];
    const last = desk.played.shape[0] - 1;
    for (let t = 0; t <= last; t += Math.max(1, Math.floor(last / 12))) all.push(...figuresAt(t).flatMap(({ places }) => places));
    sticks.fit(all);
  }

  const sideOf = (name) => (/[Ll]eft|^[Ll][A-Z_]/.test(name) ? "#ffb03b" : /[Rr]ight|^[Rr][A-Z_]/.test(name) ? "#5b9dff" : "#d7d9dd");

  function figuresAt(t) {
    const { figure } = now();
    const color = (joint) => sideOf(figure.names[joint] ?? "");
    if (desk.mode === "dance") return [{ places: placesAt(desk.played, t), parents: figure.parents, color }];
    const off = apart() / 2;
    const shift = (places, by) => places.map(([x, y, z]) => [x + by, y, z]);
    const clip = { places: shift(placesAt(desk.clip, Math.min(t, desk.clip.shape[0] - 1)), -off), parents: desk.clip.parents, color: () => "#8d9199" };
    return [clip, { places: shift(placesAt(desk.played, t), off), parents: desk.played.parents, color: () => "#f0b04a", seamless: true }];
  }

  function pose() {
    const { pose: places = [] } = now();
    if (!desk.drag) return places;
    const moved = [...places];
    moved[desk.drag.joint] = desk.drag.to; // the hand sees at once what it does; the rest comes when it is known
    return moved;
  }

  function show() {
    const { figure } = now();
    if (!figure) sticks.figures = [];
    else if (desk.mode === "pose" || !desk.played) {
      sticks.figures = desk.mode === "pose" ? [{ places: pose(), parents: figure.parents, color: (joint) => sideOf(figure.names[joint]) }] : [];
      clock.textContent = "";
    } else {
      desk.frame = Math.min(desk.frame, desk.played.shape[0] - 1);
      sticks.figures = figuresAt(desk.frame);
      const seconds = desk.frame / desk.played.fps;
      clock.textContent = `${seconds.toFixed(2)} s`;
      beats.at = desk.mode === "dance" ? ((seconds * desk.sliders.bpm) / 60 / (now().dance.half ? 2 : 1)) % beats.count : (desk.frame / (desk.played.shape[0] - 1 || 1)) * beats.count;
      beats.draw();
    }
    sticks.draw();
  }

  sticks.painters.push((context) => {
    const { figure, pinned = [] } = now();
    if (!figure || desk.mode !== "pose") return;
    pose().forEach((place, joint) => {
      const [x, y] = sticks.seen(place);
      const pin = pinned.includes(joint);
      context.beginPath();
      if (pin) context.rect(x - 6, y - 6, 12, 12);
      else context.arc(x, y, joint === desk.hover ? 7 : 3.5, 0, 2 * Math.PI);
      context.fillStyle = pin ? "#ff6a5e" : joint === desk.hover ? "#fff" : "rgba(20, 20, 22, 0.75)";
      context.strokeStyle = "rgba(255, 255, 255, 0.85)";
      context.lineWidth = 1.5;
      context.fill();
      context.stroke();
    });
    if (desk.hover >= 0) {
      const [x, y] = sticks.seen(pose()[desk.hover]);
      context.font = "12px system-ui, sans-serif";
      context.textAlign = "left";
      context.fillStyle = "#fff";
      context.fillText(figure.names[desk.hover], x + 12, y - 8);
    }
  });

  function tick(moment) {
    if (!desk.playing || el.hidden) return;
    if (desk.played) {
      const frame = desk.began[1] + Math.floor(((moment - desk.began[0]) / 1000) * desk.played.fps);
      const count = desk.played.shape[0];
      const next = ((frame % count) + count) % count;
      if (next !== desk.frame) {
        desk.frame = next;
        show();
      }
    }
    requestAnimationFrame(tick);
  }
  function toggle() {
    if (desk.mode === "pose") return choose("dance");
    desk.playing = !desk.playing;
    desk.began = [performance.now(), desk.frame];
    if (desk.playing) requestAnimationFrame(tick);
    explain();
  }
  function go(frame) {
    if (!desk.played) return;
    desk.playing = false;
    desk.frame = Math.min(Math.max(frame, 0), desk.played.shape[0] - 1);
    show();
    explain();
  }

  // The pointer.

  function nearest(event) {
    const box = sticks.canvas.getBoundingClientRect();
    let [best, found] = [NEAR, -1];
    (now().pose ?? []).forEach((place, joint) => {
      const [x, y] = sticks.seen(place);
      const away = Math.hypot(x - event.clientX + box.left, y - event.clientY + box.top);
      if (away < best) [best, found] = [away, joint];
    });
    return found;
  }

  sticks.canvas.addEventListener("pointerdown", (event) => {
    if (!now().figure) return;
    const joint = desk.mode === "pose" && event.button === 0 ? nearest(event) : -1;
    if (joint < 0) return sticks.orbit(event);
    sticks.canvas.setPointerCapture(event.pointerId);
    if (event.shiftKey) return pin(joint);
    const from = now().pose[joint];
    desk.drag = { joint, from, to: from, x: event.clientX, y: event.clientY, gesture: bench.gesture(), moved: false };
  });
  sticks.canvas.addEventListener("pointermove", (event) => {
    if (!desk.drag) {
      const hover = desk.mode === "pose" && event.buttons === 0 ? nearest(event) : desk.hover;
      if (hover === desk.hover) return;
      desk.hover = hover;
      sticks.canvas.style.cursor = hover >= 0 ? "grab" : "default";
      return sticks.draw();
    }
    const way = sticks.way(event.clientX - desk.drag.x, event.clientY - desk.drag.y);
    desk.drag.to = desk.drag.from.map((value, axis) => value + way[axis]);
    desk.drag.moved = true;
    act("drag", { joint: desk.drag.joint, to: desk.drag.to }, { newest: "joint", gesture: desk.drag.gesture });
    show();
  });
  sticks.canvas.addEventListener("pointerup", async () => {
    const drag = desk.drag;
    if (!drag) return;
    if (drag.moved) await act("drag", { joint: drag.joint, to: drag.to }, { newest: "joint", gesture: drag.gesture });
    if (desk.drag === drag) desk.drag = null;
    show();
  });

  const pin = (joint) => joint >= 0 && act("pin", { joint, on: !now().pinned.includes(joint) });

  // Words.

  function explain() {
    const { figure } = now();
    let text;
    if (!figure) text = "Whom to pose? Take a figure at the right, or open a .bvh file.";
    else if (desk.problem && desk.mode !== "pose") text = desk.problem;
    else if (desk.mode === "pose" && desk.hover >= 0 && handles.open) text = `${figure.names[desk.hover]}: P pins it. ${handles.hint()}`;
    else if (desk.mode === "pose") text = "Drag a joint; Shift-click or P pins one. Drag beside the figure to turn round it.";
    else if (!desk.played) text = desk.mode === "rubber" ? "Stretching…" : "Dancing…";
    else if (desk.mode === "dance") text = "Double click in the beats puts the chosen posture there, or takes a step out; drag steps; the wheel makes them larger.";
    else text = "Grey is what was captured, yellow what is made of it.";
    hint.textContent = text;
    hint.title = text;
    fill(play, icon(desk.playing ? "stop" : "play"));
    play.title = desk.playing ? "Stop (Space)" : "Play (Space)";
    play.setAttribute("aria-label", play.title);
  }

  let panelOf = "";
  function panel() {
    const { figure, pool = [], extents = {}, pinned = [] } = now();
    const key = JSON.stringify([desk.mode, figure?.file, pool, pinned, bench.running, desk.result]);
    if (key === panelOf) return setSliders(extents);
    panelOf = key;
    if (!figure) {
      const made = ["human", "flower", "lamp"].map((who) => button(`The ${who}`, "", () => act("begin", { who })));
      return fill(side, make("h2", {}, "Figures"), make("div.row", {}, ...made));
    }
    const busy = Boolean(bench.running);
    if (desk.mode !== "pose") {
      const known = desk.mode === "dance" ? DANCE : RUBBER;
      const sliders = Object.entries(known).map(([name, [text, range]]) =>
        slider(text, { ...range, value: desk.sliders[name] }, (value) => {
          const beat = (desk.frame / 24) * (desk.sliders.bpm / 60);
          desk.sliders[name] = value;
          if (name === "bpm") desk.began = [performance.now(), Math.round((beat * 60 * 24) / value)];
          want();
        }));
      const kinds = make("select", { "aria-label": "Export as" }, ...[".bvh", ".mp4", ".gif"].map((kind) => make("option", { value: kind }, { ".bvh": "BVH", ".mp4": "MP4 video", ".gif": "GIF" }[kind])));
      const run = button("Export", "E", () => {
        const chosen = Object.fromEntries(Object.keys(known).map((name) => [name, desk.sliders[name]]));
        bench.work("posing.export", { what: desk.mode, kind: kinds.value, sliders: chosen });
      }, "primary");
      run.disabled = busy;
      const steps = desk.mode === "dance" ? [make("h2", {}, "Posture to put"), postures(pool)] : [];
      return fill(side, make("h2", {}, desk.mode === "dance" ? "How it moves" : "How rubbery"), ...sliders, ...steps,
        make("h2", {}, "Export"), make("div.row", {}, kinds, run), desk.result && make("p.result", {}, desk.result));
    }
    const name = make("input", { type: "text", placeholder: "its name", maxLength: 60, "aria-label": "Name of the posture" });
    const keep = button("Keep pose", "", async () => {
      await act("keep", { name: name.value.trim() || `pose ${pool.length + 1}` });
    });
    const sliders = pool.map((posture) => {
      let gesture = "";
      return slider(posture, { min: 0, max: 1.5, step: 0.05, value: extents[posture] ?? 0 }, (extent, done) => {
        gesture = gesture || bench.gesture();
        mixedAt = performance.now();
        act("mix", { posture, extent }, { newest: "mix", gesture });
        if (done) gesture = "";
      });
    });
    const frames = figure.frames ? [make("div.row", {}, frameInput(figure.frames), make("span.none", {}, `of ${figure.frames - 1} in the clip`))] : [];
    fill(side,
      make("div.row", {}, button("Stand at rest", "", () => act("stand")), pinned.length ? button("Unpin all", "", () => pinned.forEach((joint) => act("pin", { joint, on: false }))) : null),
      ...frames,
      make("h2", {}, "Postures"), make("div.postures", {}, ...sliders),
      make("div.row", {}, name, keep),
      make("div.row", {}, button("Save pose as BVH", "", () => act("save_pose").then((done) => done && bench.say(`${bench.state.folder.at.open}.pose.bvh is written.`)))));
  }

  let mixedAt = 0; // when a posture's slider was last moved, in ms
  // What is not being moved by hand shows what is mixed now.
  function setSliders(extents) {
    for (const label of side.querySelectorAll(".postures .slider")) {
      const [input, output] = [label.querySelector("input"), label.querySelector("output")];
      if (input.matches(":active") || (input.matches(":focus") && performance.now() - mixedAt < 500)) continue;
      input.value = extents[label.querySelector("span").textContent] ?? 0;
      output.textContent = input.value;
    }
  }

  function frameInput(count) {
    const input = make("input", { type: "number", min: 0, max: count - 1, value: 0, "aria-label": "Frame of the clip" });
    input.onchange = () => act("take", { frame: Math.max(0, Math.round(Number(input.value) || 0)) });
    return input;
  }

  function postures(pool) {
    if (!pool.includes(desk.posture)) desk.posture = pool[0];
    const select = make("select", { "aria-label": "Posture to put", onchange: () => ((desk.posture = select.value), line()) }, ...pool.map((name) => make("option", { value: name, selected: name === desk.posture }, name)));
    line();
    return make("div.row", {}, select, button("On this beat", "", () => act("put", { posture: desk.posture, beat: Math.min(Math.round(beats.at * 4) / 4, beats.count - 0.25) })));
  }
  function line() {
    beats.chosen = desk.mode === "dance" ? desk.posture : "";
    beats.draw();
  }

  bench.on("progress", panel);
  bench.on("ended", ({ work, sentence, made }) => {
    if (work === "posing.export") desk.result = made ? sentence : "";
    panel();
  });

  function changed(sections) {
    const { figure, dance } = now();
    const only = Object.keys(sections?.posing ?? {});
    if (only.length === 1 && only[0] === "pose" && figure) return show(); // a drag: as little as can be
    const open = `${bench.state.folder.at.open} ${figure?.file}`;
    if (open !== desk.open) {
      Object.assign(desk, { open, clip: null, played: null, drag: null });
      if (figure) sticks.fit(now().pose);
    }
    if (dance) Object.assign(beats, { steps: dance.steps, count: Math.max(dance.phrase, 1) });
    beats.draw();
    if (desk.mode === "dance" && (!sections || sections.posing?.dance || sections.posing?.pool)) want();
    panel();
    show();
    explain();
  }

  choose("pose");

  const step = (event) => (event.shiftKey ? 10 : 1);
  const keys = [
    ...handles.keys,
    key(" ", "Play and stop", toggle),
    key("ArrowLeft", "A frame back; with Shift ten", (event) => go(desk.frame - step(event))),
    key("ArrowRight", "A frame on; with Shift ten", (event) => go(desk.frame + step(event))),
    key("Home", "The beginning", () => go(0)),
    key("End", "The end", () => go(1e9)),
    key("1-9", `${Object.values(MODES).join(", ")}`, (event) => (Object.keys(MODES)[event.key - 1] ? choose(Object.keys(MODES)[event.key - 1]) : false), "1–3"),
    key("p", "Pin the joint, or let it go", () => pin(desk.hover)),
    key("0", "All of the figure", () => sticks.fit(desk.played ? figuresAt(desk.frame).flatMap(({ places }) => places) : now().pose ?? [])),
  ];

  return {
    changed,
    shown: () => (changed(), desk.playing && requestAnimationFrame(tick), now().pose && sticks.fit(now().pose)),
    hidden: () => (desk.playing = false),
    keys,
    key: (event) => !ownKey(event) && press(keys, event),
  };
}
