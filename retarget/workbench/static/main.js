// The page of its own: the workbench on a socket to the server that the page came from.
//
// The token leaves the address bar at once, where everybody who looks at the screen would read it; the browser keeps it
// for this server alone, so that the page can be loaded again, and a second time beside the first.
import { make } from "./shared/dom.js";
import { socketModel } from "./socket.js";
import workbench from "./workbench.js";

const KEPT = "tooncap token";
const el = document.getElementById("workbench");

function token() {
  const given = new URLSearchParams(location.search).get("token");
  try {
    if (given) localStorage.setItem(KEPT, given);
    const kept = localStorage.getItem(KEPT);
    if (given) history.replaceState(null, "", location.pathname);
    return kept;
  } catch {
    return given; // a browser that keeps nothing: then the address has to
  }
}

const found = token();
if (found) {
  const address = new URL(`socket?token=${encodeURIComponent(found)}`, location.href);
  address.protocol = "ws:";
  workbench.render({ model: socketModel(address), el });
} else {
  const words = make("p", {}, "Open the address that tooncap printed when it started, with its token.");
  el.append(make("div.tooncap.alone", {}, make("main.start", {}, make("div.card", {}, make("h1", {}, "This is a workbench of tooncap"), words))));
}
