// A socket that looks like an anywidget model: send(message), on("msg:custom", (event, buffers) => ...).
// It comes again by itself when the connection is lost, and tells that as {"kind": "connection", "open": false}.

export function socketModel(address) {
  const heard = new Set();
  const values = new Map();
  let socket = null;
  let wait = 250; // ms until the next try
  let closed = false;

  const tell = (event, buffers = []) => heard.forEach((hears) => hears(event, buffers));

  function open() {
    socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      wait = 250;
      tell({ kind: "connection", open: true });
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") return tell(JSON.parse(data));
      const length = new DataView(data).getUint32(0, true);
      const header = new TextDecoder().decode(new Uint8Array(data, 4, length));
      tell(JSON.parse(header), [new DataView(data, 4 + length)]);
    };
    socket.onclose = () => {
      if (closed) return;
      tell({ kind: "connection", open: false });
      setTimeout(open, wait);
      wait = Math.min(2 * wait, 4000);
    };
  }

  open();
  return {
    get: (name) => values.get(name),
    set: (name, value) => values.set(name, value),
    save_changes: () => {},
    on: (name, hears) => name === "msg:custom" && heard.add(hears),
    off: (name, hears) => heard.delete(hears),
    send: (message) => {
      if (socket.readyState !== WebSocket.OPEN) return false;
      socket.send(JSON.stringify(message));
      return true;
    },
    close: () => {
      closed = true;
      socket.close();
    },
  };
}
