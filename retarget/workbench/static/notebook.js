// The workbench in a notebook.  It talks to a socket of its own on this machine; where there is no way to it, as when the
// notebook runs elsewhere, the notebook's own channel is taken: slower, but everything works.
import { socketModel } from "./socket.js";
import workbench from "./workbench.js";

const PATIENCE = 1500; // ms that the socket may take to open
const FLIGHTS = 3; // of a drag by the channel at once: what one takes there is mostly waiting, four frames long

// Where the socket is, as Python says once it knows whose page this is.
function ask(model) {
  return new Promise((resolve) => {
    const hear = (event) => {
      if (event.kind !== "socket") return;
      model.off("msg:custom", hear);
      resolve(event.address);
    };
    model.on("msg:custom", hear);
    model.send({ socket: location.origin });
  });
}

function opens(address) {
  return new Promise((resolve) => {
    let socket;
    const end = (result) => {
      clearTimeout(timer);
      if (socket) socket.onopen = socket.onerror = null;
      socket?.close();
      resolve(result);
    };
    const timer = setTimeout(() => end(false), PATIENCE);
    try {
      socket = new WebSocket(address);
      socket.onopen = () => end(true);
      socket.onerror = () => end(false);
    } catch {
      end(false); // a page that may not talk to another machine at all
    }
  });
}

// The notebook's channel as a model that the workbench knows: it hears events only, and asks for the state itself.
function channel(model) {
  const heard = new Map();
  const wrapper = {
    ...wrapped(model),
    flights: FLIGHTS,
    on: (name, hears) => {
      const inner = (event, buffers) => event.kind !== "socket" && hears(event, buffers?.map(viewed));
      heard.set(hears, inner);
      model.on(name, inner);
      model.send({ shown: true });
      hears({ kind: "connection", open: true }, []);
    },
    off: (name, hears) => model.off(name, heard.get(hears)),
    close: () => {},
  };
  return wrapper;
}

const wrapped = (model) => ({ get: (name) => model.get(name), send: (message) => (model.send(message), true) });
const viewed = (buffer) => (buffer instanceof DataView ? buffer : new DataView(buffer.buffer ?? buffer));

async function render({ model, el }) {
  el.classList.add("tooncap-cell");
  el.dataset.lmSuppressShortcuts = "true"; // what is typed here is for the workbench, not for the notebook
  el.addEventListener("keydown", (event) => event.stopPropagation());
  const address = await ask(model);
  const direct = Boolean(address) && (await opens(address));
  const to = direct ? socketModel(address) : channel(model);
  el.dataset.way = direct ? "socket" : "channel";
  const ends = workbench.render({ model: to, el });
  return () => {
    ends();
    to.close();
  };
}

export default { render };
