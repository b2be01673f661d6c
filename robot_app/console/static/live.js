// The live page: snapshots in, panels out, and a sign of life for each snapshot that was painted.

import {AskLine} from "./ask.js";
import {CameraStream, Picture, pictureWords} from "./camera.js";
import {$, attribute, clockTime, element, getJson, measured, shown, text, whenChanged} from "./dom.js";
import {Link} from "./link.js";
import {Evidence, drawCandidates, drawChecks} from "./panels.js";
import {Plan, loadSite} from "./plan.js";
import {Question} from "./question.js";
import {Speech} from "./speech.js";
import {drawStatus} from "./status.js";
import {Stop} from "./stop.js";

const SITE_AGAIN_MS = 2000;
const DRIVING = ["navigate", "re_observe", "query"];

export class Live {
  constructor({onLoggedOut}) {
    this.link = new Link({onState: (state) => { this.state = state; }, onChange: () => { this.stale = true; }, onLoggedOut});
    this.state = null; // the newest snapshot
    this.painted = null; // the one on the screen
    this.selected = null;
    this.live = null; // the newest picture, which came at liveAt
    this.liveAt = -Infinity;
    this.look = null; // {stamp, image}
    this.wantsLook = false;
    this.stop = new Stop(this.link);
    this.ask = new AskLine(this.link);
    this.speech = new Speech(() => this.ask.talk.talking);
    this.ask.talk.onListen = () => this.speech.hush();
    this.question = new Question(this.link, (answer) => this.ask.say(answer));
    this.plan = new Plan($("plan"), {onPick: (id) => this.select(id)});
    this.picture = new Picture($("camera"), $("camera-words"));
    this.evidence = new Evidence($("evidence"), $("evidence-for"));
    this.stream = new CameraStream((image) => { this.live = image; this.liveAt = performance.now(); this.fresh = true; });
    this.listen();
    this.candidates = whenChanged((_, mission, hands) => this.drawCandidates(mission, hands));
    this.log = whenChanged((said) => this.drawLog(said));
    this.checks = whenChanged((look) => drawChecks($("checks"), $("checks-for"), look));
  }

  listen() {
    $("show-live").addEventListener("click", () => { this.wantsLook = false; this.fresh = true; });
    $("show-look").addEventListener("click", () => { this.wantsLook = true; this.fresh = true; });
    $("plan-robot").addEventListener("click", () => this.aim(true));
    $("plan-all").addEventListener("click", () => this.aim(false));
    const tabs = [...document.querySelectorAll("[data-tab][role=tab]")];
    for (const tab of tabs) {
      tab.addEventListener("click", () => this.tab(tab.dataset.tab));
      tab.addEventListener("keydown", (event) => this.tabKey(event, tabs));
    }
    $("live").dataset.tab = "camera";
  }

  tab(name) {
    $("live").dataset.tab = name;
    for (const tab of document.querySelectorAll("[role=tab]")) {
      attribute(tab, "aria-selected", tab.dataset.tab === name);
      attribute(tab, "tabindex", tab.dataset.tab === name ? 0 : -1);
    }
  }

  // Arrow keys go from tab to tab, as screen readers announce them.
  tabKey(event, tabs) {
    const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (!step) return;
    event.preventDefault();
    const next = tabs[(tabs.indexOf(event.target) + step + tabs.length) % tabs.length];
    this.tab(next.dataset.tab);
    next.focus();
  }

  aim(follow) {
    follow ? this.plan.followRobot() : this.plan.fit();
    attribute($("plan-robot"), "aria-pressed", follow);
    attribute($("plan-all"), "aria-pressed", !follow);
  }

  async start() {
    this.link.start();
    this.stream.start();
    this.running = true;
    requestAnimationFrame(() => this.frame());
    await this.loadSite();
  }

  end() {
    this.running = false;
    this.link.end();
    this.stream.end();
  }

  async loadSite() {
    let whole = true;
    try {
      const site = await getJson("/api/site");
      const grid = await getJson("/api/grid").catch(() => { whole = false; return null; });
      this.plan.setSite(...(await loadSite(site, "/api/grid.png", grid)));
    } catch { whole = false; } // the link went down, as the bar says
    if (!whole && this.running) setTimeout(() => this.loadSite(), SITE_AGAIN_MS);
  }

  // What was painted in the frame before is on the screen now: that, and only that, is a sign of life.
  frame() {
    if (!this.running) return;
    requestAnimationFrame(() => this.frame());
    if (this.toBeat !== undefined) { this.link.beat(this.toBeat); this.toBeat = undefined; }
    this.link.check();
    if (this.state && (this.state !== this.painted || this.stale || this.fresh)) this.paint(this.state);
    else if (performance.now() - (this.ticked || 0) > 200) this.tick();
  }

  // Without news: how old what is shown has become.
  tick() {
    this.ticked = performance.now();
    if (!this.state) return text($("reason"), this.link.refused);
    drawStatus(this.state, this.link);
    this.question.tick();
    if (!this.wantsLook || !this.look) this.picture.say(this.liveWords());
  }

  liveWords() {
    return pictureWords(this.state.robot, performance.now() - this.liveAt);
  }

  paint(state) {
    const start = performance.now(), news = state !== this.painted;
    const {mission, operator} = state;
    this.stale = false;
    this.stop.reaches = !state.robot?.link;
    drawStatus(state, this.link);
    this.ask.show(state);
    this.question.show(operator.question, state.you?.epoch, mission?.candidates, answerWords(state));
    this.paintMission(state, mission);
    this.log(state.said || []);
    this.speech.show(state.speech, Boolean(state.you?.epoch));
    this.painted = state;
    this.link.seen = state.n;
    if (news) this.toBeat = state.n;
    measured("page-paint", start);
  }

  paintMission(state, mission) {
    const asked = state.operator.question;
    const hands = asked && state.you?.epoch && asked.options.length ? asked.id : null;
    if (asked?.object_id !== undefined && asked?.id !== this.askedFor) { this.askedFor = asked?.id; if (asked) this.selected = asked.object_id; }
    this.candidates([mission?.candidates, mission?.outcome, mission?.chosen, mission?.path_length_m, hands, this.selected], mission, hands);
    this.evidence.show(this.selected ?? mission?.chosen ?? null, mission);
    const look = mission?.looks.at(-1) || null;
    this.checks(look);
    this.paintPicture(state, mission, look);
    const under = mission && !mission.outcome;
    this.plan.show({
      robot: state.robot?.pose, track: mission?.track, path: under ? mission.path : [], goal: under ? mission.goal : null,
      candidates: mission?.candidates, chosen: mission?.chosen, selected: this.selected, objects: state.objects,
    });
    text($("plan-legend"), planWords(state, mission));
  }

  paintPicture(state, mission, look) {
    this.fresh = false;
    if (look && look.frame_stamp_ns !== this.lookStamp) this.loadLook(look);
    if (mission && !mission.outcome && DRIVING.includes(mission.state) && mission.state !== this.pictureState) this.wantsLook = false;
    this.pictureState = mission?.state;
    $("show-look").disabled = !this.look;
    const shows = this.wantsLook && this.look;
    attribute($("show-look"), "aria-pressed", Boolean(shows));
    attribute($("show-live"), "aria-pressed", !shows);
    if (shows) {
      this.picture.show(this.look.image, this.look.look);
      this.picture.say(`What was judged: ${this.look.look.verdict}. Dashed: where the map remembers it.`);
    } else {
      this.picture.show(this.live);
      this.picture.say(this.liveWords());
    }
  }

  async loadLook(look) {
    this.lookStamp = look.frame_stamp_ns;
    try {
      const response = await fetch(`/api/looks/${look.frame_stamp_ns}.jpg`, {credentials: "same-origin"});
      if (!response.ok) throw new Error(`The console answers ${response.status}.`);
      this.look = {look, image: await createImageBitmap(await response.blob())};
    } catch {
      this.lookStamp = null; // asked for again with the next snapshot: the link may have gone down meanwhile
      return;
    }
    this.wantsLook = true;
    this.fresh = true;
  }

  drawCandidates(mission, hands) {
    shown($("no-candidates"), !mission?.candidates.length);
    text($("no-candidates"), !mission ? "Nothing was asked for yet." : mission.outcome ? "None were chosen from." : "Looking through the memory …");
    text($("candidates-for"), mission?.target ? `for “${mission.target}”` : "");
    const act = hands === null ? null : {take: (number) => this.question.answer("take", number), leave: (number) => this.question.answer("not this one", number)};
    drawCandidates($("candidates"), mission, {onSelect: (id) => this.select(id), hands: act, selected: this.selected});
  }

  drawLog(said) {
    $("log").replaceChildren(...[...said].reverse().map((each) => element("li", {}, element("time", {}, clockTime(each.at_ms)), saidWords(each.text))));
  }

  select(id) {
    this.selected = id;
    this.stale = true;
    if (getComputedStyle($("evidence-panel")).display === "none") this.tab("candidates");
  }
}

// A trial is told by its path; on the page it is a link.
function saidWords(said) {
  const name = said.match(/^trial: (?:.*\/)?([\w.-]+\.mcap)$/)?.[1];
  return name ? element("a", {href: `#trials/${encodeURIComponent(name)}`}, "Recorded: look at this trial") : said;
}

function answerWords({you, operator}) {
  if (you?.role !== "operator") return "An operator answers.";
  return operator.lease ? "Another commands; take over to answer." : "Nobody commands; take command to answer.";
}

function planWords(state, mission) {
  if (state.robot?.silent?.pose) return state.robot.silent.pose;
  const room = mission?.goal && !mission.outcome ? "Blue: the way and where it will stand. " : "";
  return `${room}Numbers: candidates by rank.`;
}
