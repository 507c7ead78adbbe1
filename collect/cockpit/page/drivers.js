// Beside a policy: who drives what now, in a line of plain words.
const listed = (words, last = "and") => (words.length < 2 ? words.join() : `${words.slice(0, -1).join(", ")} ${last} ${words.at(-1)}`);
const DRIVES = { person: "you", policy: "the policy" };

function gripperWords({ grippers }, hands) {
  const said = hands.map(({ name }, index) => [name && `${name} `, DRIVES[grippers[index]]].join(""));
  return grippers.length ? ` ${hands.length > 1 ? "Grippers" : "Gripper"}: ${listed(said)}.` : "";
}

// groups: the parts of the robot, [{name, channels}]; keys: names of the keys for an action
export function driverWords({ phase, drivers, mask }, groups, stage, keys) {
  const of = (channels) => groups.filter((group) => group.channels.some((each) => channels.includes(each)));
  const named = (channels) => of(channels).map(({ name }) => (["left", "right"].includes(name) ? `the ${name} hand` : `the ${name}`));
  const mine = listed(named(drivers.person)), its = listed(named(drivers.policy)), may = listed(named(mask), "or");
  const take = `Hold a key to take ${may}.`;
  if (phase === "stopped") return "STOPPED: the policy stands still, too.";
  if (phase !== "driving") return `The policy stands still. Press ${keys.start}, and it drives. ${take}`;
  if (!mine && !its) return `The policy has no plan yet: the robot brakes. ${take}`;
  const words = !mine ? `The policy drives ${its}. ${take}` : its ? `You drive ${mine}, the policy ${its}.` : `You drive ${mine}, the policy waits. Let go, and it drives on.`;
  return words + (stage.gripper ? gripperWords(drivers, stage.hands) : "");
}

// Who drives some channels: a mark and a word; nobody else does, so the robot completes them.
export function driverOf({ person, policy }, channels) {
  const [mine, its] = [person, policy].map((own) => channels.some((each) => own.includes(each)));
  return mine && its ? ["◐", "both"] : mine ? ["●", "you"] : its ? ["◆", "policy"] : ["○", "robot"];
}
