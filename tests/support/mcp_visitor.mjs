// A visit by the official JavaScript client: node mcp_visitor.mjs stdio COMMAND ... | http URL; prints what each step showed.
import { readFileSync } from "node:fs";
import { Client } from "@modelcontextprotocol/sdk/client/index.js";
import { StdioClientTransport } from "@modelcontextprotocol/sdk/client/stdio.js";
import { StreamableHTTPClientTransport } from "@modelcontextprotocol/sdk/client/streamableHttp.js";

const PROMPT = "put the red cube in the bin";
const STEPS = [{ skill: "pick", arguments: { object: "red_cube" } }, { skill: "place_in", arguments: { container: "grey_bin" } }];
const PATIENCE = { timeout: 300000 };

const [way, ...command] = process.argv.slice(2);
const transport = way === "stdio"
  ? new StdioClientTransport({ command: command[0], args: command.slice(1), stderr: "pipe" })
  : new StreamableHTTPClientTransport(new URL(command[0]));
const client = new Client({ name: "visitor", version: "1" });
const shown = {};
const must = (holds, what) => { if (!holds) throw new Error(what); };
const call = async (name, args = {}, options = {}) => (await client.callTool({ name, arguments: args }, undefined, { ...PATIENCE, ...options })).structuredContent;
// By how much the joint that moved furthest between two looks did, rad.
const away = (look, other) => Math.max(...look.state.q.map((angle, joint) => Math.abs(angle - other.state.q[joint])));
const place = (look) => look.scene.objects.find((item) => item.id === "red_cube").position;

async function visit() {
  await client.connect(transport);
  const { tools } = await client.listTools();
  must(tools.every((tool) => tool.outputSchema && tool.annotations), "a tool has no output schema or annotations");
  shown.tools = `${tools.length}, each with output schema and annotations`;

  const first = await call("look");
  must(first.scene.objects.map((item) => item.id).includes("red_cube"), "look shows no red_cube");
  shown.look = first.scene.objects.map((item) => item.id).join(", ");

  const checked = await call("check", { steps: STEPS });
  const turned = await call("check", { steps: STEPS.slice(1) });
  must(checked.ok && !turned.ok, "check: the plan is fine, its second half is not");
  shown.check = `plan ok; without its pick: ${turned.problems[0].error.message}`;

  const tried = await call("simulate", { steps: STEPS });
  must(tried.ok && tried.would_work.length === 2, "simulate: both calls would work");
  must(String(place(await call("look"))) === String(place(first)), "simulate moved the cube");
  shown.simulate = `${tried.would_work.length} calls would work; the cube stays`;

  must(!(await call("judge")).success, "judge: nothing is done yet");
  const phases = [];
  const ran = await call("run", { prompt: PROMPT }, { onprogress: (progress) => phases.push(progress.message) });
  must(ran.success && phases.length > 4, "run: done, with progress");
  shown.run = `${ran.done.length} calls done, ${phases.length} messages of progress`;
  must((await call("judge")).success, "judge: it is done");

  must((await call("reset", { seed: 0 })).seed === 0, "reset: to seed 0");
  must(String(place(await call("look"))) === String(place(first)), "reset: the cube is where it was");
  shown.reset = "the cube is where it was";
  must(!(await call("judge")).success, "judge: not any more");
  shown.judge = "no before, yes after the run, no after the reset";

  const stop = new AbortController();
  let moves;
  const moving = new Promise((resolve) => { moves = resolve; });
  const onprogress = (progress) => { if (progress.message.endsWith(": approach")) moves(); };
  const ended = call("run", { prompt: PROMPT }, { signal: stop.signal, onprogress }).then(() => "finished", () => "cancelled");
  await moving;
  while (away(first, await call("look")) < 0.1);
  stop.abort();
  must((await ended) === "cancelled", "cancel: the run went on to its end");
  while ((await call("look")).doing !== null);
  const [stopped, later] = [await call("look"), await call("look")];
  must(away(stopped, later) < 2e-3, "cancel: the arm still moves");
  must(stopped.scene.held === null && String(place(stopped)) === String(place(first)), "cancel: the cube was moved");
  shown.cancel = "stopped on the way to the cube; arm still, cube untouched";
  must(!(await call("judge")).success, "judge: a run that was cancelled has done nothing");

  const gone = await client.callTool({ name: "pick", arguments: { object: "elephant" } });
  must(gone.isError && gone.structuredContent.error.code === "object_not_found", "an error has a code");
  shown.error = gone.structuredContent.error.code;
  const { resources } = await client.listResources();
  const { prompts } = await client.listPrompts();
  must(resources.length >= 3 && prompts.some((prompt) => prompt.name === "do"), "resources and prompts are listed");
  shown.lists = `${resources.length} resources, ${prompts.length} prompts`;
}

let failed = "";
try {
  await visit();
} catch (error) {
  failed = error.message;
}
await client.close();
const { version } = JSON.parse(readFileSync(new URL("node_modules/@modelcontextprotocol/sdk/package.json", import.meta.url)));
console.log(JSON.stringify({ client: `JavaScript SDK ${version}`, shown, failed }));
