// A dance in beats: phrases side by side, a line for each posture, steps as bars.  A bar is dragged to another beat, up and
// down to make it larger or smaller; a double click puts the chosen posture there or takes a step out; Ctrl and the wheel
// zoom.  Above it, where there is music, all of the song with its beats.  Of a clip it shows the seconds.
import { secondsAt } from "./phrases.js";

const [LEFT, RIGHT, SONG, HEAD, NUMBERS] = [128, 16, 14, 18, 16];
const QUARTER = 0.25; // of a beat, to which steps are put
const [STILL, FAR] = [6, 60]; // pixels up or down that do nothing yet, and that are an extent of 1
const MOST = 24; // times as wide as the strip

export function makeBeats(el, { move, drop, put, went, seek }) {
  const canvas = document.createElement("canvas");
  canvas.className = "strip";
  canvas.tabIndex = 0;
  canvas.setAttribute("aria-label", "Beats");
  el.append(canvas);
  const context = canvas.getContext("2d");
  const beats = { canvas, phrases: [], chosen: "", phrase: 0, at: { phrase: 0, beat: 0 }, music: null, bpm: 120, seconds: 0, clip: 0, zoom: 1, from: 0, step: null };
  let drag = null;

  const total = () => Math.max(beats.phrases.reduce((sum, { beats: count }) => sum + count, 0), 1);
  const startOf = (phrase) => beats.phrases.slice(0, phrase).reduce((sum, { beats: count }) => sum + count, 0);
  const room = () => canvas.clientWidth - LEFT - RIGHT;
  const x = (beat) => LEFT + ((beat - beats.from) / total()) * beats.zoom * room();
  const beatOn = (pixel) => beats.from + ((pixel - LEFT) / room() / beats.zoom) * total();
  const song = () => (beats.music ? SONG : 0);
  const top = () => song() + HEAD;
  const low = () => canvas.clientHeight - NUMBERS;
  const lines = () => [...new Set([...beats.phrases.flatMap(({ steps }) => steps.map(({ posture }) => posture)), ...(beats.chosen ? [beats.chosen] : [])])];
  const tall = () => Math.min(22, (low() - top()) / Math.max(lines().length, 1));
  const keep = () => (beats.from = Math.min(Math.max(beats.from, 0), total() * (1 - 1 / beats.zoom)));

  // Which phrase and which beat of it a beat of all phrases is.
  const inPhrase = (beat) => {
    let left = Math.max(0, Math.min(beat, total() - QUARTER));
    for (const [phrase, { beats: count }] of beats.phrases.entries()) {
      if (left < count) return { phrase, beat: left };
      left -= count;
    }
    return { phrase: 0, beat: 0 };
  };
  const snapped = (beat) => {
    const { phrase, beat: own } = inPhrase(Math.round(beat / QUARTER) * QUARTER);
    return { phrase, beat: Math.min(own, beats.phrases[phrase].beats - QUARTER) };
  };
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    const [right, down] = [event.clientX - box.left, event.clientY - box.top];
    return { right, down, beat: beatOn(right), line: lines()[Math.floor((down - top()) / tall())] };
  };
  const under = (event) => {
    const { right, line } = place(event);
    for (const [phrase, { steps }] of beats.phrases.entries()) {
      const step = steps.findIndex((one) => one.posture === line && Math.abs(x(startOf(phrase) + one.beat) - right) < 8);
      if (step >= 0) return { phrase, step };
    }
    return null;
  };
  const stepOf = ({ phrase, step }) => beats.phrases[phrase]?.steps[step];
  const same = (one, other) => one && other && one.phrase === other.phrase && one.step === other.step;

  beats.draw = () => {
    const dense = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    if (!wide || !high) return;
    if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(high * dense)) {
      canvas.width = Math.round(wide * dense);
      canvas.height = Math.round(high * dense);
    }
    keep();
    context.setTransform(dense, 0, 0, dense, 0, 0);
    context.clearRect(0, 0, wide, high);
    context.font = "11px system-ui, sans-serif";
    if (beats.clip) return drawClip(wide);
    if (beats.music) drawSong(wide);
    const row = tall();
    lines().forEach((posture, n) => {
      context.fillStyle = posture === beats.chosen ? "#eceded" : "#b4b7bd";
      context.textAlign = "right";
      context.fillText(posture, LEFT - 10, top() + n * row + row / 2 + 4, LEFT - 16);
    });
    context.save();
    context.beginPath();
    context.rect(LEFT - 7, 0, wide - LEFT - RIGHT + 14, high);
    context.clip();
    beats.phrases.forEach((phrase, number) => drawPhrase(phrase, number, row));
    const cursor = x(startOf(beats.at.phrase) + beats.at.beat);
    context.fillStyle = "#f4f4f4";
    context.fillRect(cursor - 0.75, song() + 2, 1.5, high - song() - NUMBERS);
    context.restore();
  };

  function drawClip(wide) {
    const at = (second) => LEFT + (second / beats.clip) * (wide - LEFT - RIGHT);
    context.fillStyle = "#1b1c1e";
    context.fillRect(LEFT, 6, wide - LEFT - RIGHT, low() - 6);
    context.textAlign = "center";
    for (let second = 0; second <= beats.clip; second++) {
      context.fillStyle = "#565a61";
      context.fillRect(at(second), 6, 1, low() - 6);
      context.fillStyle = "#b4b7bd";
      context.fillText(`${second} s`, at(second), canvas.clientHeight - 4);
    }
    context.fillStyle = "#f4f4f4";
    context.fillRect(at(beats.seconds) - 0.75, 2, 1.5, low() - 2);
  }

  function drawSong(wide) {
    const { times, seconds, file } = beats.music;
    const at = (time) => LEFT + (time / seconds) * (wide - LEFT - RIGHT);
    context.fillStyle = "#1b1c1e";
    context.fillRect(LEFT, 1, wide - LEFT - RIGHT, SONG - 4);
    const every = (times.length * 3) / room() > 1 ? 4 : 1;
    times.forEach((time, n) => {
      if (n % every) return;
      context.fillStyle = n % 4 ? "#4c5057" : "#8a8e96";
      context.fillRect(at(time), 1, 1, SONG - 4);
    });
    context.fillStyle = "#f4f4f4";
    context.fillRect(at(Math.min(beats.seconds, seconds)) - 0.75, 0, 1.5, SONG - 2);
    context.fillStyle = "#b4b7bd";
    context.textAlign = "right";
    context.fillText(file, LEFT - 10, SONG - 4, LEFT - 16);
  }

  function drawPhrase(phrase, number, row) {
    const [left, right] = [x(startOf(number)), x(startOf(number) + phrase.beats)];
    const chosen = number === beats.phrase;
    context.fillStyle = chosen ? "#3a3d42" : "#2f3136";
    context.fillRect(left + 1, song(), right - left - 2, HEAD - 2);
    context.fillStyle = chosen ? "#eceded" : "#b4b7bd";
    context.textAlign = "left";
    const more = `${phrase.repeats > 1 ? ` × ${phrase.repeats}` : ""}${phrase.mirror ? ", mirrored" : ""}${phrase.half ? ", half time" : ""}`;
    context.fillText(`${number + 1}${more}`, left + 7, song() + HEAD - 6, Math.max(right - left - 12, 1));
    context.fillStyle = "#1b1c1e";
    context.fillRect(left + 1, top(), right - left - 2, low() - top());
    const apart = (right - left) / phrase.beats;
    for (let beat = 0; beat < phrase.beats; beat++) {
      const here = x(startOf(number) + beat);
      context.fillStyle = beat % 4 ? "#33363b" : "#565a61";
      if (beat) context.fillRect(here, top(), 1, low() - top());
      if (apart < 13 && beat % 4) continue;
      context.fillStyle = "#b4b7bd";
      context.textAlign = "center";
      context.fillText(beat + 1, here + (beat ? 0 : 4), canvas.clientHeight - 4);
    }
    lines().forEach((_, n) => {
      context.fillStyle = "#2a2c30";
      context.fillRect(left + 1, top() + (n + 1) * row - 1, right - left - 2, 1);
    });
    const here = beats.at.phrase === number ? Math.max(-1, ...phrase.steps.map(({ beat }) => beat).filter((beat) => beat <= beats.at.beat + 0.05)) : -1;
    phrase.steps.forEach((step, index) => drawStep(step, { phrase: number, step: index }, row, here));
  }

  function drawStep(step, which, row, sounding) {
    const moved = same(drag?.step, which) ? drag : null;
    const extent = moved?.extent ?? step.extent;
    const size = Math.max(4, Math.min(row - 3, (row - 3) * (0.3 + 0.5 * Math.abs(extent))));
    const across = x(moved?.to ? startOf(moved.to.phrase) + moved.to.beat : startOf(which.phrase) + step.beat);
    const y = top() + lines().indexOf(step.posture) * row + (row - size) / 2;
    context.fillStyle = extent < 0 ? "#5b9dff" : step.beat === sounding ? "#ffd28a" : "#f0b04a";
    context.beginPath();
    context.roundRect(across - 5, y, 10, size, 3);
    context.fill();
    if (step.beat === sounding || same(beats.step, which)) {
      context.strokeStyle = "#fff";
      context.lineWidth = same(beats.step, which) ? 2 : 1;
      context.stroke();
    }
    if (moved) {
      context.fillStyle = "#fff";
      context.textAlign = "left";
      context.fillText(extent.toFixed(2), across + 9, y + size / 2 + 4);
    }
  }

  canvas.addEventListener("pointerdown", (event) => {
    const step = beats.clip ? null : under(event);
    const { right, down, beat } = place(event);
    canvas.setPointerCapture(event.pointerId);
    beats.step = step;
    if (beats.clip || (beats.music && down < SONG)) drag = { song: beats.clip || beats.music.seconds };
    else if (step) drag = { step, right, down, to: null, extent: undefined };
    else if (right >= LEFT) drag = { on: beat };
    const phrase = step?.phrase ?? inPhrase(beat).phrase;
    if (!beats.clip && right >= LEFT && down >= song() && phrase !== beats.phrase) {
      beats.phrase = phrase;
      beats.picked?.(phrase);
    }
    pointed(event);
  });
  function pointed(event) {
    const { right, down, beat } = place(event);
    if (drag?.song) seek(Math.min(Math.max((right - LEFT) / room(), 0), 1) * drag.song);
    else if (drag?.on !== undefined) went(inPhrase(beat));
    else if (drag?.step) {
      const old = stepOf(drag.step);
      if (!old) return;
      if (Math.abs(right - drag.right) > 3 || drag.to) drag.to = snapped(startOf(drag.step.phrase) + old.beat + beat - beatOn(drag.right));
      const up = drag.down - down;
      if (Math.abs(up) > STILL || drag.extent !== undefined) {
        const by = (Math.sign(up) * Math.max(Math.abs(up) - STILL, 0)) / FAR;
        drag.extent = Math.round(Math.min(Math.max(old.extent + by, -3), 3) * 20) / 20;
      }
    }
    beats.draw();
  }
  canvas.addEventListener("pointermove", (event) => drag && pointed(event));
  const released = async () => {
    const held = drag;
    const old = held?.step && stepOf(held.step);
    if (old) {
      const to = held.to ?? { phrase: held.step.phrase, beat: old.beat };
      const extent = held.extent ?? old.extent;
      const other = to.phrase !== held.step.phrase;
      if (other || to.beat !== old.beat || extent !== old.extent) {
        beats.step = null; // its number may be another now
        await move(held.step.step, { phrase: held.step.phrase, beat: to.beat, extent, ...(other && { into: to.phrase }) });
      }
    }
    if (drag === held) drag = null;
    beats.draw();
  };
  canvas.addEventListener("pointerup", released);
  canvas.addEventListener("pointercancel", () => ((drag = null), beats.draw()));
  canvas.addEventListener("dblclick", (event) => {
    if (beats.clip) return;
    const { line, beat, down } = place(event);
    const step = under(event);
    if (step) drop(step.step, step.phrase);
    else if (line && down >= top() && beat < total()) put(line, snapped(beat));
  });
  canvas.addEventListener("wheel", (event) => {
    if (beats.clip) return;
    const step = under(event);
    const { right, beat } = place(event);
    if (!event.ctrlKey && !step && beats.zoom === 1) return;
    event.preventDefault();
    if (event.ctrlKey) {
      beats.zoom = Math.min(Math.max(beats.zoom * Math.exp(-event.deltaY * 0.002), 1), MOST);
      beats.from = beat - ((right - LEFT) / room() / beats.zoom) * total();
    } else if (step) {
      const extent = Math.round((stepOf(step).extent - Math.sign(event.deltaY) * 0.1) * 10) / 10;
      move(step.step, { phrase: step.phrase, extent: Math.min(Math.max(extent, -3), 3) });
    } else beats.from += ((event.deltaX || event.deltaY) / room() / beats.zoom) * total();
    beats.draw();
  }, { passive: false });

  // The step that was clicked last is taken out.
  beats.dropChosen = () => {
    if (!beats.step || !stepOf(beats.step)) return false;
    drop(beats.step.step, beats.step.phrase);
    beats.step = null;
    return true;
  };
  beats.timeOf = (beat) => secondsAt(beat, beats.music?.times, beats.music?.bpm ?? beats.bpm);
  beats.spot = ({ phrase, step }) => [x(startOf(phrase) + stepOf({ phrase, step }).beat), top() + (lines().indexOf(stepOf({ phrase, step }).posture) + 0.5) * tall()]; // for tests
  canvas.beats = beats;
  new ResizeObserver(beats.draw).observe(canvas);
  return beats;
}
