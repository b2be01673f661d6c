// The bar: state and reason, who commands, link age, battery, disk, recording.

import {$, attribute, text} from "./dom.js";
import {stateWords} from "./words.js";

const LATE_MS = 700;

export function drawStatus(state, link) {
  const {mission, operator, robot, you} = state;
  let [words, mood, reason] = stateWords(mission);
  if (operator?.stop && !operator.mission) [words, mood, reason] = ["Stopped", "bad", `${operator.stop.because}. Nothing moves until somebody asks again.`];
  if (robot?.link) [words, mood, reason] = ["No link to the robot", "bad", `Do not count on STOP: use the remote. ${robot.link}`];
  if (!link.open || link.silentMs > 2000) [words, mood, reason] = ["No link to the console", "bad", lostWords(link, you)];
  text($("state"), words);
  attribute($("state"), "data-mood", mood);
  text($("reason"), reason);
  drawCommander(operator, you);
  drawAge(link);
  if (robot) drawMeters(robot, operator);
}

// Only the page that commands is waited for: whoever looks on, or commands from a terminal, holds nothing by being cut off.
function lostWords(link, you) {
  const held = you?.epoch ? "A walking robot is held." : "A walking robot walks on: look at it.";
  return `${link.refused ? `${link.refused} ` : ""}What is shown is old. ${held}`;
}

function drawCommander(operator, you) {
  const lease = operator?.lease, mine = Boolean(you?.epoch);
  text($("commander"), mine ? `you, ${you.name}` : lease ? `${lease.who || "somebody"} (${lease.how})` : "nobody");
  attribute($("commander"), "class", mine ? "mine" : lease ? "warn" : "");
}

function drawAge(link) {
  const ms = link.silentMs;
  text($("link-age"), !link.open || ms === Infinity ? "down" : ms < LATE_MS ? "live" : `${(ms / 1000).toFixed(1)} s old`);
  attribute($("link-age"), "class", !link.open ? "bad" : ms < LATE_MS ? "" : "warn");
}

function drawMeters(robot, operator) {
  const charge = robot.battery;
  text($("battery"), charge === null ? "not told" : `${Math.round(charge * 100)} %`);
  attribute($("battery"), "title", robot.silent.battery);
  attribute($("battery"), "class", charge !== null && charge < 0.25 ? "bad" : charge !== null && charge < 0.4 ? "warn" : "");
  const free = robot.disk_free_bytes;
  text($("disk"), free !== null ? `${(free / 1e9).toFixed(0)} GB` : robot.silent.disk ? "lost" : "–");
  attribute($("disk"), "title", robot.silent.disk);
  attribute($("disk"), "class", robot.silent.disk || (free !== null && free < 2e9) ? "bad" : free !== null && free < 10e9 ? "warn" : "");
  text($("recording"), operator?.mission ? "● trial" : "between");
}
