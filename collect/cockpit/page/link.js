// The connection to the server: says where the inputs are, hears what happens; comes back by itself.
const RETRY = 700; // [ms]
const RELEASED = 1; // a frame so much newer than a STOP shows what came of it [s]
const AGAIN = 200; // between two times that STOP is said [ms]
const REPLACED = 4001; // this page is open elsewhere too, a copy of the tab: that one drives

let ownName = "";

function keepName(name) {
  ownName = name;
  try { sessionStorage.setItem("page", name); } catch { /* not allowed: a reload is another page */ }
}

function pageName() {
  try { ownName = sessionStorage.getItem("page") || ownName; } catch { /* not allowed */ }
  if (!ownName) keepName(Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => b.toString(16).padStart(2, "0")).join(""));
  return ownName;
}

// A session that has ended looks like a broken connection: the page's door asks for the token.
async function enterAgain() {
  const answer = await fetch("/link.js", { method: "HEAD" }).catch(() => null);
  if (answer?.status === 403) location.reload();
}

export class Link {
  // handlers: {stage, frame, you, error, picture, connected, over}
  constructor(handlers) {
    this.handlers = handlers;
    this.sequence = 0;
    this.stamp = 0;
    this.press = 0; // which press of STOP the robot has not answered yet; 0 for none
    this.heard = 0; // which one the server has heard
    this.heardAt = 0; // the stamp of the frame before that
    setInterval(() => { if (!this.isClogged) this.sayStop(); }, AGAIN);
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/drive?page=${pageName()}`);
    this.socket.binaryType = "arraybuffer";
    this.sequence = 0;
    let wasOpen = false;
    this.socket.onopen = () => { wasOpen = true; this.handlers.connected(true); };
    this.socket.onclose = (event) => {
      if (!wasOpen) enterAgain();
      if (event.code === REPLACED) keepName("");
      if (this.isOver) return;
      this.handlers.connected(false);
      setTimeout(() => this.open(), RETRY);
    };
    this.socket.onmessage = (event) => this.hear(event.data);
  }

  hear(data) {
    if (data instanceof ArrayBuffer) {
      const bytes = new Uint8Array(data);
      this.handlers.picture(bytes[0], new Blob([bytes.subarray(1)], { type: "image/jpeg" }));
      return;
    }
    const said = JSON.parse(data);
    if (said.kind === "over") this.leave();
    if (said.kind === "frame") this.stamp = said.frame.stamp;
    if (said.kind === "heard") {
      if (this.heard !== said.press) this.heardAt = this.stamp;
      this.heard = said.press;
      return;
    }
    // Those who watch do not get each frame: of a stop that was released at once there may be none.
    if (said.kind === "frame" && this.heard === this.press && (said.frame.phase === "stopped" || this.stamp > this.heardAt + RELEASED)) this.press = 0;
    this.handlers[said.kind](said[said.kind] ?? said);
  }

  // Nothing to come back to; the server waits for it, so that nobody misses the last words.
  leave() {
    this.isOver = true;
    this.socket.close();
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  get isClogged() {
    return this.isOpen && this.socket.bufferedAmount > 4096;
  }

  say(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  // Where the inputs are; left out while what was said before is not gone yet: only the newest counts.
  // After STOP nobody steers until the robot has stopped.
  drive(input) {
    if (this.isClogged) return;
    this.sequence += 1;
    this.say({ kind: "drive", seq: this.sequence, echo: this.stamp, ...input, on: input.on && !this.press });
  }

  ask(what, value = true) {
    if (what !== "stop" || !value) return this.say({ kind: "ask", what, value });
    this.press = 1 + crypto.getRandomValues(new Uint32Array(1))[0];
    return this.sayStop();
  }

  // Said again until it was heard and a frame after that says that the robot is stopped; the number says that it is the same press.
  sayStop() {
    if (this.press) this.say({ kind: "ask", what: "stop", value: true, press: this.press });
  }
}
