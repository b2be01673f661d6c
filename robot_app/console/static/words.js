// What a state is called on the screen, and its mood (colour and shape).

const STATES = {
  query: ["Getting ready", "go"], retrieve: ["Choosing", "go"], await_approval: ["Waiting for your yes", "ask"],
  navigate: ["Walking", "go"], verify: ["Looking", "go"], re_observe: ["Looking again", "go"], exclude: ["Choosing", "go"],
};
const ENDS = {
  CONFIRMED: ["Found", "good"], FAILED: ["Not found", "bad"], NAVIGATION_FAILED: ["Could not get there", "bad"],
  CANCELLED: ["Stopped", "bad"], FAULT: ["Fault", "bad"], UNFINISHED: ["Cut off", "bad"],
};

export function endWords(end) {
  return ENDS[end] || [end, "bad"];
}

// [words, mood, reason] of a mission, live or recorded.
export function stateWords(mission) {
  if (!mission) return ["Ready", "", "Ask for a thing."];
  if (mission.outcome) {
    const [words, mood] = endWords(mission.outcome.end);
    return [words, mood, `“${mission.sentence}”: ${mission.outcome.reason}`];
  }
  const [words, mood] = STATES[mission.state] || [mission.state, "go"];
  if (mission.held) return ["Held", "ask", mission.held];
  const way = mission.state === "navigate" && mission.remaining_m !== null ? ` ${mission.remaining_m.toFixed(1)} m to go.` : "";
  const chosen = mission.candidates.find((each) => each.object_id === mission.chosen);
  if (mission.question) return ["Waiting for your yes", "ask", `“${mission.sentence}”${chosen ? `: ${chosen.label}?` : ""}`];
  return [words, mood, `“${mission.sentence}”${chosen ? `: ${chosen.label}.` : ""}${way}`];
}

export const STATUS_WORDS = {
  candidate: "", chosen: "current", confirmed: "✓ confirmed", rejected: "✕ rejected", "no matching mask": "✕ rejected",
  "set aside": "– set aside", declined: "– declined by you",
};

export function statusKind(status) {
  if (["candidate", "chosen", "confirmed", "set aside", "declined"].includes(status)) return status;
  return "rejected";
}
