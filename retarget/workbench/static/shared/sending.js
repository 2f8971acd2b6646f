// A file into the opened folder, piece by piece, for a message has its largest size.
const PIECE = 300 * 1024; // bytes

// `action` takes {name, at, data, last}.  False where it was refused, which has been said then, or called off.
export async function send(bench, action, file, { progress = () => {}, goesOn = () => true } = {}) {
  let at = 0;
  do {
    const piece = await readable(bench, file.slice(at, at + PIECE));
    if (!piece) return false;
    const last = at + piece.length >= file.size;
    if (!goesOn() || !(await bench.act(action, { name: file.name, at, data: base64(piece), last }))) {
      await bench.act("folder.drop", { name: file.name });
      return false;
    }
    at += piece.length;
    progress(at, file.size);
  } while (at < file.size);
  return true;
}

// Under which name it came to lie in the folder, and whether it is a single picture.
export async function arrived(bench, name) {
  const { view } = await bench.look("folder.arrived", { name });
  return JSON.parse(new TextDecoder().decode(new Uint8Array(view.buffer, view.byteOffset, view.byteLength)));
}

async function readable(bench, blob) {
  try {
    return new Uint8Array(await blob.arrayBuffer());
  } catch {
    const { path } = bench.state.folder.at;
    bench.say(`The browser could not read it. If it is a folder of pictures, put it into ${path}: it is listed as a clip then.`);
    return null;
  }
}

function base64(bytes) {
  let text = "";
  for (let n = 0; n < bytes.length; n += 8192) text += String.fromCharCode(...bytes.subarray(n, n + 8192));
  return btoa(text);
}
