// In which state the page is: a name for its look, the words of the chip, and what to do about it.
const STATES = {
  preparing: ["getting ready …", "Getting ready. This takes some seconds."],
  ready: ["ready: press Start", ""],
  driving: ["recording", ""],
  practice: ["practice: not recorded", ""],
  paused: ["paused", ""],
  watching: ["you watch", ""],
  lost: ["no input: let go of everything", "Let go of everything. The robot stands still. Once all is let go, drive on."],
  stopped: ["STOPPED", "The robot is stopped. Look at it first. Then press Release."],
  silent: ["nothing new", "Nothing new for some seconds: an episode is being saved, or the connection hangs. What you see is old."],
  offline: ["no connection", "No connection. The robot brakes. Trying again …"],
};
const LATE = "Too slow a connection to drive: what you see is older than 0.3 s.";

const WATCHED = {
  ready: "you watch: not begun", driving: "you watch: recording", paused: "you watch: paused", lost: "you watch: no input",
};

function nameOf({ isConnected, isDriver, isSilent, frame }) {
  if (!isConnected) return "offline";
  if (!frame) return "preparing";
  if (isSilent) return "silent";
  if (!isDriver && frame.phase in WATCHED) return "watching";
  return frame.phase === "driving" && frame.practice ? "practice" : frame.phase;
}

function overWords({ participant, saved, folder, next, trouble }) {
  if (participant) return `The session of ${participant} ${trouble ? `ended with an error: ${trouble}` : "is over."}`;
  const kept = saved ? `${saved} ${saved === 1 ? "episode" : "episodes"}${folder ? ` in ${folder}` : ""}.` : "no episode was saved.";
  if (trouble) return `The recording ended with an error: ${trouble}\nSaved before: ${kept}`;
  const what = `Recording is over: ${kept}`;
  return saved && next.length ? `${what}\nNext:\n${next.join("\n")}` : what;
}

// Returns {name, chip, banner}; `frame` is the newest one and `over` what the recording said at its end, if they are there.
export function stateOf(now) {
  if (now.over?.trouble) return { name: "failed", chip: "no connection: the recording failed", banner: overWords(now.over) };
  if (now.over) return { name: "over", chip: "no connection: recording is over", banner: overWords(now.over) };
  const name = nameOf(now), [chip, banner] = STATES[name];
  const isPractice = name === "watching" && now.frame.practice && now.frame.phase === "driving";
  if (name === "watching") return { name, chip: isPractice ? "you watch: practice, not recorded" : WATCHED[now.frame.phase], banner: "" };
  if (name === "offline" && !now.isDriver) return { name, chip, banner: "No connection. Trying again …" }; // who drives may go on
  if (name === "stopped" && !now.isDriver) return { name, chip, banner: "The robot is stopped. Only the driver can release it." };
  return { name, chip, banner: banner || (now.isLate ? LATE : "") };
}
