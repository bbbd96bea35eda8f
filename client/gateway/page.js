"use strict";
const $ = id => document.getElementById(id);
let job = null, urls = [];

function headers() {
  const token = $("token").value.trim();
  return token ? { Authorization: "Bearer " + token } : {};
}

function show(text, bad = false) {
  $("state-section").hidden = false;
  $("state").textContent = text;
  $("state").className = bad ? "result bad" : "";
  $("progress").hidden = bad;
}

async function ask(path, options = {}) {
  const answer = await fetch(path, { ...options, headers: { ...headers(), ...options.headers } });
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({ detail: answer.statusText }));
  throw new Error(textOf(problem));
}

function textOf(problem) {
  return problem.detail + (problem.reason ? " (" + problem.reason + ")" : "") + (problem.hint ? "; " + problem.hint : "");
}

function describe(of) {
  const progress = of.progress || {};
  if (progress.queue_position > 0) return "Waits, place " + progress.queue_position;
  const stage = (progress.stage || progress.state || of.state).replaceAll("_", " ");
  return progress.iteration > 0
    ? stage + ": iteration " + progress.iteration + ", largest move " + progress.max_displacement.toPrecision(3) : stage;
}

// By fetch: an EventSource cannot send a token.
async function follow(path) {
  const reader = (await ask(path + "/events")).body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "", last = null;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    text += value;
    const events = text.split("\n\n");
    text = events.pop();
    for (const event of events) {
      const data = event.split("\n").find(line => line.startsWith("data: "));
      if (!data) continue;
      last = JSON.parse(data.slice(6));
      show(describe(last));
      const share = last.progress && last.progress.share_done;
      if (share > 0) $("progress").value = share; else $("progress").removeAttribute("value");
    }
  }
  return last && !["waiting", "running"].includes(last.state) ? last : (await ask(path)).json();
}

async function link(id, path) {
  const answer = await ask(path);
  const url = URL.createObjectURL(await answer.blob());
  urls.push(url);
  $(id).href = url;
  const name = /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition") || "");
  if (name) $(id).download = name[1];
}

async function smooth() {
  const query = new URLSearchParams();
  for (const id of ["goal", "boundary", "tangled", "to"]) if ($(id).value) query.set(id, $(id).value);
  const body = new FormData();
  body.append("mesh", $("mesh").files[0]);
  show("Sends the file");
  $("progress").removeAttribute("value");
  const accepted = await ask("/v1/smooth?" + query, { method: "POST", body, headers: { Prefer: "respond-async" } });
  job = accepted.headers.get("Location");
  $("cancel").disabled = false;
  const end = await follow(job);
  if (end.state !== "done") throw new Error(end.problem ? textOf(end.problem) : "The job was " + end.state);
  show("Takes the result");
  await link("download", job + "/result");
  await link("summary", job + "/summary");
  $("report").srcdoc = await (await ask(job + "/report")).text();
  $("state-section").hidden = true;
  $("result-section").hidden = false;
  $("download").focus();
}

$("form").addEventListener("submit", async event => {
  event.preventDefault();
  urls.forEach(URL.revokeObjectURL);
  urls = [];
  $("result-section").hidden = true;
  $("start").disabled = true;
  try {
    await smooth();
  } catch (error) {
    show(error.message, true);
  }
  // Nobody else knows it.
  if (job) await ask(job, { method: "DELETE" }).catch(() => {});
  job = null;
  $("start").disabled = false;
  $("cancel").disabled = true;
});
$("cancel").addEventListener("click", () => { if (job) ask(job, { method: "DELETE" }).catch(error => show(error.message, true)); });
for (const type of ["dragover", "dragleave", "drop"]) {
  $("drop").addEventListener(type, event => {
    event.preventDefault();
    $("drop").classList.toggle("over", type === "dragover");
    if (type === "drop" && event.dataTransfer.files.length) $("mesh").files = event.dataTransfer.files;
  });
}
