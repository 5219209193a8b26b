// The page: shows what the server says, sends what is pressed. It decides nothing.
import { draw } from "./plot.js";

const SILENT_MS = 1200; // the server speaks four times a second
const RETRY_MS = 500;
const HERE_MS = 300;
const known = {};
let socket = null;
let heardAt = 0;
let session = null;
let you = "viewer";

const $ = (id) => document.getElementById(id);
// Whose scene it is: the server tells the pages' cameras apart by it.
const [, page] = $("scene").getAttribute("src").split("/");
const say = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};

function fill(list, items, make) {
  const key = JSON.stringify(items);
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...items.map(make));
}

function element(tag, text, name = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  if (name) made.className = name;
  return made;
}

// --- to the server ---------------------------------------------------------------------------

function send(command) {
  if (socket === null || socket.readyState !== WebSocket.OPEN) {
    toast("Not sent: this page has no connection.", false);
    return false;
  }
  socket.send(JSON.stringify(command));
  return true;
}

function stop() {
  if (you !== "surgeon" || known.replay) return;
  close();
  const sent = send({ do: "stop" });
  $("stopped").className = "sent";
  say($("stopped"), sent ? "Stop sent" : "STOP NOT SENT: no connection. Use `fras stop` or the emergency stop.");
}

// --- from the server -------------------------------------------------------------------------

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/control`);
  socket.onmessage = (event) => {
    heardAt = performance.now();
    take(JSON.parse(event.data));
  };
  socket.onopen = here; // at once: a supervised procedure waits for it
  socket.onclose = () => {
    judge();
    setTimeout(connect, RETRY_MS);
  };
}

function here() {
  const open = socket !== null && socket.readyState === WebSocket.OPEN;
  if (open && document.visibilityState === "visible") socket.send(JSON.stringify({ do: "here" }));
}

function take(news) {
  for (const one of news.said ?? []) {
    if (one.you !== undefined) welcome(one);
    else toast(one.words, one.good);
  }
  delete news.said;
  Object.assign(known, news);
  show(news);
  judge();
}

function welcome(one) {
  if (session !== null && session !== one.session) location.reload();
  session = one.session;
  you = one.you;
  document.body.classList.toggle("viewer", you !== "surgeon");
}

function judge() {
  const silent = performance.now() - heardAt > SILENT_MS;
  const old = silent || !known.live;
  document.body.classList.toggle("old", old);
  document.body.classList.toggle("replay", Boolean(known.replay) && !silent);
  const words = silent ? "Not live: this page has lost its connection." : known.live_words ?? "";
  say($("cover"), words);
  say($("live"), old ? (silent ? "No connection" : "Not live") : known.replay ? "Replay" : "Live");
}

function show(news) {
  if ("headline" in news) say($("headline"), news.headline);
  if ("outcome" in news) say($("outcome"), news.outcome);
  if ("trial" in news) say($("trial"), news.trial ? `Procedure ${news.trial}` : "");
  if ("force" in news) force(news.force);
  if ("visibility" in news) visibility(news.visibility);
  if ("course" in news) plots();
  if ("stop" in news) {
    $("stopped").className = news.stop.state;
    say($("stopped"), news.stop.words);
  }
  if ("hold_words" in news) held();
  if ("waiting_plan" in news) {
    $("approval").hidden = news.waiting_plan === "";
    $("panels").classList.toggle("asking", news.waiting_plan !== "");
  }
  if ("decisions" in news) fill($("decisions"), news.decisions, (one) => element("li", one));
  if ("plans" in news) plan(news.plans);
  if ("why" in news) {
    $("why-card").hidden = news.why.length === 0;
    fill($("why"), news.why, (one) => element("li", one));
  }
  if ("changes" in news) {
    $("changes-card").hidden = news.changes.length === 0;
    fill($("changes"), news.changes, (one) => element("li", one));
  }
  if ("question" in news && news.question) say($("question"), news.question);
  if ("answer" in news) fill($("answer"), news.answer, (one) => element("li", one));
  if ("situation" in news) fill($("situation"), news.situation, fact);
  if ("services" in news) fill($("services"), news.services, (one) => element("li", `${one.name}: ${one.words}`, one.life));
  if ("log" in news) say($("log"), news.log);
  if ("log_fine" in news) $("log").className = news.log_fine ? "" : "bad";
  if ("colouring" in news || "force" in news) legend();
  if ("replay" in news) replay(news.replay);
}

function bar(gauge, share, name, marks, words) {
  const parts = [element("div", "", `fill ${name}`)];
  parts[0].style.width = `${Math.min(1, Math.max(0, share)) * 100}%`;
  for (const [at, kind] of marks) {
    const mark = element("div", "", `mark ${kind}`);
    mark.style.left = `calc(${at * 100}% - 1px)`;
    parts.push(mark);
  }
  gauge.replaceChildren(...parts);
  gauge.setAttribute("aria-label", words);
}

function force(one) {
  if (!one) return bar($("force"), 0, "", [], "not known"), say($("force-words"), "not known yet");
  const top = one.hard_limit_n * 1.15;
  bar($("force"), one.value_n / top, one.level, [[one.limit_n / top, "soft"], [one.hard_limit_n / top, "hard"]], one.words);
  say($("force-words"), one.words);
}

function visibility(one) {
  if (!one) return bar($("visibility"), 0, "", [], "not known"), say($("visibility-words"), "not known yet");
  const marks = one.threshold === null ? [] : [[one.threshold, "needed"]];
  bar($("visibility"), one.share, one.visible ? "seen" : "", marks, one.words);
  say($("visibility-words"), one.words);
}

function plots() {
  const course = known.course;
  const one = known.force;
  const limits = one ? [{ value: one.limit_n, colour: "#d55e00" }, { value: one.hard_limit_n, colour: "#b3261e" }] : [];
  const top = one ? Number((one.hard_limit_n * 1.15).toPrecision(2)) : 1;
  draw($("force-plot"), { at: course.at_s, values: course.force_n, top, colour: "#1f2328", limits, unit: " N" });
  const needed = known.visibility?.threshold;
  draw($("visibility-plot"), {
    at: course.at_s, values: course.visibility.map((value) => value * 100), top: 100, colour: "#0072b2",
    limits: needed == null ? [] : [{ value: needed * 100, colour: "#1f2328" }], unit: " %",
  });
}

function held() {
  const any = known.hold_words.length > 0;
  $("held").hidden = !any;
  fill($("holds"), known.hold_words, (one) => element("li", one));
  if (!any) close();
}

function plan(sections) {
  if (sections.length === 0) return $("plan").replaceChildren(element("p", "No plan yet."));
  const parts = [];
  for (const section of sections) {
    const title = element("h3", `${section.title} `);
    title.append(element("span", section.reason));
    const list = element("ol", "");
    for (const [text, state, note] of section.rows) {
      const row = element("li", text, state);
      if (note) row.append(element("small", note));
      list.append(row);
    }
    parts.push(title, list);
  }
  $("plan").replaceChildren(...parts);
}

function fact(one) {
  const made = element("li", one.text);
  if (one.evidence.length) made.append(element("small", one.evidence.join("; ")));
  return made;
}

const SCALES = {
  force: "linear-gradient(to right, #f8e5d9, #fdcaa4, #fb8a63, #d2426f, #802582, #2b115e)",
  lift: "linear-gradient(to right, #00224e, #35456c, #666970, #948e77, #c8b866, #fee838)",
  plain: "#f8e5d9",
};

function legend() {
  const by = known.colouring ?? "force";
  $("scale").style.background = SCALES[by];
  const top = known.force ? `${known.force.hard_limit_n.toFixed(2)} N, the hard limit` : "hard limit";
  say($("scale-low"), by === "force" ? "force: 0 N" : by === "lift" ? "moved: 0 mm" : "");
  say($("scale-high"), by === "force" ? top : by === "lift" ? "50 mm" : "");
  for (const button of $("colouring").children) button.setAttribute("aria-pressed", String(button.dataset.by === by));
}

function replay(one) {
  $("replay").hidden = !one;
  if (!one) return;
  const line = $("seek");
  line.min = one.begin_s;
  line.max = one.end_s;
  if (document.activeElement !== line) line.value = one.position_s;
  say($("position"), `${one.position_s.toFixed(1)} s of ${one.end_s.toFixed(1)} s`);
  say($("play"), one.phase === "playing" ? "Pause" : "Play");
  const passed = one.marks.filter((mark) => mark[0] <= one.position_s).at(-1);
  say($("mark"), passed ? passed[2] : "");
  $("rate").value = String(one.rate);
  fill($("damage"), one.damage, (text) => element("li", text));
  fill($("marks"), one.marks, ([at, kind, text]) => {
    const made = element("i", "", kind);
    made.style.left = `${((at - one.begin_s) / Math.max(1e-9, one.end_s - one.begin_s)) * 100}%`;
    made.title = text;
    made.onclick = () => send({ do: "replay", command: "seek_s", value: at });
    return made;
  });
}

function toast(words, good) {
  const made = element("p", words, good ? "" : "bad");
  $("said").append(made);
  setTimeout(() => made.remove(), 6000);
}

// --- what is pressed -------------------------------------------------------------------------

let agreed = {};

function ask() {
  agreed = known.holds;
  fill($("ask-holds"), known.hold_words, (one) => element("li", one));
  $("ask").hidden = false;
  $("no").focus();
}

function close() {
  $("ask").hidden = true;
}

function onKey(event) {
  const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(event.target?.tagName ?? "") && event.target.type !== "range";
  const stops = event.key === "Escape" || (event.code === "Space" && !typing);
  if (!stops || event.repeat) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  stop();
}

$("stop").onpointerdown = (event) => {
  if (event.button === 0) stop();
};
$("stop").onclick = (event) => {
  if (event.detail === 0) stop(); // not by a pointer: by the Enter key, or by a screen reader
};
$("resume").onclick = ask;
$("no").onclick = close;
$("yes").onclick = () => {
  close();
  send({ do: "resume", holds: agreed });
};
$("approve").onclick = () => send({ do: "approve", plan: known.waiting_plan });
$("reject").onclick = () => {
  if (send({ do: "reject", plan: known.waiting_plan, reason: $("objection").value })) $("objection").value = "";
};
for (const button of $("colouring").children) button.onclick = () => send({ do: "colour", by: button.dataset.by });
for (const button of $("places").children) button.onclick = () => send({ do: "look", page, place: button.dataset.place });
for (const button of document.querySelectorAll("[data-replay]")) {
  button.onclick = () => send({ do: "replay", command: button.dataset.replay });
}
$("play").onclick = () => send({ do: "replay", command: known.replay?.phase === "playing" ? "pause" : "play" });
$("seek").onchange = () => {
  send({ do: "replay", command: "seek_s", value: Number($("seek").value) });
  $("seek").blur();
};
$("rate").onchange = () => {
  send({ do: "replay", command: "rate", value: Number($("rate").value) });
  $("rate").blur();
};
window.addEventListener("keydown", onKey, { capture: true });
// A tablet that is turned: what stands still would be shown stretched.
window.addEventListener("resize", () => known.course && plots());

// Keys go to the frame that was clicked last: the stop must hear them there, too, from the moment
// on in which the frame is there. Its load event is too late, or may be over before this runs.
function hearScene() {
  const frame = $("scene").contentWindow;
  if (frame === null || frame.stopHears) return;
  frame.stopHears = true; // gone with the document, should it be loaded anew
  frame.addEventListener("keydown", onKey, { capture: true });
}

hearScene();
setInterval(hearScene, 50);
setInterval(judge, 100);
setInterval(here, HERE_MS);
connect();
