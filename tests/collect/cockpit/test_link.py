"""Laws of the page's connection: STOP is said again until the robot has stopped because of it."""

from page_script import printed

PAGE = """
const timers = [], sockets = [], none = () => {};
globalThis.setInterval = (each) => timers.push(each);
globalThis.setTimeout = (each) => each();
globalThis.sessionStorage = { getItem: () => "page", setItem: none, removeItem: none };
globalThis.location = { protocol: "http:", host: "there" };
globalThis.WebSocket = class {
  static OPEN = 1;
  constructor() { Object.assign(this, { readyState: 1, bufferedAmount: 0, sent: [] }); sockets.push(this); }
  send(said) { this.sent.push(said); }
  close() {}
};
const { Link } = await import(process.argv[1]);
const link = new Link(new Proxy({}, { get: () => none }));
const hear = (said) => link.hear(JSON.stringify(said));
const frame = (phase, stamp = 1) => hear({ kind: "frame", frame: { phase, stamp } });
const again = () => { const before = sockets.at(-1).sent.length; timers.forEach((each) => each());
  return sockets.at(-1).sent.length - before; };
const found = [];
link.ask("stop");
const first = link.press;
frame("stopped");  // of before the press
sockets[0].readyState = 3;
sockets[0].onclose({ code: 1006 });
found.push(again());
hear({ kind: "heard", press: first + 1 });  // another press
frame("stopped");
found.push(again());
hear({ kind: "heard", press: first });
frame("driving");
found.push(again());
frame("stopped");
found.push(again());
link.ask("stop");
hear({ kind: "heard", press: link.press });
frame("driving", 1.5);  // may be of before it
found.push(again());
hear({ kind: "heard", press: link.press });
frame("driving", 2.5);  // it was released, and those who watch got no frame of it
found.push(again());
console.log(JSON.stringify(found));
"""


def test_a_stop_is_said_until_it_was_heard_and_the_robot_stopped_after_that():
    assert printed(PAGE, "link.js") == [1, 1, 1, 0, 1, 0]
