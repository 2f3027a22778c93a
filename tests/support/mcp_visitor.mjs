// A visit by the official JavaScript client: node mcp_visitor.mjs stdio COMMAND ... | http URL; prints what held.
import { Client } from "@modelcontextprotocol/sdk/client/index.js";
import { StdioClientTransport } from "@modelcontextprotocol/sdk/client/stdio.js";
import { StreamableHTTPClientTransport } from "@modelcontextprotocol/sdk/client/streamableHttp.js";

const [way, ...command] = process.argv.slice(2);
const transport = way === "stdio"
  ? new StdioClientTransport({ command: command[0], args: command.slice(1), stderr: "pipe" })
  : new StreamableHTTPClientTransport(new URL(command[0]));
const client = new Client({ name: "visitor", version: "1" });
await client.connect(transport);
const told = [];
const call = async (name, args = {}, options = {}) => (await client.callTool({ name, arguments: args }, undefined, options)).structuredContent;
const check = (what, holds) => { if (!holds) throw new Error(what); told.push(what); };
const { tools } = await client.listTools();
check("tools have output schemas and annotations", tools.every((tool) => tool.outputSchema && tool.annotations));
const look = await call("look");
check("look", look.scene.objects.some((item) => item.id === "red_cube"));
const steps = [{ skill: "pick", arguments: { object: "red_cube" } }, { skill: "place_in", arguments: { container: "grey_bin" } }];
check("check", (await call("check", { steps })).ok);
check("check turns down", !(await call("check", { steps: steps.slice(1) })).ok);
check("simulate", (await call("simulate", { steps })).would_work.length === 2);
check("judge before", !(await call("judge")).success);
const phases = [];
const ran = await call("run", { prompt: "put the red cube in the bin" }, { onprogress: (p) => phases.push(p.message), timeout: 300000, resetTimeoutOnProgress: true });
check("run with progress", ran.success && phases.length > 4);
check("judge after", (await call("judge", {}, { timeout: 120000 })).success);
check("reset", (await call("reset", { seed: 0 })).seed === 0);
check("judge after reset", !(await call("judge")).success);
const stop = new AbortController();
let moving;
const moves = new Promise((resolve) => { moving = resolve; });
const cancelled = call("run", { prompt: "put the red cube in the bin" }, { signal: stop.signal, onprogress: (p) => { if (/: approach$/.test(p.message)) moving(); }, timeout: 300000 }).then(() => false, () => true);
await moves;
stop.abort();
check("cancel", await cancelled);
while ((await call("look")).doing !== null);
check("the arm stands still", JSON.stringify((await call("look")).state.q.map((x) => x.toFixed(2))) === JSON.stringify((await call("look")).state.q.map((x) => x.toFixed(2))));
check("resources", (await client.listResources()).resources.length >= 3);
check("prompts", (await client.listPrompts()).prompts.map((p) => p.name).includes("do"));
const error = await client.callTool({ name: "pick", arguments: { object: "elephant" } });
check("typed error", error.isError && error.structuredContent.error.code === "object_not_found");
await client.close();
console.log(JSON.stringify(told));
