// What the desks share: the state as the server tells it, and messages to it, one action in flight at a time.  Where the
// way is long (`model.flights`), some of the same drag fly behind each other: each says where its gesture is from the
// gesture's beginning, and they are done in the order sent.

export function makeBench(model) {
  const listeners = new Map(); // kind of event -> functions
  const answers = new Map(); // id -> {resolve, reject}
  const queue = []; // actions that wait for the one in flight
  const flying = new Set();
  const most = model.flights ?? 1;
  let last = 0;
  let gestures = 0;
  const bench = { state: {}, undo: "", redo: "", running: "", open: false };

  const tell = (kind, event) => (listeners.get(kind) ?? []).forEach((hears) => hears(event));

  function post(message) {
    const id = ++last;
    return new Promise((resolve, reject) => {
      answers.set(id, { resolve, reject });
      if (model.send({ ...message, id }) === false) {
        answers.delete(id);
        reject(new Error("the connection to the workbench is lost"));
      }
    });
  }

  const drag = ({ newest, message }) => newest && message.gesture && `${newest} ${message.gesture}`;
  const follows = (one) => drag(one) && [...flying].every((other) => drag(other) === drag(one));

  function next() {
    while (queue.length && (!flying.size || (flying.size < most && follows(queue[0])))) {
      fly(queue.shift());
    }
  }

  async function fly(one) {
    flying.add(one);
    try {
      one.resolve(await post(one.message));
    } catch (error) {
      tell("refused", error.message);
      one.resolve(null);
    }
    flying.delete(one);
    next();
  }

  // An action.  Of those of a gesture with the same `newest` that still wait only the latest is sent: a drag never falls
  // behind, and what a drag ended with is not lost to the next.
  bench.act = (name, fields = {}, { newest = "", gesture = "" } = {}) =>
    new Promise((resolve) => {
      const message = { do: name, ...fields, ...(gesture && { gesture }) };
      const waiting = newest && queue.find((one) => one.newest === newest && (one.message.gesture ?? "") === gesture);
      if (waiting) {
        waiting.resolve(null);
        Object.assign(waiting, { message, resolve });
        return;
      }
      queue.push({ message, newest, resolve });
      next();
    });

  bench.work = (name, fields = {}) => post({ work: name, ...fields }).catch((error) => tell("refused", error.message));

  // Bytes: {event, view} with a DataView, or an error in a sentence.
  bench.look = (name, fields = {}) => post({ look: name, ...fields });

  bench.picture = async (name, fields = {}) => {
    const { event, view } = await bench.look(name, fields);
    const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
    const bitmap = await createImageBitmap(new Blob([bytes], { type: event.type }));
    return { ...event, bitmap };
  };

  bench.idle = () => !flying.size && !queue.length;
  bench.gesture = () => `${Math.random().toString(36).slice(2, 8)}-${++gestures}`;
  bench.on = (kind, hears) => {
    listeners.set(kind, [...(listeners.get(kind) ?? []), hears]);
  };
  bench.say = (sentence) => tell("refused", sentence);

  const hear = (event, buffers) => {
    const answer = answers.get(event.id);
    if (event.kind === "done" || event.kind === "seen") {
      answers.delete(event.id);
      answer?.resolve({ event, view: buffers[0] });
    } else if (event.kind === "refused") {
      answers.delete(event.id);
      if (answer) answer.reject(new Error(event.sentence));
      else tell("refused", event.sentence);
    } else if (event.kind === "state") {
      for (const [desk, sections] of Object.entries(event.changed)) {
        bench.state[desk] = { ...bench.state[desk], ...sections };
      }
      Object.assign(bench, { undo: event.undo, redo: event.redo, running: event.running });
      tell("state", event.changed);
    } else if (event.kind === "connection") {
      bench.open = event.open;
      if (!event.open) {
        for (const one of answers.values()) one.reject(new Error("the connection to the workbench was lost"));
        answers.clear();
      }
      tell("connection", event);
    } else {
      if (event.kind === "progress") bench.running = event.work;
      if (event.kind === "ended") bench.running = "";
      tell(event.kind, event);
    }
  };
  model.on("msg:custom", hear);
  bench.close = () => model.off("msg:custom", hear);
  return bench;
}
