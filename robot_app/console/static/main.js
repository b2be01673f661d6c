// The page: who is logged in, which place is shown, light or dark.

import {$, attribute, getJson, postJson, shown, text} from "./dom.js";
import {Live} from "./live.js";
import {Trials} from "./trials.js";

const PAIRING = /^#pair=([\w-]+)$/;
const ENDED = "You were logged out: the session has ended, or the console was started anew.";

let live = null;
let leaving = false; // logging out by hand
const trials = new Trials();

async function begin() {
  theme(localStorage.getItem("theme") === "light" ? "light" : "dark");
  const pairing = location.hash.match(PAIRING), before = sessionStorage.getItem("logged-out") || "";
  sessionStorage.removeItem("logged-out");
  if (pairing) {
    history.replaceState(null, "", "/#live");
    try {
      return enter(await postJson("/api/pair", {token: pairing[1]}));
    } catch (error) {
      return resume(error.message); // a link that was opened twice shuts nobody out
    }
  }
  await resume(before);
}

// Whoever is logged in goes on; refusal: why a link was no way in.
async function resume(refusal) {
  try {
    enter(await getJson("/api/me"));
  } catch (error) {
    login(refusal || (error.status === 401 ? "" : error.message));
  }
}

function login(words) {
  live?.end();
  live = null;
  shown($("app"), false);
  shown($("login"), true);
  text($("login-error"), words);
  $("login-name").focus();
}

function enter() {
  shown($("login"), false);
  shown($("app"), true);
  live = new Live({onLoggedOut: () => { if (!leaving) sessionStorage.setItem("logged-out", ENDED); location.reload(); }});
  window.openbelief = live; // for the tests and the bench, which look at what is painted
  live.start();
  place();
}

function place() {
  if (!live) return;
  const [where, name] = location.hash.slice(1).split("/");
  const atTrials = where === "trials";
  shown($("live"), !atTrials);
  shown($("trials"), atTrials);
  attribute($("to-live"), "aria-current", atTrials ? null : "page");
  attribute($("to-trials"), "aria-current", atTrials ? "page" : null);
  if (atTrials) trials.show(name ? decodeURIComponent(name) : null);
  else trials.end();
}

function theme(name) {
  document.documentElement.dataset.theme = name;
  text($("theme"), name === "dark" ? "Light" : "Dark");
  if (live) live.stale = true;
}

$("login-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const button = event.submitter;
  if (button) button.disabled = true;
  try {
    const who = await postJson("/api/login", {name: $("login-name").value, password: $("login-password").value});
    $("login-password").value = "";
    enter(who);
  } catch (error) {
    text($("login-error"), error.message);
  } finally {
    if (button) button.disabled = false;
  }
});
$("theme").addEventListener("click", () => {
  const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("theme", next);
  theme(next);
});
$("logout").addEventListener("click", async () => {
  leaving = true;
  try {
    await postJson("/api/logout");
    location.reload();
  } catch (error) {
    leaving = false;
    live?.ask.say({ok: false, text: `Not logged out: ${error.message}`});
  }
});
window.addEventListener("hashchange", () => (PAIRING.test(location.hash) ? location.reload() : place())); // a link opened in this tab

// A keyboard on the screen covers the page's foot, and STOP, where the browser lays out nothing anew for it.
const view = window.visualViewport;
view?.addEventListener("resize", () => {
  if (view.scale > 1.01) return; // enlarged by hand
  const covered = innerHeight - view.height > 1;
  $("app").style.height = covered ? `${view.height}px` : "";
  if (covered) window.scrollTo(0, 0);
});
begin();
