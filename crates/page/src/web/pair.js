/** Two recordings side by side, each in a page of its own. The server plays both by one clock. */

import { make } from "./dom.js";
import { takeToken } from "./socket.js";

// The frames are of the same site and tab, so that they find it where it is stored.
takeToken(location.hash);
for (const [path, title] of [
  ["./", "First recording"],
  ["beside/", "Second recording"],
]) {
  const frame = make("iframe");
  frame.title = title;
  frame.src = path;
  document.body.append(frame);
}
