// The page: what it holds is put to work, and its colours follow the reader.

const page = decodeAll(JSON.parse(document.getElementById("data").textContent));
const player = page.episodes.length
  ? new Player(document.getElementById("player"), document.getElementById("charts"), page.episodes)
  : null;
if (player) {
  player.seek(player.period); // at the start no torque has acted yet
  if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) player.start();
}

const root = document.documentElement;
const darkSystem = window.matchMedia("(prefers-color-scheme: dark)");

function recolour() {
  if (player) player.recolour();
}

function otherTheme() {
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : darkSystem.matches;
  root.dataset.theme = dark ? "light" : "dark";
  recolour();
}

const theme = document.getElementById("theme");
theme.hidden = false;
theme.addEventListener("click", otherTheme);
darkSystem.addEventListener("change", recolour);
document.addEventListener("keydown", (event) => {
  const typing = event.ctrlKey || event.metaKey || event.altKey;
  if (!typing && event.key.toLowerCase() === "d") otherTheme();
});
