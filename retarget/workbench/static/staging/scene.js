// What the stage shows: the picture that is exported, its models from elsewhere, and the source over it or beside it.
import { makeFrames } from "../shared/frames.js";
import { makeOrbit } from "./orbit.js";

const GAP = 12; // pixels between the source and the result beside it
const GHOST = 0.5;
export const SOURCES = { off: "Source: off", over: "Source: over it", beside: "Source: beside it" };

// `source` is the clip that the motion was captured from, if it is here; while it is `away` something else is shown.
export function makeScene(place, view, bench, { came, source, away }) {
  const frames = makeFrames(bench, "stage.frame");
  const clips = makeFrames(bench, "capture.frame");
  const orbit = makeOrbit(place, view, bench);
  const scene = { orbit, shows: "off" };
  const degrees = 180 / Math.PI;
  let frame = 0;
  let number = 0;
  let before = ""; // what was open

  scene.turned = orbit.turned;
  scene.home = orbit.home;
  scene.hint = () => (orbit.works && !orbit.space.shown ? "Fetching the models…" : "The model from elsewhere; a double click brings it back.");

  scene.of = (motion, played, open) => {
    number = played;
    if (open !== before) orbit.home();
    before = open;
    frames.of({ name: `played ${played}`, width: motion.width, height: motion.height, frames: motion.frames, open });
    orbit.of(played, motion.frames);
    const clip = source();
    if (clip) clips.of({ ...clip, open });
    else scene.shows = "off";
  };

  // Show a frame; true once the picture that is exported is here.
  scene.show = (t) => {
    frame = t;
    if (orbit.turned()) {
      if (!orbit.works) turned();
      view.frame = t;
      view.draw();
      return true;
    }
    const bitmap = frames.want(t);
    if (bitmap) Object.assign(view, { picture: bitmap, frame: t, number });
    view.draw();
    return Boolean(bitmap);
  };
  frames.came = (at) => at === frame && came();
  clips.came = () => view.draw();
  orbit.came = came;

  // Drag from here: the function it gives turns the models to where the pointer is.
  scene.grab = (event) => {
    const [x, y, turn, tilt] = [event.clientX, event.clientY, orbit.turn, orbit.tilt];
    if (!orbit.turned() && orbit.draw(frame)) orbit.clear(); // so that it is known where they are
    const to = orbit.grab();
    return (now) => to(turn + (now.clientX - x) / 115, Math.max(-1.5, Math.min(1.5, tilt + (now.clientY - y) / 115)));
  };

  let drawn = false;
  view.beneath = () => {
    const seen = !away() && orbit.turned() && number > 0 && orbit.draw(frame);
    if (drawn && !seen) orbit.clear();
    drawn = seen;
    return seen;
  };

  // Where no card is: one picture of Python's is asked for at a time, the newest place wins.
  let asking = false;
  let again = false;
  async function turned() {
    again = true;
    if (asking) return;
    asking = true;
    while (again) {
      again = false;
      try {
        const { bitmap } = await bench.picture("stage.turned", { frame, turn: orbit.turn * degrees, tilt: orbit.tilt * degrees });
        if (orbit.turned()) view.picture = bitmap;
        view.draw();
      } catch (error) {
        bench.say(error.message);
      }
    }
    asking = false;
  }

  // The source.

  scene.source = (shows) => {
    scene.shows = source() ? shows : "off";
    scene.fit();
  };
  scene.fit = () => {
    const beside = scene.shows === "beside" && !away() ? view.size[0] + GAP : 0;
    if (beside === view.beside) return view.draw();
    view.beside = beside;
    view.fit();
  };
  scene.next = () => {
    const names = Object.keys(SOURCES);
    scene.source(names[(names.indexOf(scene.shows) + 1) % names.length]);
  };
  scene.paint = (context) => {
    const clip = source();
    if (scene.shows === "off" || !clip || (scene.shows === "over" && orbit.turned())) return;
    const bitmap = clips.want(clip.start + Math.max(0, view.frame));
    scene.sourceFrame = bitmap ? view.frame : -1;
    if (!bitmap) return;
    context.globalAlpha = scene.shows === "over" ? GHOST : 1;
    context.drawImage(bitmap, view.x - view.beside * view.scale, view.y, view.scale * view.size[0], view.scale * view.size[1]);
    context.globalAlpha = 1;
  };
  view.canvas.scene = scene; // for tests
  return scene;
}
