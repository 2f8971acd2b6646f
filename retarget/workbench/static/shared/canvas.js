// A canvas that fills its place, as sharp as the screen is, and is painted at most once for every picture of the screen.
import { make } from "./dom.js";

export function makeCanvas(el, properties = {}, name = "view") {
  const canvas = make(`canvas.${name}`, { tabIndex: 0, ...properties });
  el.append(canvas);
  return canvas;
}

// The canvas with as many pixels as its place has: [width, height, density], or null while it is not seen.
export function sized(canvas) {
  const dense = window.devicePixelRatio || 1;
  const [wide, tall] = [canvas.clientWidth, canvas.clientHeight];
  if (!wide || !tall) return null;
  const [width, height] = [Math.round(wide * dense), Math.round(tall * dense)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return [wide, tall, dense];
}

// A canvas' context cleared and in the page's pixels, or null while it is not seen.
export function cleared(canvas, context) {
  const size = sized(canvas);
  if (!size) return null;
  context.setTransform(size[2], 0, 0, size[2], 0, 0);
  context.clearRect(0, 0, size[0], size[1]);
  return size;
}

// However often it is asked for, `paint` runs once before the screen's next picture.
export function onceAPicture(paint) {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      paint();
    });
  };
}
