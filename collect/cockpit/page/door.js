// Lets a person in: with the token after # in the address, which is never sent in one, or typed.
const door = document.getElementById("door");

async function enter(token) {
  const answer = await fetch("/login", { method: "POST", body: token });
  return answer.ok;
}

async function isOpen() {
  return (await fetch("/link.js", { method: "HEAD" })).ok;
}

async function begin() {
  const token = location.hash.slice(1);
  if (token) {
    history.replaceState(null, "", location.pathname);
    await enter(token);
  }
  if (!(await isOpen())) {
    door.hidden = false;
    return;
  }
  door.hidden = true;
  document.getElementById("cockpit").hidden = false;
  await import("./main.js").catch((error) => { // no STOP that does nothing
    document.getElementById("cockpit").hidden = true;
    document.getElementById("door-error").textContent = `This browser cannot show the robot: ${error.message}`;
    door.hidden = false;
  });
}

door.addEventListener("submit", async (event) => {
  event.preventDefault();
  if (await enter(document.getElementById("token").value)) begin();
  else document.getElementById("door-error").textContent = "Wrong token. The terminal shows the address that contains it.";
});

addEventListener("hashchange", () => location.reload()); // the address with the token, in the same tab
begin();
