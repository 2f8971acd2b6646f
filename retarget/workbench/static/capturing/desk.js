// The capture desk: tell the parts, choose and correct their keys, capture, and look where it is worst.
import { PART_COLORS, button, fill, make, place, slider } from "../shared/dom.js";
import { makeFrames } from "../shared/frames.js";
import { key, ownKey, press } from "../shared/keys.js";
import { makeTimeline } from "../shared/timeline.js";
import { makeTools } from "./tools.js";
import { makeView, paintDots, paintLine } from "../shared/view.js";

export const title = "Capture";

export function mount(el, bench) {
  const side = make("aside.side");
  const hint = make("p.hint", { role: "status" });
  const picture = make("div.picture");
  const stage = make("div.stage", {}, hint, picture);
  const below = make("footer.below");
  const rail = make("div.rail", { role: "toolbar", "aria-label": "Tools" });
  el.append(rail, stage, side, below);
  const view = makeView(picture);
  place(view.canvas, "The clip");
  const frames = makeFrames(bench);
  const desk = { part: "", point: -1, reach: 24, residual: 1, most: 8, moved: null, pivot: null, matte: null, showsMatte: true, refined: false };
  const captured = new Map(); // part -> {number, shape, points}
  const time = makeTimeline(below, { went: show, keyChosen: ({ frame, part }) => (choosePart(part), time.go(frame)) });

  const result = make("output.result");
  const stretch = (fields) => bench.act("capture.stretch", fields);
  const begin = button("Begin here", "[", () => stretch({ start: time.frame, stop: now().clip.stop }));
  const end = button("End here", "]", () => stretch({ start: now().clip.start, stop: time.frame + 1 }));
  const whole = button("Whole clip", "", () => stretch({ start: 0 }));
  below.querySelector(".transport").append(begin, end, whole, result);

  const now = () => bench.state.capture ?? {};
  const parts = () => now().parts ?? [];
  const part = () => parts().find(({ name }) => name === desk.part) ?? parts()[0];
  const colorOf = (name) => PART_COLORS[Math.max(parts().findIndex((one) => one.name === name), 0) % PART_COLORS.length];
  const keyHere = () => part()?.keys.find(({ frame, outline }) => frame === time.frame && outline.length);
  const isTold = (one) => one.keys[0].outline.length || one.box || one.color || one.inside.length;
  const isMended = () => Boolean(now().motion && now().again && !now().again.whole);
  const act = (name, fields, options) => bench.act(`capture.${name}`, { part: part()?.name, ...fields }, options);

  const tools = makeTools(rail, view, { bench, desk, act, time, keyHere, part, changed: () => explain() });

  desk.toolChanged = explain;

  // Pictures.

  function show() {
    if (!now().clip) return;
    const bitmap = frames.want(time.frame);
    if (bitmap) [view.picture, view.frame] = [bitmap, time.frame];
    place(view.canvas, `The clip, frame ${time.frame}`);
    view.draw();
    explain();
    paintKeys();
  }
  frames.came = (number) => number === time.frame && show();

  view.painters.push((context) => {
    if (!now().clip) return;
    if (desk.matte && desk.showsMatte && desk.matte.frame === time.frame && !now().motion) {
      context.globalAlpha = 0.5;
      context.drawImage(desk.matte.bitmap, view.x, view.y, view.scale * view.size[0], view.scale * view.size[1]);
      context.globalAlpha = 1;
    }
    for (const one of parts()) {
      const color = colorOf(one.name);
      const chosen = one === part();
      const points = outlineAt(one);
      const key = one.keys.find(({ frame, outline }) => frame === time.frame && outline.length);
      if (points && !(chosen && key)) paintLine(context, view, points, { color, width: chosen ? 2 : 1.5 });
      if (key) paintLine(context, view, outlineOf(one, key), { color, width: chosen ? 2.5 : 1.5, dash: chosen ? [] : [5, 4] });
      if (chosen && key) paintDots(context, view, outlineOf(one, key), { radius: 3.5, marked: desk.point });
      if (chosen && one.box && time.frame === one.keys[0].frame) paintBox(context, one.box, color);
      if (chosen && time.frame === one.keys[0].frame) {
        for (const line of one.inside) paintLine(context, view, line, { color: "#6fd08c", closed: false, width: 4 });
        for (const line of one.outside) paintLine(context, view, line, { color: "#ff6a5e", closed: false, width: 4 });
      }
    }
    tools.paint(context);
  });

  function paintBox(context, [x, y, width, height], color) {
    const corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
    paintLine(context, view, corners, { color, dash: [7, 5] });
  }

  // A key's outline, with the drag that the server has not answered yet.
  function outlineOf(one, key) {
    return desk.moved && desk.moved.part === one.name && desk.moved.key === key.name ? desk.moved.points : key.outline;
  }

  function outlineAt(one) {
    const found = captured.get(one.name);
    const t = time.frame - (now().motion?.first ?? 0);
    if (!found || found.number !== now().motion?.number || t < 0 || t >= found.shape[0]) return null;
    const [, count] = found.shape;
    return Array.from({ length: count }, (_, n) => [found.points[2 * (t * count + n)], found.points[2 * (t * count + n) + 1]]);
  }

  async function fetchCaptured() {
    const motion = now().motion;
    for (const { name } of motion?.parts ?? []) {
      if (captured.get(name)?.number === motion.number) continue;
      try {
        const { event, view: data } = await bench.look("capture.captured", { part: name });
        const points = new Float32Array(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength));
        captured.set(name, { number: motion.number, shape: event.shape, points });
        view.draw();
      } catch (error) {
        bench.say(error.message);
      }
    }
  }

  // The matte takes a moment to make: it is asked for when the hand has come to rest.
  let resting = 0;
  function matteSoon() {
    clearTimeout(resting);
    if (desk.moved) return;
    resting = setTimeout(fetchMatte, desk.matte ? 250 : 0);
  }

  let matteOf = "";
  async function fetchMatte() {
    const one = part();
    const key = one?.keys.find(({ frame }) => frame === time.frame) ?? one?.keys[0];
    const asked = one && isTold(one) && !now().motion ? JSON.stringify([bench.state.folder.at.open, one, key?.name]) : "";
    if (asked === matteOf) return;
    matteOf = asked;
    desk.matte = null;
    view.draw();
    explain();
    if (!asked) return;
    try {
      const found = await bench.picture("capture.matte", { part: one.name, key: key.name });
      if (matteOf !== asked) return;
      desk.matte = found;
      view.draw();
      explain();
    } catch (error) {
      if (matteOf === asked) bench.say(error.message);
    }
  }

  // Words.

  function explain() {
    if (!now().clip) return;
    const one = part();
    const motion = now().motion;
    let text = "";
    if (["capture.capture", "capture.again"].includes(bench.running)) text = "Capturing. You may go on looking; what you change now counts next time.";
    else if (tools.boxed.open) text = tools.boxed.hint();
    else if (tools.handles.open) text = `Point ${tools.handles.number()} of ${keyHere()?.outline.length ?? 0}. ${tools.handles.hint()}`;
    else if (!one || !isTold(one)) text = `Drag a box round ${one ? `the ${one.name}` : "a part"}, in a frame where it is seen whole.`;
    else if (bench.running === "capture.suggest") text = `Following the ${one.name} through the clip, to choose its keys.`;
    else if (!desk.matte && matteOf) text = "Looking which pixels belong to it…";
    else if (one.keys.length === 1 && !motion) text = "Blue is what is taken for the part. If it is right, find its keys; if not, scribble on it, or draw its outline.";
    else if (now().kept && !motion) text = "A capture was interrupted: it goes on from there, if nothing was changed since.";
    else if (!motion) text = `${one.keys.length} keys. Look at each (1–${Math.min(one.keys.length, 9)}), the same colour is the same place; drag what is wrong, then capture.`;
    else if (tools.isPivot() && one.keys[0].outline.length) text = "Drag the cross to where the part turns about; it is told in the first key's frame.";
    else if (isMended() && keyHere()) text = "Drag its points to where they belong; then only what the timeline marks is tracked again (Enter).";
    else if (isMended()) text = "Changed since it was captured: track what is marked on the timeline again, the rest stays as it is.";
    else if (now().stale) text = `All must be captured again: ${now().again?.whole || "the keys were changed"}.`;
    else text = keyHere() ? "A key: drag its points to correct it." : "The red dots are the worst frames. Where the outline is off, mend the frame (F), drag its points, track again.";
    hint.textContent = text;
  }

  function paintKeys() {
    for (const element of side.querySelectorAll(".key")) {
      element.setAttribute("aria-current", String(Number(element.dataset.frame) === time.frame));
    }
  }

  let inPanel = "";
  function panel() {
    const one = part();
    if (!one) return;
    const motion = now().motion;
    const names = parts().map(({ name, parent, order, keys }) => [name, parent, order, keys.map((key) => [key.name, key.frame, key.outline.length > 0])]);
    const seen = JSON.stringify([desk.part, names, parts().map((other) => Boolean(isTold(other))), motion?.number, now().again, one.pivot, bench.running, now().clip]);
    if (seen === inPanel) return paintKeys();
    inPanel = seen; // or a slider would be taken from under the hand
    const list = parts().map((other) =>
      make("button.part", { type: "button", "aria-pressed": String(other === one), onclick: () => choosePart(other.name) },
        make("i", { style: `background: ${colorOf(other.name)}` }), other.name,
        make("small", {}, other.parent ? `on ${other.parent}` : "")));
    const name = make("input", { type: "text", value: one.name, maxLength: 60, "aria-label": "Name of the part" });
    name.onchange = () => act("rename_part", { part: one.name, to: name.value.trim() || one.name }).then(() => choosePart(name.value.trim()));
    const above = make("select", { "aria-label": "Hangs on", onchange: () => act("hang_part", { part: one.name, parent: above.value }) },
      make("option", { value: "" }, "on nothing"),
      ...parts().filter((other) => other !== one).map((other) => make("option", { value: other.name, selected: other.name === one.parent }, `on ${other.name}`)));
    const order = make("input.order", { type: "number", value: one.order, title: "Of two parts the one with the higher number is in front", "aria-label": "In front" });
    order.onchange = () => act("hang_part", { part: one.name, parent: one.parent, order: Math.round(Number(order.value)) || 0 });
    const keys = one.keys.filter(({ outline }) => outline.length).map((key, n) =>
      make("li", {},
        make("button.key", { type: "button", "data-frame": key.frame, title: n < 9 ? `Key ${n + 1}` : "", onclick: () => time.go(key.frame) }, make("b", {}, n < 9 ? String(n + 1) : "·"), key.name, make("small", {}, `frame ${key.frame}`)),
        one.keys.length > 1 && make("button.gone", { type: "button", title: `Remove ${key.name}`, "aria-label": `Remove ${key.name}`, onclick: () => act("remove_key", { key: key.name }) }, "×")));
    const busy = Boolean(bench.running);
    const wantsKeys = !motion && parts().length === 1 && one.keys.length === 1; // the step that comes next stands out
    const wantsCapture = motion ? now().stale : !wantsKeys && parts().every(isTold);
    const find = button("Find keys", "K", suggest, wantsKeys && isTold(one) ? "primary" : "");
    const run = button(motion ? "Capture again" : "Capture", isMended() ? "" : "Enter", capture, wantsCapture && !isMended() ? "primary" : "");
    const mend = button("Mend this frame", "F", mendFrame);
    const again = button(againSaid(), "Enter", trackAgain, "primary");
    again.hidden = !isMended();
    again.disabled = busy;
    const refined = make("input", { type: "checkbox", checked: desk.refined, disabled: Boolean(now().refining), onchange: () => (desk.refined = refined.checked) });
    const refines = make("label.pin", { title: now().refining || "All frames at once after the capture: less jitter, short gaps are bridged. It takes about as long again." }, refined, "Refine", make("small", {}, now().refining ? "needs torch, not installed" : ""));
    find.disabled = busy || !isTold(one);
    run.disabled = busy || !parts().every(isTold);
    mend.hidden = !motion;
    fill(side,
      make("h2", {}, "Parts"), make("div.parts", {}, ...list),
      make("div.row", {}, name, parts().length > 1 && above, parts().length > 1 && order),
      make("div.row", {}, button("Add a part", "", addPart), parts().length > 1 && button("Remove", "", () => act("remove_part"))),
      !isTold(one) && make("div.row", {}, button("Box what moves", "", tools.boxed.atOnce, "primary")),
      make("h2", {}, "Keys"),
      keys.length ? make("ol.keys", {}, ...keys) : make("p.none", {}, "None yet."),
      slider("Within (px)", { min: 0.3, max: 5, step: 0.1, value: desk.residual }, (value) => (desk.residual = value)),
      slider("Keys at most", { min: 1, max: 12, step: 1, value: desk.most }, (value) => (desk.most = value)),
      make("div.row", {}, find, run),
      refines,
      make("div.row", {}, mend),
      make("div.row", {}, again),
      one.pivot && make("div.row", {}, button("Pivot to the middle", "", () => act("pivot", { at: null }))));
    result.textContent = motion?.said ?? "";
    whole.hidden = now().clip.stop - now().clip.start === now().clip.frames;
    paintKeys();
  }

  // What can be done.

  function choosePart(name) {
    desk.part = name;
    desk.point = -1;
    changed();
  }

  async function addPart() {
    const taken = new Set(parts().map(({ name }) => name));
    const name = Array.from({ length: 99 }, (_, n) => `part ${n + 2}`).find((one) => !taken.has(one));
    await bench.act("capture.add_part", { name, frame: time.frame });
    choosePart(name);
    tools.choose("box");
  }

  const suggest = () => part() && bench.work("capture.suggest", { part: part().name, residual: desk.residual, keys: desk.most });
  const capture = () => bench.work("capture.capture", { refined: desk.refined && !now().refining });
  const trackAgain = () => bench.work("capture.again");
  const againSaid = () => {
    const ranges = now().again?.ranges ?? [];
    if (ranges.length === 1) return `Track again ${ranges[0].first}–${ranges[0].last}`;
    return ranges.length ? `Track ${ranges.length} stretches again` : "Bring up to date";
  };
  const mendFrame = async () => {
    await act("fix_frame", { frame: time.frame });
    tools.choose("points");
  };

  function changed() {
    const { clip, motion } = now();
    if (!clip) return nothing();
    frames.of({ ...clip, open: bench.state.folder.at.open });
    view.resize(clip.width, clip.height);
    Object.assign(time, { first: clip.start, last: clip.stop - 1, fps: clip.fps });
    time.curves = (motion?.parts ?? []).map(({ name, residual }) => ({ values: residual, first: motion.first, color: colorOf(name), chosen: name === part()?.name }));
    const worstOf = (frame) => Math.max(...motion.parts.map(({ residual }) => residual[frame - motion.first]));
    time.worst = (motion?.worst ?? []).map((frame) => ({ frame, value: worstOf(frame) }));
    time.lost = (motion?.parts ?? []).flatMap(({ lost }) => lost.map((t) => t + motion.first));
    time.again = (now().again?.ranges ?? []).map(({ part: name, first, last }) => ({ first, last, color: colorOf(name) }));
    time.keys = parts().flatMap((one) =>
      one.keys.filter(({ outline }) => outline.length).map(({ frame }) => ({ frame, part: one.name, color: colorOf(one.name), chosen: one === part() })))
      .sort((a, b) => a.chosen - b.chosen); // the chosen part's on top
    time.go(time.frame);
    panel();
    tools.changed(isTold(part()));
    show();
    fetchCaptured();
    matteSoon();
  }

  // There is nothing to capture from: what to do then.
  function nothing() {
    [view.picture, inPanel] = [null, ""];
    hint.textContent = now().motion ? "Only the captured motion is open here, its clip is not." : "There is no clip open: open one to capture from.";
    fill(side, make("h2", {}, "Parts"), make("div.row", {}, button("Open a clip", "", () => bench.act("folder.close"), "primary")),
      now().motion && make("div.row", {}, button("To the stage", "", () => bench.show("stage"))));
    view.draw();
  }

  for (const kind of ["progress", "ended"]) bench.on(kind, () => (panel(), explain()));

  const keyOf = (number) => (part()?.keys.filter(({ outline }) => outline.length) ?? [])[number - 1];
  const keys = [
    ...tools.handles.keys,
    ...time.keys,
    key("1-9", "A key of the part", (event) => (keyOf(event.key) ? time.go(keyOf(event.key).frame) : false)),
    key("k", "Find keys", suggest),
    key("Enter", "Capture, or track again what was mended", () => (isMended() ? trackAgain() : capture())),
    key("f", "Mend this frame", mendFrame),
    key("[", "Begin here", () => begin.click()),
    key("]", "End here", () => end.click()),
    ...tools.keys,
    key("m", "Show and hide the pixels taken for the part", () => ((desk.showsMatte = !desk.showsMatte), view.draw())),
    key("0", "All of the picture", view.fit),
  ];

  return {
    changed,
    shown: () => (view.fit(), changed()),
    hidden: () => time.playing && time.toggle(),
    keys,
    key: (event) => !ownKey(event) && (tools.boxed.key(event) || press(keys, event)),
  };
}
