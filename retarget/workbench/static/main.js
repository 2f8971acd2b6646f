// The page of its own: the workbench on a socket to the server that the page came from.
import { socketModel } from "./socket.js";
import workbench from "./workbench.js";

const address = new URL("socket" + location.search, location.href);
address.protocol = "ws:";
workbench.render({ model: socketModel(address), el: document.getElementById("workbench") });
