// The page: who is logged in, which place is shown, light or dark.

import {$, attribute, getJson, postJson, shown, text} from "./dom.js";
import {Live} from "./live.js";
import {Trials} from "./trials.js";

let live = null;
const trials = new Trials();

async function begin() {
  theme(localStorage.getItem("theme") === "light" ? "light" : "dark");
  const pairing = location.hash.match(/^#pair=([\w-]+)$/);
  if (pairing) {
    history.replaceState(null, "", "/#live");
    try {
      return enter(await postJson("/api/pair", {token: pairing[1]}));
    } catch (error) {
      return login(error.message);
    }
  }
  try {
    enter(await getJson("/api/me"));
  } catch (error) {
    login(error.status === 401 ? "" : error.message);
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
  live = new Live({onLoggedOut: () => location.reload()});
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
$("logout").addEventListener("click", async () => { await postJson("/api/logout"); location.reload(); });
window.addEventListener("hashchange", place);

// A keyboard on the screen covers the page's foot, and STOP, where the browser lays out nothing anew for it.
const view = window.visualViewport;
view?.addEventListener("resize", () => {
  if (view.scale > 1.01) return; // enlarged by hand
  const covered = innerHeight - view.height > 1;
  $("app").style.height = covered ? `${view.height}px` : "";
  if (covered) window.scrollTo(0, 0);
});
begin();
