// The page: what it holds is put to work.

const page = decodeAll(JSON.parse(document.getElementById("data").textContent));
const player = page.episodes.length
  ? new Player(document.getElementById("player"), document.getElementById("charts"), page.episodes)
  : null;
if (player) {
  player.seek(player.period); // at the start no torque has acted yet
  if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) player.start();
}
