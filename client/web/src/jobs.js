// Jobs of a map: started, followed, decided about.
import { button, el, node, say } from "./dom.js";
import { call, stream } from "./rpc.js";

// Kinds that need no parameters, and those that can only propose.
const KINDS = ["optimize", "planes", "objects", "complete", "fade", "verify", "rebuild"];
const DRY = new Set(["optimize"]);
const SHOWN = 6;
const LOOK_EVERY_MS = 4000; // for jobs that others start

const stateOf = (job) => (job.state ?? "").replace("JOB_STATE_", "").toLowerCase();
const ended = (job) => !["queued", "running"].includes(stateOf(job));

export class Jobs {
  // `done(job)` is called when one has ended.
  constructor(done) {
    this.done = done;
    this.jobs = new Map();
    for (const kind of KINDS) el("job-kind").add(new Option(kind, kind));
    el("job-kind").onchange = () => this.offerDry();
    el("job-form").onsubmit = (event) => {
      event.preventDefault();
      this.start().catch((error) => say(error.message));
    };
    el("jobs").ontoggle = () => el("jobs").open && this.refresh();
    setInterval(() => el("jobs").open && !document.hidden && !this.watching && this.refresh(), LOOK_EVERY_MS);
    this.offerDry();
  }
  offerDry() {
    const dry = el("job-dry");
    dry.disabled = !DRY.has(el("job-kind").value);
    if (dry.disabled) dry.checked = false;
  }
  open(view) {
    this.view = view;
    this.jobs.clear();
    this.show();
    this.refresh();
  }
  async start() {
    const parameters = el("job-dry").checked ? { dry_run: "1" } : {};
    await this.startKind(el("job-kind").value, parameters);
  }
  async startKind(kind, parameters) {
    const { job } = await call("Jobs/Start", { map: this.view.name, kind, parameters });
    say(`job ${job.id} (${kind}) is queued`);
    el("jobs").open = true;
    await this.refresh();
  }
  async refresh() {
    const view = this.view;
    if (!view) return;
    try {
      const { jobs } = await call("Jobs/List", { map: view.name }, view.stop.signal);
      this.jobs = new Map((jobs ?? []).map((job) => [job.id, job]));
      this.show();
      const next = [...this.jobs.values()].find((job) => !ended(job));
      if (next && !this.watching) this.watch(view, next.id);
    } catch (error) {
      if (!view.stop.signal.aborted) say(error.message);
    }
  }
  // One at a time, as they run: a watch holds one of the browser's few connections.
  async watch(view, id) {
    this.watching = id;
    try {
      for await (const { job } of stream("Jobs/Watch", { map: view.name, id }, view.stop.signal)) {
        if (view !== this.view) break;
        this.jobs.set(id, job);
        this.show();
        if (!ended(job)) continue;
        say(`job ${id} (${job.kind}) ${stateOf(job)}${job.message ? `: ${job.message}` : ""}`);
        this.done(job);
      }
    } catch (error) {
      if (!view.stop.signal.aborted && error.code !== "unavailable") say(error.message);
    }
    this.watching = null;
    this.refresh();
  }
  actionsOf(job) {
    const act = (verb, method) => button(verb, `${verb} job ${job.id}`, async () => {
      await call(`Jobs/${method}`, { map: this.view.name, id: job.id });
      await this.refresh();
    });
    const state = stateOf(job);
    if (!ended(job)) return [act("cancel", "Cancel")];
    if (state === "proposed") return [act("accept", "Accept"), act("revert", "Revert")];
    const undoable = state === "succeeded" && job.id === this.current && ["optimize", "revert"].includes(job.kind);
    return undoable ? [act("revert", "Revert")] : [];
  }
  itemOf(job) {
    const item = node("li", node("b", `${job.id} ${job.kind}`), ` ${stateOf(job)} `);
    item.dataset.state = stateOf(job);
    if (!ended(job)) {
      const bar = node("progress");
      bar.value = job.progress ?? 0;
      bar.setAttribute("aria-label", `progress of job ${job.id}`);
      item.append(bar, ` ${job.phase ?? ""} `);
    }
    item.append(...this.actionsOf(job));
    if (job.message) item.append(node("br"), node("small", job.message));
    return item;
  }
  // `current`: the job that made the current epoch, which can be undone.
  setCurrent(current) {
    this.current = current;
    this.show();
  }
  show() {
    const focused = document.activeElement?.getAttribute("aria-label");
    const last = [...this.jobs.values()].sort((a, b) => Number(b.id) - Number(a.id)).slice(0, SHOWN);
    el("job-list").replaceChildren(...last.map((job) => this.itemOf(job)));
    if (!focused) return;
    [...el("job-list").querySelectorAll("button")].find((one) => one.getAttribute("aria-label") === focused)?.focus();
  }
}
