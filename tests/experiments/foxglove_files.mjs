// Reads exports with Foxglove's own MCAP reader, holds every checksum, and their messages and schemas against Foxglove's own:
//
//     npm install @mcap/core @foxglove/schemas @foxglove/crc fzstd ajv    # in a folder of its own
//     NODE_PATH=$PWD/node_modules node …/tests/experiments/foxglove_files.mjs FILE.mcap…
//
// Ends with an error where something is not as it should be.
import fs from "node:fs";
import { createRequire } from "node:module";
const require = createRequire(import.meta.url);
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { crc32 } = require("@foxglove/crc");
const fzstd = require("fzstd");
const foxglove = require("@foxglove/schemas/jsonschema");
const Ajv = require("ajv");

const decompressHandlers = { zstd: (bytes, size) => fzstd.decompress(bytes, new Uint8Array(Number(size))) };
const text = (bytes) => new TextDecoder().decode(bytes);

function must(condition, what) {
  if (!condition) throw new Error(what);
}

// Without what is for people, keys in order.
function bare(schema) {
  if (Array.isArray(schema)) return schema.map(bare);
  if (typeof schema !== "object") return schema;
  const keys = Object.keys(schema).filter((key) => key !== "description" && key !== "$comment");
  return Object.fromEntries(keys.sort().map((key) => [key, bare(schema[key])]));
}

async function readByIndex(bytes) {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (at, count) => bytes.slice(Number(at), Number(at + count)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const ajv = new Ajv({ strict: false });
  const validators = new Map();
  for (const [id, schema] of reader.schemasById) {
    const theirs = foxglove[schema.name.replace("foxglove.", "")];
    const same = JSON.stringify(bare(JSON.parse(text(schema.data)))) === JSON.stringify(bare(theirs));
    must(same, `${schema.name}: another schema than Foxglove's`);
    validators.set(id, ajv.compile(theirs));
  }
  const counts = {};
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    const valid = validators.get(channel.schemaId);
    must(valid(JSON.parse(text(message.data))), `${channel.topic}: ${JSON.stringify(valid.errors)}`);
    counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
  }
  const found = Object.values(counts).reduce((sum, count) => sum + count, 0);
  must(BigInt(found) === reader.statistics.messageCount, `${found} messages by the index`);
  return counts;
}

function readFromTheBeginning(bytes) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  let messages = 0;
  const last = {};
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Message") ++messages;
    last[record.type] = record;
  }
  must(reader.done(), "the file does not end where it should");
  const summary = Number(last.Footer.summaryStart);
  const magic = 8, crc = 4, dataEnd = 9 + crc;
  must(crc32(bytes.slice(0, summary - dataEnd)) === last.DataEnd.dataSectionCrc, "checksum of the data");
  must(crc32(bytes.slice(summary, bytes.length - magic - crc)) === last.Footer.summaryCrc, "checksum of the summary");
  return messages;
}

for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(fs.readFileSync(path));
  const counts = await readByIndex(bytes);
  console.log(`${path}: ${JSON.stringify(counts)}, ${readFromTheBeginning(bytes)} messages from its beginning on`);
}
