// A clip or motion capture from anywhere: chosen, or dropped on the page; it is copied into the folder and opened.
import { button, fill, make } from "./dom.js";
import { arrived, send } from "./sending.js";

const CLIPS = ".mp4,.mkv,.mov,.webm,.avi,.gif,.apng,.png,.webp,.jpg,.jpeg,.bvh";

// `takes(files)` is asked first where something is dropped: true where the desk that is seen has taken it.
export function makeArrivals(root, bench, takes) {
  const asked = make("input", { type: "file", accept: CLIPS }); // nobody sees it: a button opens its dialog
  const note = make("div.arriving", { role: "status", hidden: true });
  root.append(note);
  let going = null; // the file that is on its way
  asked.onchange = () => {
    take([...asked.files]);
    asked.value = "";
  };

  async function take([file, ...others]) {
    if (!file || going) return;
    const { largest, path } = bench.state.folder.at;
    if (others.length) return bench.say(`One clip at a time, these are ${others.length + 1} files. If they are the frames of one, put their folder into ${path}: it is listed as a clip then.`);
    if (file.size > largest) return bench.say(`${file.name} must have at most ${Math.round(largest / 2 ** 30)} GB: put it into the folder by hand`);
    if (!file.size) return bench.say(`${file.name} is empty: choose another file`);
    going = file;
    const before = bench.state.folder.at.open;
    const meter = make("progress", { max: 1, value: 0, "aria-label": `Copying ${file.name}` });
    fill(note, make("span", {}, `Copying ${file.name} into ${bench.state.folder.at.folder}`), meter, button("Cancel", "", () => (going = null)));
    note.hidden = false;
    const came = await send(bench, "folder.load", file, {
      progress: (done, total) => (meter.value = done / total),
      goesOn: () => going === file,
    });
    going = null;
    note.hidden = true;
    if (came && bench.state.folder.at.open === before) await asSheet(file.name);
  }

  // A single picture is opened as a sheet of drawings, once it is said how large one is.
  async function asSheet(name) {
    const { file, still, width, height, tile } = await arrived(bench, name).catch((error) => (bench.say(error.message), {}));
    if (!still) return;
    const side = (value, label) => make("input", { type: "number", min: 1, max: 16384, value, "aria-label": label });
    const [across, down] = [side(tile[0], "Width of a drawing"), side(tile[1], "Height of a drawing")];
    const open = async () => {
      const size = [across, down].map(({ value }) => Math.round(Number(value)));
      if (await bench.act("folder.open", { file, tile: size })) note.hidden = true;
    };
    fill(
      note,
      make("span", {}, `${file} is one picture, ${width} × ${height}. Of a sprite sheet, how large is one drawing?`),
      make("span.sizes", {}, across, "×", down),
      button("Open the sheet", "", open, "primary"),
      button("Cancel", "", () => (note.hidden = true)),
    );
    note.hidden = false;
    across.focus();
  }

  const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  let inside = 0; // elements under the pointer that were entered and not left
  root.addEventListener("dragenter", (event) => {
    if (hasFiles(event)) inside += 1;
    root.classList.toggle("dropping", inside > 0);
  });
  root.addEventListener("dragleave", (event) => {
    if (hasFiles(event)) inside -= 1;
    root.classList.toggle("dropping", inside > 0);
  });
  root.addEventListener("dragover", (event) => hasFiles(event) && event.preventDefault());
  root.addEventListener("drop", (event) => {
    inside = 0;
    root.classList.remove("dropping");
    if (!hasFiles(event) || event.defaultPrevented) return;
    event.preventDefault(); // or the browser leaves the page for the file
    const files = [...event.dataTransfer.files];
    if (!takes(files)) take(files);
  });
  return { choose: () => asked.click(), take };
}
