// Small helpers: text is always text, never markup, and the page changes only where something changed.

export const $ = (id) => document.getElementById(id);

export function text(node, words) {
  if (node.textContent !== words) node.textContent = words;
}

export function attribute(node, name, value) {
  if (value === null || value === undefined) node.removeAttribute(name);
  else if (node.getAttribute(name) !== String(value)) node.setAttribute(name, String(value));
}

export function shown(node, yes) {
  if (node.hidden === yes) node.hidden = !yes;
}

// element("li", {class: "candidate", onclick: f}, child, "words")
export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

// How long something took, for the bench; the timeline of a page that is open for days is kept short.
const measures = new Map();

export function measured(name, start) {
  const count = (measures.get(name) || 0) + 1;
  measures.set(name, count);
  if (count % 2000 === 0) performance.clearMeasures(name);
  performance.measure(name, {start, end: performance.now()});
}

// Calls draw(value) only when the value differs from the one before.
export function whenChanged(draw) {
  let before;
  return (value, ...more) => {
    const now = JSON.stringify(value);
    if (now === before) return;
    before = now;
    draw(value, ...more);
  };
}

async function answerOf(url, options) {
  try {
    return await fetch(url, {credentials: "same-origin", ...options});
  } catch {
    throw new Error("There is no link to the console.");
  }
}

export async function getJson(url) {
  const response = await answerOf(url, {cache: "no-store"});
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw Object.assign(new Error(body.error || `The console answers ${response.status}.`), {status: response.status});
  return body;
}

export async function postJson(url, body = {}) {
  const response = await answerOf(url, {method: "POST", headers: {"content-type": "application/json"}, body: JSON.stringify(body)});
  const answer = await response.json().catch(() => ({}));
  if (!response.ok) throw Object.assign(new Error(answer.error || `The console answers ${response.status}.`), {status: response.status});
  return answer;
}

export const metres = (value) => (value === null || value === undefined ? "–" : `${value.toFixed(1)} m`);
export const clockTime = (ms) => new Date(ms).toLocaleTimeString([], {hour: "2-digit", minute: "2-digit", second: "2-digit"});
export const dayTime = (ms) => new Date(ms).toLocaleString([], {dateStyle: "medium", timeStyle: "short"});
